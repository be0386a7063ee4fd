"""Users' own operations: any function of numbers as one that keeps provenance.

A call is a form of record of its own (`operations.form.Form`), so solving, evaluating and explaining know it without a
change. What travels to other nodes is its linearization at the present values.
"""

import functools
from typing import Any, Callable, List, Optional, Sequence, Tuple, Union

from .operations import Form
from .operations.notation import FUNCTION, Text, literal
from .recording import make, size_of
from .tracked import CLASSES, TRACKED, plain

STEP = 6e-6
"""The step of a central difference, relative to the number: the cube root of a float's precision."""

Functions = Union[None, Callable[..., Any], Sequence[Optional[Callable[..., Any]]]]


class CallForm(Form):
    """`(form, (arguments, keywords), place)`: a call of a user's function, or one of its results.

    `arguments` are those by position, then those by keyword, tracked or not; `keywords` are the names of the last
    ones; `place` is that of the result in the tuple that the function returns, None where it returns a number.
    """

    __slots__ = ('function', 'name', 'inverses', 'derivatives')

    def __init__(self, function: Callable[..., Any], inverse: Functions, slope: Functions) -> None:
        super().__init__()
        self.function = function
        self.name = getattr(function, '__name__', type(function).__name__)
        self.inverses = inverse
        self.derivatives = slope

    def operands(self, first: Any, second: Any) -> Sequence[Any]:
        return [argument for argument in first[0] if type(argument) in TRACKED]

    def with_operands(self, first: Any, second: Any, operands: Sequence[Any]) -> Tuple[Form, Any, Any]:
        return self, (self._filled(first, operands), first[1]), second

    def evaluate(self, present: Any, first: Any, second: Any, values: Sequence[Any]) -> Any:
        result = self.call(self._filled(first, values), first[1])
        return plain(result if second is None else result[second])

    def slopes(self, first: Any, second: Any, values: Sequence[Any]) -> Sequence[Any]:
        arguments, keywords = self._filled(first, values), first[1]
        return [
            self._slope(at, arguments, keywords, second)
            for at, argument in enumerate(first[0])
            if type(argument) in TRACKED
        ]

    def undo(self, place: int, wanted: Any, present: Any, first: Any, second: Any, values: Sequence[Any]) -> Any:
        at = [at for at, argument in enumerate(first[0]) if type(argument) in TRACKED][place]
        inverse = _of(self.inverses, at)
        if inverse is None or second is not None:
            return NotImplemented
        return inverse(wanted, *self._filled(first, values))

    def text(self, present: Any, first: Any, second: Any, texts: Sequence[Text]) -> Text:
        arguments, keywords = first
        left = iter(texts)
        shown = [next(left)[0] if type(one) in TRACKED else literal(one)[0] for one in arguments]
        begin = len(arguments) - len(keywords)
        shown[begin:] = ['%s=%s' % pair for pair in zip(keywords, shown[begin:])]
        text = '%s(%s)' % (self.name, ', '.join(shown)) + ('' if second is None else '[%d]' % second)
        is_exact = all(_of(self.derivatives, at) for at, one in enumerate(arguments) if type(one) in TRACKED)
        return text if is_exact else 'numerically ' + text, FUNCTION

    def call(self, arguments: Sequence[Any], keywords: Sequence[str]) -> Any:
        """The function's result for such arguments."""
        begin = len(arguments) - len(keywords)
        return self.function(*arguments[:begin], **dict(zip(keywords, arguments[begin:])))

    def _filled(self, first: Any, values: Sequence[Any]) -> List[Any]:
        left = iter(values)
        return [next(left) if type(argument) in TRACKED else argument for argument in first[0]]

    def _slope(self, at: int, arguments: List[Any], keywords: Sequence[str], place: Optional[int]) -> Any:
        derivative = _of(self.derivatives, at)
        if derivative is not None:
            slope = derivative(*arguments)
            return slope if place is None else slope[place]
        step = STEP * max(1.0, abs(arguments[at]))
        ends = []
        for side in (step, -step):
            moved = list(arguments)
            moved[at] = arguments[at] + side
            result = self.call(moved, keywords)
            ends.append(plain(result if place is None else result[place]))
        return (ends[0] - ends[1]) / (2 * step)


def _of(functions: Functions, at: int) -> Optional[Callable[..., Any]]:
    """The inverse or slope for an argument: the only one, or the one in its place."""
    if functions is None or callable(functions):
        return functions if at == 0 else None
    return functions[at] if at < len(functions) else None


def operation(
    function: Optional[Callable[..., Any]] = None, *, inverse: Functions = None, slope: Functions = None
) -> Callable[..., Any]:
    """Make a function of numbers one that keeps provenance, as a decorator or by a call: `ik = rosslt.operation(ik)`.

    Args:
        function: takes plain numbers by position or keyword, and whatever else it likes (a method its `self`). It
            returns a number or a tuple of numbers, the same for the same arguments.
        inverse: for each argument the function `inverse(wanted, *arguments)` that gives what this argument must become,
            or None; a single function is that of the first argument. Without one, the argument is searched for
            numerically, and so it is where the function returns a tuple.
        slope: for each argument the function `slope(*arguments)` that gives the derivative, or None; a single function
            is that of the first argument. Where the function returns a tuple, so does the slope. Without one it is a
            central difference, and `explain` says `numerically`.

    Returns:
        The function; with tracked arguments its results are tracked. On the wire travels its linearization.
    """
    if function is None:
        return functools.partial(operation, inverse=inverse, slope=slope)
    form = CallForm(function, inverse, slope)

    @functools.wraps(function, updated=())
    def called(*args: Any, **kwargs: Any) -> Any:
        arguments, keywords = [*args, *kwargs.values()], tuple(kwargs)
        operands = [argument for argument in arguments if type(argument) in TRACKED]
        result = form.call([plain(argument) for argument in arguments], keywords)
        if not operands:
            return result
        first, size = (tuple(arguments), keywords), size_of(operands)
        if isinstance(result, tuple):
            made = [_tracked(part, (form, first, place), size) for place, part in enumerate(result)]
            return type(result)(*made) if hasattr(result, '_fields') else tuple(made)
        return _tracked(result, (form, first, None), size)

    return called


def _tracked(result: Any, record: tuple, size: int) -> Any:
    """A result with its record; a NumPy scalar as its number, anything that is not a number unchanged."""
    if hasattr(result, 'dtype') and getattr(result, 'shape', None) == ():
        result = result.item()
    return make(result, record, size) if type(result) in CLASSES else result
