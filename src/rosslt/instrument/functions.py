"""`math` and the conversions of a node's own code: for plain numbers as they are, keeping provenance for others."""

import functools
import math
import operator
from typing import Any, Callable, Dict, Optional, Tuple

from rosslt import values

_TRACKED = frozenset(type(values.track(kind(), values.Source('/', 0))) for kind in (float, int, bool))


def _to_the_bit(original: Callable[..., Any], tracked: Callable[..., Any]) -> Callable[..., Any]:
    """Combine two functions: numbers and exceptions come from `original`, provenance from `tracked`."""

    def to_the_bit(*arguments: object, **options: object) -> Any:
        number = original(*map(_plain, arguments), **{name: _plain(option) for name, option in options.items()})
        return _with_provenance_of(tracked(*arguments, **options), number)

    return to_the_bit


def _plain(argument: Any) -> Any:
    if type(argument) in _TRACKED:
        return argument._plain
    return argument if type(argument) in (float, int) else values.untracked(argument)


def _with_provenance_of(made: Any, number: Any) -> Any:
    """A number with the provenance of one that is equal except for rounding."""
    if type(made) is tuple:
        return tuple(map(_with_provenance_of, made, number))
    if type(made) not in _TRACKED:
        return number
    # 0.0 and -0.0 are equal.
    if made._plain == number and type(made._plain) is type(number) and (number or repr(made) == repr(number)):
        return made
    (rounded,) = values.lazy([number], [lambda _: made])
    return rounded


_ROWS = {row.name: row for row in values.OPERATIONS.values()}


def _keeping(name: str, tracked: Callable[..., Any]) -> Callable[..., Any]:
    original = getattr(math, name)
    tracked = _to_the_bit(original, tracked)
    if name in _ROWS and _ROWS[name].forward is original:
        tracked = values.recorder(_ROWS[name])(tracked)
    return values.keeping(original, tracked, original)


#: The functions of `math` that keep provenance, by name.
MATH: Dict[str, Any] = {
    name: _keeping(name, function)
    for name, function in values.MATH.items()
    if hasattr(math, name) and function is not getattr(math, name)
}


def convert(conversion: Any, *arguments: Any) -> Any:
    """`numpy.float32(x)` or `sum(x)`, or what else a program calls so, keeping provenance."""
    return _CONVERSIONS.get(id(conversion), conversion)(*arguments)


_CONVERSIONS: Dict[int, Callable[..., Any]] = {}


def convert_by(original: object, tracked: Callable[..., Any]) -> None:
    """Have a class of NumPy's numbers, or a conversion of Python's own, keep provenance if it is called.

    Args:
        original: the class.
        tracked: the function that is called instead.
    """
    _CONVERSIONS[id(original)] = tracked


to_float = values.keeping(float, values.to_float, float)
to_int = values.keeping(int, values.to_int, int)


#: The classes of numbers that `sum_of` adds itself.
_SUMMED = frozenset({float, int, bool}) | _TRACKED


def sum_of(numbers: Any, *start: Any) -> Any:
    """`sum(numbers)`, keeping provenance: of ints beside floats too."""
    if type(numbers) not in (list, tuple):
        numbers = list(numbers)
    kinds = set(map(type, (*numbers, *start)))
    if kinds.isdisjoint(_TRACKED) or not kinds <= _SUMMED.union(_BESIDE):
        return sum(numbers, *start)
    total = sum([one._plain if type(one) in _TRACKED else one for one in numbers], *map(_plain, start))
    add = operator.add if kinds <= {float, _TRACKED_FLOAT} else REFLECTING['add']
    made = functools.reduce(add, numbers, *(start or (0,)))
    if type(made) not in _TRACKED or type(total) is not type(made._plain):
        return sum(numbers, *start)
    return _with_provenance_of(made, total)  # Python may add more exactly than one by one


def type_of(thing: object) -> Any:
    """`type(x)`: the class that a number has without provenance."""
    kind = type(thing)
    try:
        return _PLAIN_CLASSES.get(kind, kind)
    except TypeError:  # a class of which the metaclass has no hash
        return kind


for _original, _tracked in ((float, to_float), (int, to_int), (sum, sum_of), (type, type_of)):
    convert_by(_original, _tracked)


_PLAIN_CLASSES: Dict[type, type] = {
    type(values.track(kind(), values.Source('/', 0))): kind for kind in (float, int, bool, str)
}
_TRACKED_FLOAT = type(values.track(0.0, values.Source('/', 0)))
_TRACKED_INT = type(values.track(0, values.Source('/', 0)))


class _Pickling:
    is_plain = False


def show_as_plain(tracked: type, plain: Any, reduce: Optional[Callable[[Any, Any], Any]] = None) -> None:
    """Have a class call itself as the plain one does, in texts and error messages, and be known as that one.

    Args:
        tracked: the class of numbers with provenance.
        plain: the class of those without.
        reduce: gives an object of that to pickle, instead of `__reduce_ex__`.
    """
    tracked.__name__, tracked.__qualname__, tracked.__module__ = plain.__name__, plain.__qualname__, plain.__module__
    _PLAIN_CLASSES[tracked] = plain
    if _Pickling.is_plain:
        tracked.__reduce_ex__ = reduce or (lambda value, _: (plain, (value._plain,)))  # type: ignore


def show_numbers_as_plain() -> None:
    """`show_as_plain` for all classes of tracked values.

    Pickles are read by programs that know only plain numbers, and so hold the plain number.
    """
    _Pickling.is_plain = True
    for tracked, kind in list(_PLAIN_CLASSES.items()):
        show_as_plain(tracked, kind)


#: The classes on whose right a tracked number would be taken for a plain one, and the classes of such numbers.
_BESIDE: Dict[type, Tuple[type, ...]] = {float: (_TRACKED_INT,)}


def see_tracked_beside(kind: type) -> None:
    """Have tracked floats and ints keep their provenance on the right of plain numbers of another class."""
    _BESIDE[kind] = (_TRACKED_FLOAT, _TRACKED_INT)


def _reflecting(name: str, in_place: bool = False) -> Callable[[Any, Any], Any]:
    """An operator that lets a number with provenance compute with the plain one on its left.

    A float takes every int for a plain one, and NumPy's float every float, and so would not ask it.
    """
    methods = {kind: getattr(kind, f'__r{name}__') for kind in (_TRACKED_FLOAT, _TRACKED_INT)}

    def reflected(left: object, right: object) -> Any:
        return methods[type(right)](right, left)

    return values.reflecting(getattr(operator, 'i' + name if in_place else name), reflected, _BESIDE)


_NAMES = ('add', 'sub', 'mul', 'truediv')
#: Operators by name, with the augmented ones (`+=`), which keep the provenance to the right of a plain number.
REFLECTING: Dict[str, Callable[[Any, Any], Any]] = {
    **{name: _reflecting(name) for name in _NAMES},
    **{'i' + name: _reflecting(name, in_place=True) for name in _NAMES},
}
