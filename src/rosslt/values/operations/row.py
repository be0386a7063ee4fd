"""Descriptions of operations: the rows of the table and the operations that users register."""

import dataclasses
from typing import Any, Dict, NamedTuple, Optional, Sequence, Tuple

from ..annotations import Function
from .form import BothOperands, Form, SingleOperand
from .notation import FUNCTION

BY_NAME: Dict[str, 'Operation'] = {}
BY_CODE: Dict[int, 'Operation'] = {}

Functions = Sequence[Optional[Function]]
"""A function for each operand, None if there is none."""


class Forms(NamedTuple):
    """The forms of a record with the first, the second, or both of two operands tracked; `left` alone of a single one.

    None if the operand's inverse or slope is not known.
    """

    left: Optional[Form] = None
    right: Optional[Form] = None
    both: Optional[Form] = None


@dataclasses.dataclass(eq=False, repr=False)
class Operation:
    """Describes an operation: its function, its inverses and its slopes.

    Attributes:
        code: the number of a row of the table on the wire, which never changes. None if other nodes do not know the
            operation; they get its linearization.
        name: its name in the table and in `rosslt.math`.
        forward: the function itself.
        inverse: a function for each operand, `inverse(wanted, *operands)`: returns the operand for a wanted result.
            None if a search is needed.
        slope: a function for each operand, `slope(*operands)`: returns the derivative. None if differences are used.
        arity: 1 or 2; 0 for any number of operands.
        affine: in which operands it is affine: 'a' or 'b' while the other is constant, 'ab' in both together.
        commutes: True if the operands may be swapped.
        image: the interval of the results, None for all numbers.
        stepped: True if the results are whole numbers.
        on_text: True if the operation takes texts; other operations refuse them, even if Python's operator takes them.
        symbol: its infix (or prefix) symbol, None if it is written as a function.
        precedence: the precedence of the symbol, as in Python; functions and names have the highest.
        shown_as: its name in `explain` and error messages.
        numpy: the names of the equivalent NumPy functions.
        forms: its forms of record for so many operands.
        left, right, both: the forms of a row of the table.

    Raises:
        TypeError: something is not a function; an operation with a code lacks an inverse or a slope.
        ValueError: there is another number of inverses or slopes than of operands.
    """

    code: Optional[int]
    name: str
    forward: Function
    inverse: Functions
    slope: Functions
    arity: int
    affine: Tuple[str, ...]
    commutes: bool
    image: Optional[Tuple[float, float]]
    stepped: bool
    on_text: bool
    symbol: Optional[str]
    precedence: int
    shown_as: str
    numpy: Sequence[str]
    forms: Dict[int, Forms] = dataclasses.field(init=False)
    left: Any = dataclasses.field(init=False)
    right: Any = dataclasses.field(init=False)
    both: Any = dataclasses.field(init=False)

    def __post_init__(self) -> None:
        for what, functions in (('inverse', self.inverse), ('slope', self.slope)):
            if self.arity and len(functions) != self.arity:
                raise ValueError(
                    'operation %s has %d operands, found %d of `%s`' % (self.name, self.arity, len(functions), what)
                )
            for place, function in enumerate(functions):
                if not callable(function) and (function is not None or self.code is not None):
                    raise TypeError(
                        'operation %s: the %s for argument %d is %r, and no function'
                        % (self.name, what, place + 1, function)
                    )
        self.forms = {count: self._forms(count) for count in ((self.arity,) if self.arity else (1, 2))}
        self.left, self.right, self.both = self.forms[self.arity] if self.arity else Forms()

    def _forms(self, count: int) -> Forms:
        """The forms of record for one operand, or for two."""
        forward, affine = self.forward, self.affine
        (back, rise), (other_back, other_rise) = [
            (known_at(self.inverse, place), known_at(self.slope, place)) for place in (0, 1)
        ]
        if count == 1:
            if back is None or rise is None:
                return Forms()
            unary: Any = (lambda a, _: forward(a), lambda y, a, _: back(y, a), lambda a, _: rise(a))
            return Forms(SingleOperand(self, 0, True, bool(affine), *unary))
        left = right = both = None
        if back is not None and rise is not None:
            left = SingleOperand(self, 0, True, 'a' in affine, forward, back, rise)
        if other_back is not None and other_rise is not None:
            swapped: Any = (
                (forward, back, rise)
                if self.commutes
                else (
                    lambda b, a: forward(a, b),
                    lambda y, b, a: other_back(y, a, b),
                    lambda b, a: other_rise(a, b),
                )
            )
            right = SingleOperand(self, 1, True, 'b' in affine, *swapped)
        if left is not None and right is not None:
            both = BothOperands(self, None, False, 'ab' in affine, forward, (back, other_back), (rise, other_rise))
        return Forms(left, right, both)

    def __repr__(self) -> str:
        return '<operation %s>' % self.name

    def __reduce__(self) -> Any:
        return named, (self.name,)


def known_at(functions: Functions, place: int) -> Optional[Function]:
    """The inverse or slope for an operand, None if there is none."""
    return functions[place] if place < len(functions) else None


def named(name: str) -> Operation:
    """The row of that name; KeyError if there is none."""
    return BY_NAME[name]


def operation(
    code: Optional[int],
    name: str,
    forward: Function,
    *,
    inverse: Functions,
    slope: Functions,
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
    """Make an operation; one with a code is a row of the table from then on.

    The arguments are attributes of `Operation`. A row takes as many operands as it has inverses, any other operation
    any number.

    Raises:
        TypeError, ValueError: as in `Operation`; the code or the name is taken.
    """
    made = Operation(
        code,
        name,
        forward,
        inverse,
        slope,
        0 if code is None else len(inverse),
        affine,
        commutes,
        image,
        stepped,
        on_text,
        symbol,
        precedence,
        shown_as or symbol or name,
        numpy.split(),
    )
    if code is not None:
        if code in BY_CODE or name in BY_NAME:
            raise ValueError('operation %s (%d) is there already' % (name, code))
        BY_CODE[code] = BY_NAME[name] = made
    return made
