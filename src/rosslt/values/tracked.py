"""Tracked values: numbers and texts that remember how they were made.

A tracked value is itself a node of an immutable, shared expression. It holds its plain value and one record, the
tuple `(form, first, second)` that `operations.Form` describes. The record is replaced as a whole, by one that
means the same, so readers take it once and need no lock. Recording an operation is O(1) and copies nothing.
"""

from typing import Any, Callable, Dict, Iterable, List, Optional, Set, Tuple

from .accelerator import CORE
from .annotations import Value
from .operations import AFFINE, LAZY, SOURCE
from .operations import table as ops
from .sources import Source


class TrackedType(type):
    """The type of the tracked classes: calling one of them gives a plain value.

    Others make numbers with `type(x)(...)`, as statistics.mean and float.fromhex do; what they make has no provenance.
    This room makes tracked values by `CREATE`, which is as fast as a call of the class.
    """

    def __call__(cls, *args: Value, **options: Value) -> Value:
        return next(kind for tracked, kind in PLAIN_CLASSES.items() if issubclass(cls, tracked))(*args, **options)


class TrackedFloat(float, metaclass=TrackedType):
    """A float with provenance. Made by `track` and by arithmetic; calling the class gives a plain float."""

    __slots__ = ('_plain', '_record', '_size', '_fold')
    _plain: float


class TrackedInt(int, metaclass=TrackedType):
    """An int with provenance. (A subclass of int takes no slots.)"""

    _plain: int


class TrackedBool(int, metaclass=TrackedType):
    """A bool with provenance: an int that prints as a bool, because bool cannot be subclassed."""

    _plain: bool

    def __repr__(self) -> str:
        return repr(self._plain)

    __str__ = __repr__

    def __format__(self, spec: str) -> str:
        return format(self._plain, spec)


class TrackedStr(str, metaclass=TrackedType):  # type: ignore[misc]  # for mypy, str is an abstract Sequence
    """A str with provenance."""

    __slots__ = ('_plain', '_record', '_size', '_fold')


CLASSES: Dict[Any, Any] = {float: TrackedFloat, int: TrackedInt, bool: TrackedBool, str: TrackedStr}
CREATE: Dict[Any, Callable[[Any], Any]] = {kind: type.__call__.__get__(tracked) for kind, tracked in CLASSES.items()}
"""Functions that turn a plain value of each type into a tracked one, still without provenance."""
if CORE is not None:
    # The compiled classes of floats and ints; bools and texts are rare.
    TrackedFloat = CLASSES[float] = CORE.TrackedFloat  # type: ignore[misc]
    TrackedInt = CLASSES[int] = CORE.TrackedInt  # type: ignore[misc]
PLAIN_CLASSES: Dict[Any, Any] = {tracked: kind for kind, tracked in CLASSES.items()}
TRACKED: Set[Any] = set(CLASSES.values())
"""All classes of tracked values. Those of NumPy's numbers join it if NumPy is used (`add_class`)."""
SCALARS: Set[Any] = TRACKED | set(CLASSES)
"""The classes of leaves: tracked and plain values."""


def add_class(tracked: type) -> None:
    """Make a class of numbers known as one of tracked values.

    Args:
        tracked: the class; its objects have `tracked`, the tracked float or int that each is, and what that has:
            `_plain`, `_record`, `_size` and `_fold`.
    """
    TRACKED.add(tracked)
    SCALARS.add(tracked)


def plain(value: Value) -> Value:
    """A tracked value's plain value; anything else as it is."""
    return value._plain if type(value) in TRACKED else value


def plain_scalar(value: Value) -> Value:
    """The Python number, bool or str in `value` (a subclass of one, a NumPy scalar), None if it is not such a thing."""
    kind = type(value)
    if kind in CLASSES:
        return value
    if kind in TRACKED:
        return value._plain
    if hasattr(value, 'dtype') and getattr(value, 'shape', None) == ():
        value = value.item()
        return value if type(value) in CLASSES else None
    for base in (float, int, str):
        if isinstance(value, base):
            return base(value)
    return None


def new(value: Value, record: tuple, size: int) -> Value:
    """The tracked value with that record, however long its expression is (`recording.make` keeps a limit)."""
    result = CREATE[type(value)](value)
    result._plain = value
    result._record = record
    result._size = size
    return result


new_of_python = new
if CORE is not None:
    new = CORE.new


def track(value: Value, source: Source) -> Value:
    """A tracked value whose provenance is that source itself.

    Args:
        value: the source's present value: float, int, bool, str, or a NumPy scalar.
        source: where it comes from.

    Raises:
        TypeError: the value is none of these.
    """
    number = plain_scalar(value)
    if number is None:
        raise TypeError('cannot track what is of type %s, only float, int, bool and str' % type(value).__name__)
    return new(number, (SOURCE, source, None), 1)


def lazy(values: Iterable[Value], loads: Iterable[Callable[[Value], Value]]) -> List[Value]:
    """Tracked values whose records are made when they are first needed.

    Args:
        values: each a plain float, int, bool or str.
        loads: a function for each value: `load(value)` returns a tracked value of the same type (the one
            that `value` is, or was rounded from), or terms as `affine` gives them. It may be called more than once, and
            by several threads.
    """
    return [new(value, (LAZY, load, None), 1) for value, load in zip(values, loads)]


def lazy_of(values: Iterable[Value], load: Callable[[Value, int], Value]) -> List[Value]:
    """Make tracked values whose provenance one function loads when it is first needed: `load(value, number)`, with the
    number of the value, from 0. This takes less memory than `lazy`, with a function for each value."""
    return [new(value, (LAZY, load, number), 1) for number, value in enumerate(values)]


if CORE is not None:
    lazy_of = CORE.lazy_of


def origins(values: Iterable[Value]) -> Optional[Tuple[Source, ...]]:
    """The sources that tracked values are themselves, unchanged; None if one was computed."""
    found = []
    for value in values:
        form, first, _ = value._record
        if form is LAZY:
            form, first, _ = resolve(value)
        if form is not SOURCE:
            return None
        found.append(first)
    return tuple(found)


def source_of_functions(value: Value) -> Optional[Source]:
    """The source of a tracked value that is that source itself, or made of it by functions of one number alone, such as
    `radians`, or by adding 0; None of any other."""
    form, first, second = resolve(value)
    while form.single_operand and (form.operation.arity == 1 or (form is ops.ADD.left and second == 0)):
        form, first, second = resolve(first)
    return first if form is SOURCE else None


def remake(value: Value, other: Value) -> None:
    """Replace the record of a tracked value by that of an equal one."""
    value._record, value._size = resolve(other), other._size


def _of_terms(value: Value, terms: Iterable[Tuple[Source, Value, Value]]) -> tuple:
    """The record of `value` plus the sum of each slope times its source's change."""
    leaves = tuple([(new(at, (SOURCE, source, None), 1), slope) for source, at, slope in terms])
    if len(leaves) == 1 and leaves[0][1] == 1:
        leaf = leaves[0][0]
        # A location that is not set yet may hold NaN, which does not equal itself.
        is_same = leaf == value or (leaf != leaf and value != value)
        if is_same and type(leaf._plain) is type(value):
            return leaf._record
    return AFFINE, leaves, True


def _difference(one: Value, other: Value) -> Value:
    """By how much two plain values of one type differ: by 0 if they are the same, also infinite or NaN."""
    return 0 if one == other or isinstance(other, str) or (one != one and other != other) else one - other


def resolve(value: Value) -> tuple:
    """The record of a tracked value, made first if it is lazy."""
    record = value._record
    if record[0] is not LAZY:
        return record
    _, load, number = record
    made = load(value._plain) if number is None else load(value._plain, number)
    if type(made) in TRACKED:
        record = resolve(made)
        size = made._size
        difference = _difference(value._plain, made._plain)
        if difference and record[0] is not AFFINE:
            # The value was rounded on its way, for example to 32 bits; the difference is kept as a constant.
            record, size = (ops.ADD.left, made, difference), size + 1
    else:
        record = _of_terms(value._plain, made)
        size = 1
    value._size = size
    value._record = record
    return record
