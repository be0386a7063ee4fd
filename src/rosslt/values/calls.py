"""Users' own operations: any function of numbers as one that keeps provenance.

They are made as the rows of the table are, without a code, so what travels to other nodes is their linearization at the
present values. A call with one or two numbers whose inverses and slopes are known has the form of record of a row; any
other call has one of its own, which solving, evaluating and explaining know as they know every form.
"""

import functools
from typing import List, NamedTuple, Optional, Sequence, Tuple, Union

from .annotations import Function, Value
from .graph import UNDEFINED
from .operations import Form, Operation
from .operations.notation import FUNCTION, Text, literal
from .operations.row import known_at
from .operations.row import operation as new_operation
from .recording import OF_PYTHON, make, size_of, spend
from .tracked import CLASSES, TRACKED, plain
from .tree import SCALARS, copied, is_object_array, is_tracked, rebuilt, untracked

STEP = 6e-6
"""The step of a central difference, relative to the number: the cube root of a float's precision."""

Functions = Union[None, Function, Sequence[Optional[Function]]]


class Layout(NamedTuple):
    """Maps the flat list of numbers of a call to its arguments.

    Attributes:
        keywords: the names of the last arguments.
        containers: for each argument None if it is one number, or anything else as it is; else a plain copy of the
            list, tuple, dict, message or array that it is, and how many numbers it holds.
    """

    keywords: Sequence[str]
    containers: Sequence[Optional[Tuple[Value, int]]]

    def is_plain(self) -> bool:
        """Return True if all arguments are positional and are single numbers."""
        return not self.keywords and not any(self.containers)

    def arguments(self, numbers: Sequence[Value]) -> List[Value]:
        """The arguments that hold such numbers; an array of floats if it held tracked ones."""
        left = iter(numbers)
        return [
            next(left) if held is None else _array(rebuilt(held[0], lambda _: next(left))) for held in self.containers
        ]

    def call(self, function: Function, numbers: Sequence[Value]) -> Value:
        """A function's result for such numbers."""
        arguments = self.arguments(numbers)
        begin = len(arguments) - len(self.keywords)
        return function(*arguments[:begin], **dict(zip(self.keywords, arguments[begin:])))

    def argument_of(self, place: int) -> Tuple[int, Optional[int]]:
        """Return the index of a number's argument and the number's index in it; None if it is the whole argument."""
        for at, held in enumerate(self.containers):
            size = 1 if held is None else held[1]
            if place < size:
                return at, None if held is None else place
            place -= size
        raise IndexError(place)


class CallForm(Form):
    """`(form, (numbers, layout, results), place)`: a call of a user's function, or one of its results.

    `numbers` are what the arguments are made of, by position, then by keyword, tracked or not; `layout` makes the
    arguments of them; `results` is a list with the last numbers that the function was called with, and what it gave
    (all results of a call share it); `place` is the index of the result in the tuple, list or array that the function
    returns, None if it returns a number.
    """

    __slots__ = ('called',)

    def __init__(self, called: Operation) -> None:
        super().__init__()
        self.called = called

    def operands(self, first: Value, second: Value) -> Sequence[Value]:
        return [number for number in first[0] if type(number) in TRACKED]

    def with_operands(self, first: Value, second: Value, operands: Sequence[Value]) -> Tuple[Form, Value, Value]:
        return self, (self._filled(first, operands), first[1], []), second

    def evaluate(self, present: Value, first: Value, second: Value, values: Sequence[Value]) -> Value:
        return _number(_part(self._result(first, self._filled(first, values)), second))

    def slopes(self, first: Value, second: Value, values: Sequence[Value]) -> Sequence[Value]:
        numbers = self._filled(first, values)
        places = [at for at, number in enumerate(first[0]) if type(number) in TRACKED]
        return [self._slope(at, numbers, first, second) for at in places]

    def undo(
        self, place: int, wanted: Value, present: Value, first: Value, second: Value, values: Sequence[Value]
    ) -> Value:
        layout: Layout = first[1]
        at = [at for at, number in enumerate(first[0]) if type(number) in TRACKED][place]
        argument, inside = layout.argument_of(at)
        inverse = known_at(self.called.inverse, argument)
        if inverse is None or second is not None or inside is not None:
            return NotImplemented
        return inverse(wanted, *layout.arguments(self._filled(first, values)))

    def text(self, present: Value, first: Value, second: Value, texts: Sequence[Text]) -> Text:
        numbers, layout, _ = first
        left = iter(texts)
        flat = iter([next(left)[0] if type(one) in TRACKED else literal(one)[0] for one in numbers])
        shown = [
            next(flat) if held is None else '[%s]' % ', '.join([next(flat) for _ in range(held[1])])
            for held in layout.containers
        ]
        begin = len(shown) - len(layout.keywords)
        shown[begin:] = ['%s=%s' % pair for pair in zip(layout.keywords, shown[begin:])]
        text = '%s(%s)' % (self.called.shown_as, ', '.join(shown)) + ('' if second is None else '[%d]' % second)
        tracked = [layout.argument_of(at)[0] for at, one in enumerate(numbers) if type(one) in TRACKED]
        is_exact = all(known_at(self.called.slope, argument) for argument in tracked)
        return text if is_exact else 'numerically ' + text, FUNCTION

    def _filled(self, first: Value, values: Sequence[Value]) -> List[Value]:
        left = iter(values)
        return [next(left) if type(number) in TRACKED else number for number in first[0]]

    def _result(self, first: Value, numbers: List[Value], moved: Optional[Tuple[int, Value]] = None) -> Value:
        """What the function gives for such numbers; with one of them moved, `(index, number)`. It is remembered for all
        results of the call."""
        _, layout, results = first
        if not results or results[0][0] != numbers:
            results[:] = [(numbers, {})]
        known = results[0][1]
        if moved not in known:
            if moved is not None:
                numbers = list(numbers)
                numbers[moved[0]] = moved[1]
            known[moved] = layout.call(self.called.forward, numbers)
        return known[moved]

    def _slope(self, at: int, numbers: List[Value], first: Value, place: Optional[int]) -> Value:
        layout: Layout = first[1]
        argument, inside = layout.argument_of(at)
        derivative = known_at(self.called.slope, argument)
        if derivative is not None:
            slope = _part(derivative(*layout.arguments(numbers)), place)
            return slope if inside is None else slope[inside]
        step = STEP * max(1.0, abs(numbers[at]))
        try:
            ends = [_number(_part(self._result(first, numbers, (at, numbers[at] + by)), place)) for by in (step, -step)]
        except UNDEFINED:
            return 0  # a count, for instance: there may be slopes for the others
        return (ends[0] - ends[1]) / (2 * step)


def _part(result: Value, place: Optional[int]) -> Value:
    """Return the number at an index of a function's result; the result itself if the index is None."""
    if place is None:
        return result
    return result.item(place) if _is_array(result) else result[place]


def _is_array(value: Value) -> bool:
    return hasattr(value, 'dtype') and bool(getattr(value, 'shape', ()))


def _array(argument: Value) -> Value:
    """An array of objects as one of numbers, which other libraries expect."""
    if is_object_array(argument):
        import numpy

        return numpy.array(argument.tolist())
    return argument


def _giving_numbers(function: Function) -> Function:
    """A function whose results have no provenance, and are Python's numbers."""
    return lambda *args, **kwargs: _number(function(*args, **kwargs))


def _number(result: Value) -> Value:
    """A result without provenance, a NumPy scalar as its number; anything else unchanged."""
    if type(result) in CLASSES:
        return result
    if hasattr(result, 'dtype') and getattr(result, 'shape', None) == ():
        return result.item()
    return plain(result)


def _each(functions: Functions) -> Sequence[Optional[Function]]:
    """Inverses or slopes as a sequence; a single function belongs to the first argument."""
    if isinstance(functions, (tuple, list)):
        return tuple(functions)
    return () if functions is None else (functions,)  # type: ignore[return-value]


def operation(function: Optional[Function] = None, *, inverse: Functions = None, slope: Functions = None) -> Function:
    """Make a function of numbers one that keeps provenance, as a decorator or by a call: `ik = rosslt.operation(ik)`.

    Args:
        function: takes plain numbers, or lists, tuples, dicts, messages or arrays of them, by position or keyword, and
            whatever else it likes (a method its `self`). It returns a number, or a tuple, list or array of numbers, the
            same for the same arguments. The contents of lists, tuples, dicts, messages and arrays at the call are kept;
            other objects are kept by reference.
        inverse: for each argument the function `inverse(wanted, *arguments)` that gives what this argument must become,
            or None; a single function is that of the first argument. Without one, the argument is searched for
            numerically, and so it is if the function returns several numbers or the argument holds several.
        slope: for each argument the function `slope(*arguments)` that gives the derivative, or None; a single function
            is that of the first argument. If the function returns several numbers, so does the slope; if the
            argument holds several, a slope is the sequence of theirs. Without one it is a central difference, and
            `explain` says `numerically`.

    Returns:
        The function; with tracked arguments its results are tracked. On the wire travels its linearization.
    """
    if function is None:
        return functools.partial(operation, inverse=inverse, slope=slope)
    name = getattr(function, '__name__', type(function).__name__)
    made = new_operation(None, name, _giving_numbers(function), inverse=_each(inverse), slope=_each(slope))
    form = CallForm(made)

    @functools.wraps(function, updated=())
    def called(*args: Value, **kwargs: Value) -> Value:
        numbers, layout = _flattened([*args, *kwargs.values()], tuple(kwargs))
        operands = [number for number in numbers if type(number) in TRACKED]
        if not operands or not spend(OF_PYTHON):
            return layout.call(function, [plain(number) for number in numbers])
        # The program may change the arguments at any time; the record keeps copies.
        kept = numbers if SCALARS.issuperset(map(type, numbers)) else [copied(number) for number in numbers]
        result = layout.call(function, [plain(number) for number in numbers])
        results: List[Value] = []
        first, size = (tuple(kept), layout, results), size_of(operands)
        if not isinstance(result, (tuple, list)) and not _is_array(result):
            record = _record_of_row(made, kept) if layout.is_plain() else None
            return _tracked(result, record or (form, first, None), size)
        parts = result.flat if _is_array(result) else result
        values = [_tracked(part, (form, first, place), size) for place, part in enumerate(parts)]
        if _is_array(result):
            array = result.astype(object)
            array.flat[:] = values
            return array
        return type(result)(*values) if hasattr(result, '_fields') else type(result)(values)

    return called


def _record_of_row(operation: Operation, numbers: Sequence[Value]) -> Optional[tuple]:
    """The record of one or two numbers in the form that rows have; None if it has none for these."""
    forms = operation.forms.get(len(numbers))
    if forms is None or any(number is None for number in numbers):
        return None
    first, second = numbers[0], numbers[-1]
    if len(numbers) == 1:
        record: tuple = (forms.left, first, None)
    elif type(second) not in TRACKED:
        record = forms.left, first, second
    elif type(first) not in TRACKED:
        record = forms.right, second, first
    else:
        record = forms.both, first, second
    return record if record[0] is not None else None


def _flattened(arguments: List[Value], keywords: Sequence[str]) -> Tuple[List[Value], Layout]:
    """The numbers that arguments hold, and how to make the arguments of them."""
    if not keywords and SCALARS.issuperset(map(type, arguments)):
        return arguments, _of_numbers(len(arguments))
    numbers: List[Value] = []
    containers: List[Optional[Tuple[Value, int]]] = []
    for argument in arguments:
        if type(argument) in SCALARS or not is_tracked(argument):
            numbers.append(argument)
            containers.append(None)
            continue
        begin = len(numbers)
        rebuilt(argument, numbers.append)
        containers.append((untracked(argument), len(numbers) - begin))
    return numbers, Layout(keywords, containers)


@functools.lru_cache(maxsize=None)
def _of_numbers(count: int) -> Layout:
    """The layout of so many arguments that are numbers, by position."""
    return Layout((), (None,) * count)


def _tracked(result: Value, record: tuple, size: int) -> Value:
    """A result with its record; anything that is not a number unchanged."""
    number = _number(result) if type(result) not in TRACKED else result
    return make(number, record, size) if type(number) in CLASSES else result
