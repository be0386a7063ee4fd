"""A row of the table of operations, and how it is added."""

from typing import Any, Callable, Dict, List, Optional, Tuple

from .form import BothOperands, SingleOperand
from .notation import FUNCTION

BY_NAME: Dict[str, 'Operation'] = {}
BY_CODE: Dict[int, 'Operation'] = {}


class Operation:
    """A row of the table.

    Attributes:
        code: the operation's number on the wire, which never changes.
        name: what the table and `rosslt.math` call it.
        shown_as: what `explain` and error messages call it.
        symbol: its infix (or prefix) symbol, None where it is written as a function.
        numpy: the names of the NumPy functions that do the same.
        precedence: how strongly the symbol binds, as in Python; functions and names have the highest.
        arity: 1 or 2.
        image: the interval of the results, None for all numbers.
        commutes: whether the operands may be swapped.
        stepped: whether the results are whole numbers.
        on_text: whether it takes texts; no other row does, though Python's own operators might.
        left, right, both: the forms with the first, the second, or both operands tracked (`left` of a unary).
    """

    __slots__ = (
        'code',
        'name',
        'shown_as',
        'symbol',
        'precedence',
        'numpy',
        'arity',
        'image',
        'commutes',
        'stepped',
        'on_text',
        'forward',
        'left',
        'right',
        'both',
    )

    def __init__(
        self,
        code: int,
        name: str,
        shown_as: str,
        symbol: Optional[str],
        precedence: int,
        numpy: List[str],
        forward: Any,
        inverse: Any,
        slope: Any,
        affine: Tuple[str, ...],
        commutes: bool,
        image: Optional[Tuple[float, float]],
        stepped: bool,
        on_text: bool,
    ) -> None:
        self.code = code
        self.name = name
        self.shown_as = shown_as
        self.symbol = symbol
        self.precedence = precedence
        self.numpy = numpy
        self.arity = len(inverse)
        self.image = image
        self.commutes = commutes
        self.stepped = stepped
        self.on_text = on_text
        self.forward = forward
        if self.arity == 1:
            back, rise = inverse[0], slope[0]
            self.left = SingleOperand(
                self, 0, True, bool(affine), lambda a, _: forward(a), lambda y, a, _: back(y, a), lambda a, _: rise(a)
            )
            self.right = self.both = None
            return
        self.left = SingleOperand(self, 0, True, 'a' in affine, forward, inverse[0], slope[0])
        if commutes:
            self.right = SingleOperand(self, 1, True, 'b' in affine, forward, inverse[0], slope[0])
        else:
            back, rise = inverse[1], slope[1]
            self.right = SingleOperand(
                self,
                1,
                True,
                'b' in affine,
                lambda b, a: forward(a, b),
                lambda y, b, a: back(y, a, b),
                lambda b, a: rise(a, b),
            )
        self.both = BothOperands(self, None, False, 'ab' in affine, forward, inverse, slope)

    def __repr__(self) -> str:
        return '<operation %s>' % self.name

    def __reduce__(self) -> Any:
        return named, (self.name,)


def named(name: str) -> Operation:
    """The operation of that name; KeyError if there is none."""
    return BY_NAME[name]


def operation(
    code: int,
    name: str,
    forward: Callable[..., Any],
    *,
    inverse: Tuple[Callable[..., Any], ...],
    slope: Tuple[Callable[..., Any], ...],
    symbol: Optional[str] = None,
    precedence: int = FUNCTION,
    affine: Tuple[str, ...] = (),
    commutes: bool = False,
    image: Optional[Tuple[float, float]] = None,
    numpy: str = '',
    shown_as: str = '',
    stepped: bool = False,
    on_text: bool = False,
) -> Operation:
    """Add a row to the table.

    Args:
        affine: in which operands the operation is affine: 'a' or 'b' while the other is constant,
            'ab' in both together.
    """
    row = Operation(
        code,
        name,
        shown_as or symbol or name,
        symbol,
        precedence,
        numpy.split(),
        forward,
        inverse,
        slope,
        affine,
        commutes,
        image,
        stepped,
        on_text,
    )
    if code in BY_CODE or name in BY_NAME:
        raise ValueError('operation %s (%d) is there already' % (name, code))
    BY_CODE[code] = BY_NAME[name] = row
    return row
