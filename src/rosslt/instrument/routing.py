"""Replaces what a node imports by counterparts of the same names that keep provenance.

Only rewritten code gets counterparts. After each import, the imported object is looked up here by identity, not by
name, so that `import rospy`, `from rospy import *` and re-exported names all work. Other packages keep the originals,
except those that publish for the node (`LIBRARIES`): they get a replacement of rospy.
"""

import contextlib
import functools
import importlib
import math
import sys
import time
import types
from typing import Any, Callable, Collection, Dict, List

import rosgraph
import rospy

from rosslt import node, srv, values
from rosslt.instrument import exact_classes, reloading
from rosslt.instrument.cells import loaded_files
from rosslt.instrument.location_rules import FORM, NUMBER, WHOLE
from rosslt.instrument.losses import LOSSES
from rosslt.instrument.program_functions import MATH
from rosslt.instrument.publishing import Publisher, Service
from rosslt.instrument.reconfiguring import tracked_server

#: Modules of ROS that publish, subscribe and call services in the name of the node.
LIBRARIES = (
    'actionlib.action_client',
    'actionlib.action_server',
    'interactive_markers.interactive_marker_server',
    'message_filters',
    'tf2_ros.static_transform_broadcaster',
    'tf2_ros.transform_broadcaster',
)

#: The makers of counterparts for modules that are loaded only if a node uses them: {name: function of the module}.
_LATE: Dict[str, Callable[[types.ModuleType], Any]] = {}
_counterparts: Dict[int, Any] = {}
_kept = []  # objects known by their ids must not go away
_told = set()
#: The services of this room, once there is a node.
_services: List[Any] = []


class Counterpart(types.ModuleType):
    """A module with some other things in it; all else is the original's.

    Args:
        original: the module.
        others: {name: the object under that name instead}.
    """

    def __init__(self, original: types.ModuleType, others: Dict[str, object]) -> None:
        super().__init__(original.__name__, original.__doc__)
        names = vars(self)
        names.update({name: thing for name, thing in vars(original).items() if name != '__dict__'})
        names.update(others)
        names['__original__'] = original
        # In the module and not in its class: of a class that has one, Python would look up each name by a slow way.
        names['__getattr__'] = lambda name: route(getattr(original, name))

    def __setattr__(self, name: str, value: object) -> None:
        setattr(self.__original__, name, value)
        super().__setattr__(name, value)

    def __dir__(self) -> Any:
        return dir(self.__original__)


def route(thing: object, origin: str = '') -> Any:
    """Return the counterpart of an imported object, or the object itself if there is none.

    Args:
        thing: what was imported.
        origin: the module that was imported, or from which it was taken.
    """
    _tell_libraries()
    _make_counterparts(origin)
    if type(thing) is types.ModuleType:
        _make_counterparts(thing.__name__)
    return _counterparts.get(id(thing), thing)


def _make_counterparts(imported: str) -> None:
    """Make the counterparts of a module, of what is in it, and of the packages that it is in."""
    for name in list(_LATE):
        is_related = (name + '.').startswith(imported + '.') or (imported + '.').startswith(name + '.')
        if is_related and name in _LATE and name in sys.modules:
            module = sys.modules[name]
            counterpart = _LATE.pop(name)(module)
            replace(module, counterpart)
            _show_in_package(name, counterpart)


def _show_in_package(name: str, counterpart: Any) -> None:
    """Have the package of a module, and those that this is in, show its counterpart."""
    package, _, last = name.rpartition('.')
    while package:
        original = sys.modules[package]
        shown = _counterparts.get(id(original))
        if shown is None:
            shown = Counterpart(original, {last: counterpart})
            replace(original, shown)
        else:
            vars(shown)[last] = counterpart  # and not the package itself
        counterpart = shown
        package, _, last = package.rpartition('.')


def route_all(names: Dict[str, object], origin: str = '') -> None:
    """`route` for all that a module has, after `from ... import *`."""
    for name, thing in list(names.items()):
        routed = route(thing, origin)
        if routed is not thing:
            names[name] = routed


def replace(original: object, counterpart: object) -> None:
    """Register the counterpart that rewritten code gets instead of an original."""
    _counterparts[id(original)] = counterpart
    _kept.append(original)


def replace_module(name: str) -> Callable[[Any], Any]:
    """A decorator: the function makes the counterpart of the module of that name, once it is imported."""

    def added(make: Callable[[types.ModuleType], Any]) -> Callable[[types.ModuleType], Any]:
        _LATE[name] = make
        return make

    return added


def _tell_libraries() -> None:
    for name in LIBRARIES:
        module = sys.modules.get(name)
        if module is not None and name not in _told and getattr(module, 'rospy', None) is rospy:
            _told.add(name)
            module.rospy = _LIBRARY_ROSPY  # type: ignore[attr-defined]


def _tell_of_namesake(name: str, argv: Any = None, anonymous: bool = False, *_: object, **__: object) -> None:
    """Say where a node of the name of this one runs already, if one does; the arguments are those of `init_node`."""
    remapped = (rospy.names.get_mappings() if argv is None else rosgraph.names.load_mappings(argv)).get('__name')
    if anonymous and not remapped:
        return
    full_name = rosgraph.names.resolve_name(remapped or name, rospy.get_caller_id())
    where = node.where_it_runs(full_name)
    if where is not None:
        print(
            f'rosslt run: {full_name} runs already, in {where}: ROS ends that one, as this one takes its name. '
            'To have both, give this one another name, `__name:=NAME`',
            file=sys.stderr,
            flush=True,
        )


def init_node(*args: Any, **kwds: Any) -> None:
    """`rospy.init_node`, which also makes this node's locations known."""
    if not node.is_initialized():
        _tell_of_namesake(*args, **kwds)
    rospy.init_node(*args, **kwds)
    if _services:
        return  # rospy takes a second call with the same arguments, and does nothing
    node.start()
    node.MEMORY.begins.append(_make_known)
    node.make_all_known_with(lambda: _make_known((NUMBER, WHOLE, FORM)))
    for cells in loaded_files():
        cells.renew()
        cells.take_over()
    _services.append(rospy.Service('~rosslt/find_losses', srv.FindLosses, LOSSES.find))
    reloading.start()


def _make_known(verdicts: Collection[str] = (NUMBER, WHOLE)) -> None:
    """Have numbers be locations, whether they reach a message or not: by default those that a person would change."""
    for cells in loaded_files():
        cells.make_known(verdicts)


_UNSET = object()


def get_param(param_name: str, default: object = _UNSET) -> Any:
    """`rospy.get_param`, with the parameter itself as the source of numbers and texts.

    Truth values stay plain, as a node may ask for them by `is`. Before there is a node, texts do as well, which may
    become its name, and private parameters, which are others by then.
    """
    defaults = () if default is _UNSET else (default,)
    if not isinstance(param_name, str) or (not node.is_started() and param_name.startswith('~')):
        return rospy.get_param(param_name, *defaults)
    if not node.is_started():
        value = rospy.get_param(param_name, _UNSET)
        if value is _UNSET:
            return rospy.get_param(param_name, *defaults)
        place = node.call_site(sys._getframe(1))
        name = rospy.resolve_name(param_name)
        return _with_later_sources(value, lambda: node.read_parameter(place, name))
    with contextlib.suppress(KeyError):
        return _with_plain_truths(node.read_parameter(sys._getframe(1), param_name, *defaults))
    return rospy.get_param(param_name, *defaults)  # which says what is missing


def _with_later_sources(value: object, read: Callable[[], Any]) -> Any:
    """Return the value of a parameter whose numbers look up their sources when these are first needed.

    Args:
        value: what it says.
        read: reads it, once there is a node.
    """
    if isinstance(value, dict):
        return {key: _with_later_sources(part, lambda key=key: read()[key]) for key, part in value.items()}  # type: ignore
    if isinstance(value, list):
        return [_with_later_sources(part, lambda at=at: read()[at]) for at, part in enumerate(value)]  # type: ignore
    if type(value) not in (float, int):
        return value

    def origin(number: object) -> Any:
        reading: Any = None
        with contextlib.suppress(LookupError, TypeError):  # its kind may have changed
            reading = read() if node.is_started() else None
        plain = values.untracked(reading)
        if type(plain) is not type(number) or plain != number:
            return ()
        return values.widened(reading) if type(number) is int else reading  # of an int that may become a float

    (later,) = values.lazy([value], [origin])
    return later


def set_param(param_name: str, param_value: object) -> None:
    """`rospy.set_param`; the next reading in this node gives the value that was set."""
    rospy.set_param(param_name, param_value)
    if node.is_started():
        node.parameter_was_set(param_name)


def delete_param(param_name: str) -> None:
    """`rospy.delete_param`; the node reads the parameter as one that is not set."""
    rospy.delete_param(param_name)
    if node.is_started():
        node.parameter_was_set(param_name)


def _with_plain_truths(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _with_plain_truths(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_with_plain_truths(part) for part in value]
    return value._plain if type(getattr(value, '_plain', None)) is bool else value


def _rospy() -> Counterpart:
    others = {
        'Publisher': Publisher,
        'Subscriber': node.Subscriber,
        'Service': Service,
        'ServiceProxy': node.ServiceProxy,
        'delete_param': delete_param,
        'get_param': get_param,
        'get_param_cached': get_param,
        'init_node': init_node,
        'set_param': set_param,
        'wait_for_message': node.wait_for_message,
        **{name: node.begins_round(getattr(rospy, name)) for name in ('is_shutdown', 'sleep', 'spin')},
    }
    for name, thing in others.items():
        replace(getattr(rospy, name), thing)
    return Counterpart(rospy, others)


def _math() -> Counterpart:
    for name, function in MATH.items():
        replace(getattr(math, name), function)
    return Counterpart(math, MATH)


def _time() -> Counterpart:
    sleep = node.begins_round(time.sleep)
    replace(time.sleep, sleep)
    return Counterpart(time, {'sleep': sleep})


ROSPY = _rospy()
# Parameters that libraries read, mostly sizes of queues, reach no message.
_LIBRARY_ROSPY = Counterpart(ROSPY, {'get_param': rospy.get_param, 'get_param_cached': rospy.get_param_cached})
replace(rospy, ROSPY)
replace(math, _math())
replace(time, _time())


@replace_module('numpy')
def _numpy(original: types.ModuleType) -> Any:
    from rosslt.instrument.numpy_routing import arrays, look_like_numpy

    look_like_numpy()
    linalg, functions = arrays.replacements(original.linalg), arrays.replacements(original)
    for module, others in ((original.linalg, linalg), (original, functions)):
        for name, function in others.items():
            replace(getattr(module, name), function)
    replace(original.linalg, Counterpart(original.linalg, linalg))
    return Counterpart(original, {**functions, 'linalg': route(original.linalg)})


@replace_module('functools')
def _functools(original: types.ModuleType) -> Any:
    caches = {name: getattr(exact_classes, name) for name in ('cache', 'lru_cache') if hasattr(original, name)}
    for name, function in caches.items():
        replace(getattr(original, name), function)
    return Counterpart(original, caches)


@replace_module('dynamic_reconfigure.server')
def _dynamic_reconfigure(original: types.ModuleType) -> Any:
    server = tracked_server(original.Server, original.extract_params)
    replace(original.Server, server)
    return Counterpart(original, {'Server': server})


@replace_module('tf2_ros')
def _tf2_ros(original: types.ModuleType) -> Any:
    # Broadcasters are tf2's own, which publish by this rospy.
    classes = {name: one for name, one in node.tf_counterparts().items() if name in ('Buffer', 'TransformListener')}
    for name, one in classes.items():
        replace(getattr(original, name), one)
    return Counterpart(original, classes)


@replace_module('tf2_geometry_msgs')
def _tf2_geometry_msgs(original: types.ModuleType) -> Any:
    functions = {
        name: _with_numbers_of(getattr(original, name), function)
        for name, function in node.tf_functions().items()
        if hasattr(original, name)
    }
    for name, function in functions.items():
        replace(getattr(original, name), function)
    return Counterpart(original, functions)


def _with_numbers_of(original: Any, tracked: Any) -> Any:
    """A function of messages that gives the numbers of one function with the provenance of a second one."""

    @functools.wraps(original)
    def function(*arguments: Any) -> Any:
        result = original(*arguments)
        if not any(map(values.is_tracked, arguments)):
            return result
        arrays = values.numpy_arrays()
        known = dict(values.leaves(tracked(*arguments)))
        for path, number in values.leaves(result):
            if isinstance(number, float):
                *inner, last = path.split('.')
                same = arrays.same_number(number, arrays.python_number(known[path]))
                setattr(functools.reduce(getattr, inner, result), last, same)
        return result

    return function


@replace_module('tf')
def _tf(original: types.ModuleType) -> Any:
    transformations = route(importlib.import_module('tf.transformations'))
    # Its listeners look up in a buffer of tf2_ros, and compute with numpy and tf.transformations.
    listener = sys.modules['tf.listener']
    names = {'tf2_ros': 'tf2_ros', 'numpy': 'numpy', 'transformations': 'tf.transformations'}
    for name, module in names.items():
        setattr(listener, name, route(importlib.import_module(module)))
    return Counterpart(original, {'transformations': transformations})


@replace_module('tf_conversions')
def _tf_conversions(original: types.ModuleType) -> Any:
    return Counterpart(original, {'transformations': route(original.transformations)})


@replace_module('tf.transformations')
def _transformations(original: types.ModuleType) -> Any:
    from rosslt.instrument import transformations

    functions = transformations.tracked_functions(original, route(importlib.import_module('numpy')), route(math))
    for name, function in functions.items():
        replace(getattr(original, name), function)
    return Counterpart(original, functions)
