"""Functions and classes of other libraries that compute their results from their arguments alone, keeping provenance.

An object of such a class is made of numbers, which its class gives to `pickle`: a Rotation of SciPy of those of its
quaternions. These keep their provenance beside the object. So a call with objects is recorded as one with arrays, by
`calling`: to be evaluated, objects are made of other numbers, and the same function is called with them.
"""

import abc
import contextlib
import copy
import copyreg
import functools
import math
import time
import types
import weakref
from typing import Any, Callable, Collection, Dict, Iterator, List, NamedTuple, Tuple

import numpy

from ..recording import OPERATION, spend
from ..tracked import TRACKED
from .calling import LOST, call
from .functions import replacing
from .numbers import NUMPY_NUMBERS, PYTHON_NUMBERS, python_number
from .tracked_array import Argument, TrackedArray, holds_tracked, plain

_KEEPING: Dict[type, Any] = {}
"""{class of a library: its subclass whose objects keep provenance}, and each such subclass as that of itself."""

_NUMBERS = 'numbers_with_provenance'
"""The attribute of an object for the array of the numbers that it was made of; None if they are plain."""

_NAMES = ['add', 'sub', 'mul', 'matmul', 'truediv', 'floordiv', 'mod', 'pow']
_OPERATORS = {'__call__', '__getitem__', '__neg__', '__pos__', '__abs__', '__invert__'}
_OPERATORS |= {f'__{side}{name}__' for name in _NAMES for side in ('', 'r')}


class _Block(NamedTuple):
    """Stands for an array of floats in a state."""

    shape: Tuple[int, ...]
    dtype: Any


class _Form(NamedTuple):
    """All that an object is but its floats: its class, that of the library, and its state with blocks for them."""

    kind: Any
    state: Any


_FLOAT = _Block((), float)


_CONSTANTS = {bool, int, str, bytes, type(None), _Block}


class _Unrecorded(ArithmeticError):
    """A call cannot be recorded: it changes an argument, or an object is made of more than numbers.

    Args:
        results: what the function has given, if it was called with the program's own arguments.
    """

    def __init__(self, reason: str, *results: Any) -> None:
        super().__init__(reason)
        self.results = results


def can_keep(kind: Any) -> bool:
    """Return True if the objects of a class are their attributes, or what the class itself gives to `pickle`.

    An object must also take other numbers once it is made, as those of pybind11 do not.
    """
    if type(kind).__name__ == 'pybind11_type':
        return False
    usual = getattr(object, '__getstate__', None)  # there is one since Python 3.11
    if getattr(kind, '__getstate__', usual) is usual:
        return kind.__dictoffset__ != 0 and not any(vars(base).get('__slots__') for base in kind.__mro__)
    return hasattr(kind, '__setstate__')


def _state_of(thing: Any, library: Any) -> Any:
    return library.__getstate__(thing) if hasattr(library, '__setstate__') else vars(thing)


def _set_state(thing: Any, library: Any, state: Any) -> None:
    if hasattr(library, '__setstate__'):
        library.__setstate__(thing, state)
    else:
        vars(thing).update(state)


def _emptied(state: Any, numbers: List[float]) -> Any:
    """A state with blocks for its floats, which are added to the numbers."""
    kind = type(state)
    if kind is float:
        numbers.append(state)
        return _FLOAT
    if kind is TrackedArray:
        state, kind = plain(state), numpy.ndarray
    if kind is numpy.ndarray and state.dtype.kind in 'biuf':
        if state.dtype.kind != 'f':
            return state
        numbers += state.ravel().tolist()
        return _Block(state.shape, state.dtype)
    if kind in (list, tuple):
        return kind([_emptied(part, numbers) for part in state])
    if kind is dict:
        return {name: _emptied(part, numbers) for name, part in state.items()}
    if kind in _KEEPING:
        library = _library_class(kind)
        return _Form(library, _emptied(_state_of(state, library), numbers))
    if kind not in _CONSTANTS:
        raise _Unrecorded('an object is made of more than numbers: %s' % kind.__name__)
    return state


def _filled(state: Any, numbers: Any, used: int = 0) -> Tuple[Any, int]:
    """A state with numbers of an array in the place of its blocks, and how many of them are used now."""
    kind = type(state)
    if kind is _Block:
        end = used + math.prod(state.shape)
        part = numbers[used:end]
        return (float(part[0]) if state is _FLOAT else part.astype(state.dtype).reshape(state.shape)), end
    if kind is _Form:
        inner, used = _filled(state.state, numbers, used)
        made = state.kind.__new__(state.kind)
        _set_state(made, state.kind, inner)
        return made, used
    if kind not in (list, tuple, dict):
        return state, used
    parts = []
    for part in state.values() if kind is dict else state:
        made, used = _filled(part, numbers, used)
        parts.append(made)
    return dict(zip(state, parts)) if kind is dict else kind(parts), used


def _library_class(kind: Any) -> Any:
    """The class of the library of which a class is the one that keeps provenance, or that class itself."""
    return kind.__base__ if _KEEPING[kind] is kind else kind


def _numbers_of(thing: Any) -> Tuple[List[float], _Form]:
    """The numbers that an object is made of now, and its form."""
    numbers: List[float] = []
    return numbers, _emptied(thing, numbers)


def _set_numbers(thing: Any, form: _Form, numbers: Any) -> None:
    _set_state(thing, form.kind, _filled(form.state, plain(numbers))[0])


def _apart(x: Argument) -> Tuple[Any, Any]:
    """Arguments, or a result, with arrays of numbers for objects, and their form; that of what stays the same is None.

    An object that has other numbers than it was made of is plain.
    """
    kind = type(x)
    if kind in _KEEPING:
        numbers, form = _numbers_of(x)
        kept = getattr(x, _NUMBERS, None)
        is_as_made = kept is not None and numbers in (kept.shown, plain(kept).tolist())
        return (kept if is_as_made else numpy.array(numbers, float)), form
    if kind is float:
        return numpy.float64(x), float
    if kind in PYTHON_NUMBERS:
        return x, float
    if kind in NUMPY_NUMBERS:
        return x, type(x.plain)
    if kind in (list, tuple, dict):
        parts = [_apart(part) for part in (x.values() if kind is dict else x)]
        others = [part for part, _ in parts]
        return dict(zip(x, others)) if kind is dict else kind(others), [form for _, form in parts]
    return (x._plain if kind in TRACKED else x), None


def _together(x: Any, form: Any, keeps: bool = False) -> Any:
    """The arguments, or the result, that `_apart` has taken apart.

    Args:
        keeps: whether objects shall be such that keep provenance.
    """
    if type(form) is _Form:
        kind = _KEEPING[form.kind] if keeps else form.kind
        made = kind.__new__(kind)
        _set_numbers(made, form, x)
        if keeps:
            _keep(made, x if holds_tracked(x) else None)
        return made
    if type(form) is list:
        parts = [_together(*pair, keeps) for pair in zip(x.values() if type(x) is dict else x, form)]
        return dict(zip(x, parts)) if type(x) is dict else type(x)(parts)
    if form is None or not isinstance(x, (numpy.ndarray, numpy.generic)):
        return x
    if form is float:
        return python_number(x.item() if type(x) is numpy.ndarray else x)
    return x if type(x) in NUMPY_NUMBERS else form(x)


def _keep(thing: Any, numbers: Any) -> None:
    """Have an object keep the numbers that it was made of, and follow them if they are changed in their array."""
    setattr(thing, _NUMBERS, numbers)
    if numbers is None:
        return
    reference = weakref.ref(thing)
    numbers.shown = plain(numbers).tolist()  # by the object, until it follows

    def followed() -> None:
        known = reference()
        if known is not None and getattr(known, _NUMBERS) is numbers:
            present, form = _numbers_of(known)
            if present == numbers.shown:
                _set_numbers(known, form, numbers)
                numbers.shown = _numbers_of(known)[0]

    numbers.followed = followed


def _has_provenance(x: Argument) -> bool:
    if type(x) in (list, tuple):
        return any(map(_has_provenance, x))
    return getattr(x, _NUMBERS, None) is not None if type(x) in _KEEPING else holds_tracked(x)


def _objects_in(x: Argument) -> List[Any]:
    return [one for one in _listed([x]) if type(one) in _KEEPING]


def _arrays_in(x: Argument) -> List[Any]:
    return [one for one in _listed([x]) if isinstance(one, numpy.ndarray)]


def _write_to(arrays: List[Any], before: List[bytes], results: List[Any]) -> bool:
    """Return True if a function has written to arrays that it was given, or has put its results there.

    Args:
        before: the bytes of the arrays before the call.
    """
    shared = any(numpy.may_share_memory(array, result) for array in arrays for result in results)
    return shared or [array.tobytes() for array in arrays] != before


def _keeping(result: Any) -> Any:
    """A plain result, with objects that can keep the provenance of what is computed of them."""
    kind = type(result)
    if kind in (list, tuple):
        return kind(map(_keeping, result))
    keeping = _KEEPING.get(kind, kind)
    if keeping is kind:
        return result
    return _with_state_of(result, keeping, kind)


def _with_state_of(thing: Any, kind: Any, library: Any) -> Any:
    """An object of a class with the state of another one, without provenance."""
    made = kind.__new__(kind)
    _set_state(made, library, _state_of(thing, library))
    if kind is not library:
        _keep(made, None)
    return made


def _as_of_library(thing: Any) -> Any:
    library = _library_class(type(thing))
    return _with_state_of(thing, library, library)


def _listed(x: Any) -> Any:
    """Return the parts of lists, tuples and dicts in one list; anything else as it is."""
    if type(x) not in (list, tuple, dict):
        return x
    parts = [_listed(part) for part in (x.values() if type(x) is dict else x)]
    return [one for part in parts for one in (part if type(part) is list else [part])]


def _relisted(x: Any, parts: Iterator[Any]) -> Any:
    """Return the same lists, tuples and dicts with other parts in them."""
    if type(x) is dict:
        return {name: _relisted(part, parts) for name, part in x.items()}
    return type(x)([_relisted(part, parts) for part in x]) if type(x) in (list, tuple) else next(parts)


def _computed(function: Callable[..., Any], arguments: Any, options: Dict[str, Argument]) -> Any:
    """Call a function; the result has provenance if its arguments have some."""
    if not (_has_provenance((*arguments, *options.values())) and spend(0)):
        return _keeping(function(*arguments, **options))
    start = time.thread_time()
    results: List[Tuple[Any, Any, float]] = []

    def again(*parts: Any, **named: Any) -> Any:
        given, given_by_name = _together(parts, form), _together(named, form_of_named)
        if results:  # it may write to these
            return _listed(_apart(function(*copy.deepcopy(given), **copy.deepcopy(given_by_name)))[0])
        objects, arrays = _objects_in((given, given_by_name)), _arrays_in((parts, named))
        before, bytes_before = list(map(_numbers_of, objects)), [array.tobytes() for array in arrays]
        called = time.thread_time()
        result = function(*given, **given_by_name)
        taken = time.thread_time() - called
        if repr(list(map(_numbers_of, objects))) != repr(before):
            raise _Unrecorded('it changes an object')
        if _write_to(arrays, bytes_before, _arrays_in(result)):
            raise _Unrecorded('it writes to its arguments', result)
        try:
            made, form_of_result = _apart(result)
        except _Unrecorded as unrecorded:
            raise _Unrecorded(str(unrecorded), result) from None
        results.append((made, form_of_result, taken))
        return _listed(made)

    again.__name__ = getattr(function, '__qualname__', again.__name__)
    try:
        parts, form = _apart(arguments)
        named, form_of_named = _apart(options)
        made = call(again, parts, named)
    except _Unrecorded as unrecorded:
        result = unrecorded.results[0] if unrecorded.results else function(*arguments, **options)
        for tell in LOST:
            tell(result, (arguments, options))
        return _keeping(result)
    shown, form_of_result, taken = results[0]
    result = _together(_relisted(shown, iter(made if type(made) is list else [made])), form_of_result, True)
    # What the function takes is the program's.
    spend(1 + round((time.thread_time() - start - taken) / OPERATION))
    return result


def pure(function: Callable[..., Any]) -> Any:
    """A function that computes its results from its arguments alone as one that keeps provenance.

    It may take and give numbers, arrays, lists and tuples, and objects of classes that `pure_class` knows.
    """

    @replacing(function)
    def called(*arguments: Argument, **options: Argument) -> Any:
        return _computed(function, arguments, options)

    return called


def pure_class(library: Any, unrecorded: Collection[str] = ()) -> Any:
    """The subclass of a class whose objects keep what they were made of. Objects of the class count as some of it, and
    a subclass that a program makes of it is one of the class.

    Its methods are to compute from the object and their arguments alone. One that changes the object does so, and the
    object is plain from then on.

    Args:
        library: a class for which `can_keep` is true.
        unrecorded: the names of methods that must not be called again, as they draw random numbers.
    """
    above: Any = type(library)

    def make(cls: Any, *arguments: Argument, **options: Argument) -> Any:
        return _computed(library, arguments, options)

    def new(_: Any, name: str, bases: Tuple[type, ...], names: Dict[str, Any], **options: Any) -> Any:
        return above(name, tuple([library if base is keeping else base for base in bases]), names, **options)

    def of_object(function: Any) -> Any:
        def method(self: Any, *arguments: Argument, **options: Argument) -> Any:
            if type(self) is keeping:
                return _computed(function, (self, *arguments), options)
            return function(self, *arguments, **options)

        return functools.wraps(function, updated=())(method)

    def of_class(name: str, function: Any) -> Any:
        def method(_: Any, *arguments: Argument, **options: Argument) -> Any:
            called = function.__get__(None, library)
            if name in unrecorded:
                return _keeping(called(*plain(arguments), **plain(options)))
            return _computed(called, arguments, options)

        return classmethod(functools.wraps(function.__get__(None, library), updated=())(method))

    names: Dict[str, Any] = {
        '__slots__': (_NUMBERS, '__weakref__')[: 1 if library.__weakrefoffset__ else 2],
        '__doc__': library.__doc__,
        '__module__': library.__module__,
        '__qualname__': library.__qualname__,
        '__copy__': _copied,
        '__deepcopy__': lambda self, known: _copied(self, lambda thing: copy.deepcopy(thing, known)),
        '__reduce_ex__': lambda self, _: (copy.copy, (_as_of_library(self),)),
    }
    for base in reversed(library.__mro__[:-1]):
        for name, thing in vars(base).items():
            if name in _OPERATORS or not name.startswith('_'):
                if isinstance(thing, (classmethod, types.ClassMethodDescriptorType)):
                    names[name] = of_class(name, thing)
                elif isinstance(thing, staticmethod):
                    names[name] = staticmethod(pure(thing.__func__))
                elif callable(thing) and not isinstance(thing, type):
                    names[name] = of_object(thing)
    above_all: Any = type(above)
    namespace = {
        '__call__': make,
        '__instancecheck__': lambda _, thing: isinstance(thing, library),
        '__subclasscheck__': lambda _, kind: issubclass(kind, library),
    }
    # A program may derive a class from this one and from an abstract one.
    above_it = abc.ABCMeta if above is type else above
    kind_of_keeping = above_all(above.__name__, (above_it,), namespace)
    keeping: Any = kind_of_keeping(library.__name__, (library,), names)
    kind_of_keeping.__new__ = new
    copyreg.pickle(kind_of_keeping, lambda _: (copy.copy, (library,)))
    _KEEPING.update({library: keeping, keeping: keeping})
    return keeping


def _copied(thing: Any, copied: Callable[[Any], Any] = copy.copy) -> Any:
    made = _keeping(copied(_as_of_library(thing)))
    with contextlib.suppress(_Unrecorded):  # the program has given it other attributes
        if _has_provenance(thing):
            numbers = _apart(thing)[0]
            _keep(made, numbers.copy() if holds_tracked(numbers) else None)
    return made


def unkept(thing: Any) -> Any:
    """An object without what it was made of; itself if that is plain."""
    return _keeping(_as_of_library(thing)) if _has_provenance(thing) else thing
