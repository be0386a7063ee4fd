"""This process as a node: its start, and the calls that need it."""

import contextlib
import functools
import os
import re
import sys
import threading
from types import FrameType
from typing import (
    Any,
    Callable,
    Dict,
    Iterable,
    Iterator,
    List,
    Optional,
    Sequence,
    Tuple,
    Union,
)

import rospy

from rosslt import values
from rosslt.node.change.node_errors import ENDS, THREAD_ENDS, TIMER_RAISES
from rosslt.node.json_scalars import Refused
from rosslt.node.location_server import SETTINGS, Owner
from rosslt.node.locations.call_sites import CallSite, call_site, identity_of, name_of, word_of
from rosslt.node.locations.composed import readable
from rosslt.node.locations.directory import Directory
from rosslt.node.locations.external import ExternalLocation
from rosslt.node.locations.location import HeldLocation, LiteralLocation, Location, Readable, location_id
from rosslt.node.locations.location_arguments import checked_limits
from rosslt.node.locations.source_files import SOURCE_FILES
from rosslt.node.memory.plain_copies import PLAIN_COPIES
from rosslt.node.memory.remembered import MEMORY
from rosslt.node.memory.rounds import watch_first_round
from rosslt.node.rospy_internals import is_initialized, shut_down_without_deadlock

_owner = Owner()
_BY_CALL = _owner.locations.by_call
_starting = threading.Lock()


def init_node(name: str, *args: object, **rospy_options: object) -> None:
    """Start this node: `rospy.init_node`, and the services that make its locations known and changeable.

    Args:
        name, and all others: as in `rospy.init_node`.

    Raises:
        rospy.ROSInitException, ValueError: as in `rospy.init_node`.
    """
    rospy.init_node(name, *args, **rospy_options)
    start()


def start() -> None:
    """Make this node's locations known and changeable: what `init_node` does after `rospy.init_node`. For those who
    have called that one.

    Raises:
        rospy.ROSException: `rospy.init_node` has not been called.
    """
    with _starting:
        if not is_started():
            if not is_initialized():
                raise rospy.ROSException('rosslt.node.start() needs rospy.init_node() to have been called')
            _owner.serve()
            shut_down_without_deadlock()
            watch_first_round()
            PLAIN_COPIES.watch()
            sys.excepthook = functools.partial(_end_by, sys.excepthook)
            threading.excepthook = functools.partial(_end_thread_by, threading.excepthook)


def _end_by(report: Callable[..., Any], kind: object, error: BaseException, traceback: object) -> None:
    """The main program raises an exception: report it, and take back the change that may have done it."""
    _owner.main_ends = True
    report(kind, error, traceback)
    _take_back(error, ENDS)
    # What comes until the process has ended is refused, unless a thread of it goes on.
    others = [one for one in threading.enumerate() if one is not threading.main_thread()]
    _owner.main_ends = all(one.daemon for one in others) and not sys.flags.inspect


def _end_thread_by(report: Callable[[Any], Any], raised: Any) -> None:
    """Do what `_end_by` does if a thread raises an exception. A `rospy.Timer` goes on once the change is taken back."""
    report(raised)
    thread, is_timer = raised.thread, isinstance(raised.thread, rospy.Timer)
    if _take_back(raised.exc_value, TIMER_RAISES if is_timer else THREAD_ENDS) and is_timer:
        try:
            thread.run()
        except Exception as error:
            _end_thread_by(report, threading.ExceptHookArgs((type(error), error, error.__traceback__, thread)))


def _take_back(error: Optional[BaseException], what_ends: str) -> bool:
    if not isinstance(error, Exception):
        return False
    return _owner.take_back_what_ends_it(error, what_ends)


def is_started() -> bool:
    """True if this process is a node whose locations are known."""
    return bool(_owner.name)


def location(
    value: object = None,
    name: Optional[str] = None,
    key: object = None,
    minimum: Optional[float] = None,
    maximum: Optional[float] = None,
    read_only: bool = False,
    *,
    getter: Optional[Callable[[], Any]] = None,
    setter: Optional[Callable[[Any], None]] = None,
    on_change: Optional[Callable[[Any], None]] = None,
    weight: Optional[float] = None,
) -> Any:
    """A value that can be changed at runtime (the paper's `create_location`, section IV-A).

    The call in the code identifies it: the same call again, in a loop or a callback, gives its current value. It may
    be called before `init_node`, and becomes a location of the node then.

    Args:
        value: the literal: a float, int, str or bool; or a message, list or dict of them, each leaf of which
            becomes a location (except time stamps, sequence numbers and byte arrays).
        name: its name below `<node>/rosslt/`, words joined by `/`; by default made of file, function and variable. The
            same name with the same literal is the same location, wherever it is read.
        key: tells the turns of a loop apart; anything with a `str()`.
        minimum, maximum: bounds that changes must keep, in the unit of the value.
        read_only: take no change.
        getter, setter: instead of a literal, functions that read and write a scalar somewhere else. The exception of
            a setter is the reason of a refusal; without a setter the location is read-only.
        on_change: called with the new value, as this call returns it, soon after a change of it is in force: in a
            thread of its own, once for a change of several leaves, and with the latest value if changes come
            faster.
        weight: how hard it is to move, against 1 of others: told to those who change it together with others.

    Returns:
        The current value, tracked; for a message, list or dict a new one.

    Raises:
        ValueError: the name is malformed or taken, the literal is out of bounds, or the bounds make no sense.
        TypeError: the literal is of a type that cannot be a location, or a bound is not a number.
    """
    if (value is None) == (getter is None):
        raise TypeError('location() takes either a value or a getter')
    frame = sys._getframe(1)
    # Programs read locations in their inner loops: all that is done only once is elsewhere.
    told = key if key.__class__ in _TOLD_APART else (word_of(_plain(key)),)
    read = _BY_CALL.get((id(frame.f_code), frame.f_lasti, name, told))
    if read is None:
        limits = {'read_only': read_only, 'minimum': minimum, 'maximum': maximum, 'weight': weight}
        first = value if getter is None else getter()
        make = functools.partial(_created, frame, first, name, key, limits, getter, setter, on_change)
        read = _owner.locations.at_call(frame, name, told, make)
    return read.tracked


#: The types of keys that are equal only if they are one key: 1, 1.0 and True are equal in Python, their words are not.
_TOLD_APART = frozenset((type(None), int, str))


def _plain(key: Any) -> Any:
    """A key without its provenance."""
    plain = values.plain_scalar(key)
    return key if plain is None else plain


def _created(
    frame: FrameType,
    value: Any,
    name: Optional[str],
    key: object,
    given: Dict[str, Any],
    getter: Optional[Callable[[], Any]],
    setter: Optional[Callable[[Any], None]],
    on_change: Optional[Callable[[Any], None]],
) -> Readable:
    """The Readable of a call of `location`."""
    site = call_site(frame)
    with _named_place(site):
        limits = {
            'read_only': given['read_only'],
            **checked_limits(given['minimum'], given['maximum'], given['weight']),
        }
        base, identity = _named(name, key, site)
        limits['is_named'] = name is not None
        made: List[Readable] = []
        if on_change is not None:
            limits['changed'] = (functools.partial(_call_with_value, on_change, made),)
        if getter is not None:
            made.append(_owner.locations.add(ExternalLocation(identity, base, site, value, getter, setter, **limits)))
        else:
            add = functools.partial(_add_literal, site, base, identity, limits)
            made.append(readable(value, add))
        return made[0]


def _call_with_value(function: Callable[[Any], None], made: List[Readable]) -> None:
    if made:  # else a leaf has changed before all leaves were created
        function(made[0].tracked)


def _add_literal(
    site: CallSite, base: str, identity: str, limits: Dict[str, object], literal: Any, path: Tuple[str, ...]
) -> Location:
    """The location of one leaf of what `location` was given."""
    if isinstance(literal, (str, bool)):
        if not path and (limits['minimum'], limits['maximum']) != (None, None):
            raise TypeError(f'bounds are for numbers, and {literal!r} is not a number')
        limits = {**limits, 'minimum': None, 'maximum': None}
    return _owner.add_literal(
        LiteralLocation('\n'.join([identity, *path]), '/'.join([base, *path]), site, literal, **limits)
    )


def add_location(
    name: str,
    site: CallSite,
    getter: Callable[[], Any],
    setter: Optional[Callable[[Any], None]] = None,
    **limits: Any,
) -> Location:
    """A location that is not a call in this node's code, for example a number in a script. For the rooms above.

    Args:
        name: as in `location`; it is also what identifies the location.
        site: the CallSite, which is where it stands.
        getter, setter: as in `location`.
        limits: `minimum`, `maximum`, `read_only`, `weight`, as in `location`; `is_named`, whether people know the name
            (by default they do not, and are told if it is alone).

    Returns:
        The ExternalLocation; its `tracked` is the current value, tracked.

    Raises:
        ValueError: the name is malformed or taken.
    """
    base, identity = _named(name, None, site)
    with _named_place(site):
        return _owner.locations.add(
            ExternalLocation(identity, base, site, getter(), getter, setter, **{'is_named': False, **limits})
        )


def add_literal(location: LiteralLocation) -> Location:
    """Take in a location of a room above whose value this node holds: a literal of a node that was not written for
    this.

    Other than the literals of `location()`, it has no parameter until it is changed; one that a launch file has set
    goes before it.

    Returns:
        The location that is in force: an earlier one of the same call, or `location`.

    Raises:
        ValueError: its name or its id is taken by another call, or the name is that of a setting.
    """
    _check_setting(location.name)
    return _owner.add_literal(location, is_written=False)


def has_kept(names: Iterable[str], identity: str) -> bool:
    """Return whether a literal that gets one of these names begins with the value of its parameter."""
    return any(_owner.parameters.has_kept(name, location_id(identity)) for name in names)


def remove_location(location: Location) -> None:
    """Forget a location that `add_location` made: changes are refused from now on, as for unknown locations."""
    _owner.locations.remove(location)


def look_at_files_with(function: Callable[[], List[str]]) -> None:
    """Have a function take in what the source files say, before this node says what a save would write; it returns of
    each file what else is another there."""
    _owner.look_at_files = function


def make_all_known_with(function: Callable[[], None]) -> None:
    """Have a function make those locations known that are not yet, when somebody asks for all."""
    _owner.make_all_known = function


def reread(location: Location, value_in_code: Any, is_saved_here: bool = False) -> bool:
    """Take in the value that the code gives a location after an edit, and have it in force.

    Args:
        is_saved_here: it was written there by a save: the value in force may be a newer one, and stays.

    Returns:
        Whether that is new. If it was taken in before, the value in force may be a newer one, and stays.

    Raises:
        ValueError: the location does not take it; it stays as it is.
    """
    try:
        return _owner.reread(location, value_in_code, is_saved_here)
    except Refused as refused:
        raise ValueError(str(refused)) from None


def bound_anew(location: Location, minimum: Optional[float], maximum: Optional[float]) -> None:
    """Take in the bounds that the code gives a location after an edit. A value beyond them stays until it changes."""
    with _owner.lock:
        location.minimum, location.maximum = minimum, maximum
        _owner.publish_locations()


def identify(location: HeldLocation, identity: str) -> None:
    """Take in the identity that the code gives a literal after an edit, by which it is known at the next start."""
    with _owner.lock:
        location.next_id = location_id(identity)
        _owner.parameters.write_again(location)


def read_at(file: str) -> Dict[int, Location]:
    """{index of a literal in a file as it was loaded: the location that was read there}."""
    source = SOURCE_FILES.original(file)
    with _owner.lock:
        there = [
            one
            for one in _owner.locations.by_id.values()
            if one.value_in_code is not None and os.path.realpath(one.site.file) == os.path.realpath(file)
        ]
        return {index: one for index, one in ((one.find_in(source), one) for one in there) if index is not None}


def is_late(source: values.Source) -> bool:
    """Return whether a change of a source of this node is known to do nothing before the node starts again."""
    with _owner.lock:
        location = _owner.locations.by_id.get(source.location_id) if source.node == _owner.name else None
        return location is not None and not location.is_read_again() and not MEMORY.kept([source])


def get_param(name: str, *default: object, as_float: bool = False) -> Any:
    """`rospy.get_param`, with the parameter itself as the source.

    Args:
        name: the parameter's name, resolved as in rospy.
        default: what to return if it is not set; it is a source all the same, and a change sets the
            parameter.
        as_float: take each int in it for a float, for this node from now on: a file that says 1 where 1.0 is meant
            gives a number that takes fractions, and that keeps its provenance in `0.5 * x`.

    Returns:
        The parameter's value; in lists and dicts each number, text and truth value is tracked. Asking again
        makes no network call.

    Raises:
        KeyError: the parameter is not set, and there is no default.
    """
    return read_parameter(sys._getframe(1), name, *default, as_float=as_float)


def read_parameter(where: Union[FrameType, CallSite], name: str, *default: object, as_float: bool = False) -> Any:
    """`get_param` for the call that a frame is making, or for one at a CallSite."""
    key = rospy.resolve_name(name).rstrip('/') or '/'  # '~' is '/node/'
    return _owner.read_parameters.read(key, where, *default, as_float=as_float)


def explain(x: object, timeout: float = 0.5) -> str:
    """Describe in a line of text how a value was computed, with the name, file and line of each source.

    Args:
        x: a value; one without provenance is written as it is.
        timeout: how long to wait for nodes that have not said yet what their sources are called, in seconds.
    """
    with contextlib.suppress(rospy.ROSInterruptException):  # the text is made all the same
        _owner.directory.learn(values.sources(x), timeout)
    return values.explain(x)


def directory() -> Directory:
    """The directory of sources of this node and of others: for the rooms above."""
    return _owner.directory


def limits(sources: Sequence[values.Source], timeout: float = 1.0) -> Dict[str, Any]:
    """The values that the owners of sources accept, as arguments of `values.solve`: `bounds` and `read_only`.

    Args:
        sources: Sources of any nodes.
        timeout: how long to wait for the owners' answers, in seconds.
    """
    return _owner.directory.limits(sources, timeout)


def started(call: str) -> Owner:
    """This node as the owner of locations.

    Raises:
        rospy.ROSException: `init_node` has not been called; `call` names what needs it.
    """
    if not is_started():
        raise rospy.ROSException(f'rosslt.{call} needs rosslt.init_node() to have been called')
    return _owner


def _named(name: Optional[str], key: object, site: CallSite) -> Tuple[str, str]:
    """The name of the locations that a call creates, and their identity."""
    key = _plain(key)
    if name is None:
        return name_of(site, key), identity_of(site, key)
    full = name if key is None else f'{name}/{word_of(key)}'
    if not re.fullmatch(r'[A-Za-z]\w*(/\w+)*', full, flags=re.ASCII):
        raise ValueError(f'{full!r} is not a name for a location: give words of letters, digits and _, joined by /')
    _check_setting(full)
    return full, full


def _check_setting(name: str) -> None:
    if name.split('/')[0] in SETTINGS:
        raise ValueError(f'a location cannot be named {name}: the parameter of that name is a setting of the node')


@contextlib.contextmanager
def _named_place(site: CallSite) -> Iterator[None]:
    """Add file and line of the call to errors about the literal and its bounds."""
    try:
        yield
    except Refused as refused:
        raise ValueError(f'the location at {site.file}:{site.line}: {refused}') from None
