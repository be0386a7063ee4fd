"""The forms of record: how a tracked value was made, and what follows from it.

Evaluating, differentiating, solving, explaining and encoding ask the form of each record, so a new form is one class.
"""

from fractions import Fraction
from typing import Any, Callable, Optional, Sequence, Tuple

from ..annotations import Value
from ..sources import describe_source
from .inverses import refuse
from .notation import FUNCTION, LEAF, Text, applied, literal, sum_of_terms

Record = Tuple['Form', Value, Value]
"""How a value was made: `(form, first, second)`."""

SOURCE_INSTRUCTION, CONSTANT_INSTRUCTION, AFFINE_INSTRUCTION = 'source', 'constant', 'affine'
"""The first elements of instructions that are not operations."""


class Form:
    """The meaning of a record `(form, first, second)`. A new form of record is a subclass with these methods.

    Code that walks expressions calls these methods, with two short cuts for speed. A record with `single_operand` is an
    operation on one tracked value `first` and a constant `second`, with `forward(first, second)`, `inverse(y, first,
    second)` and `slope(first, second)` in that order. A record with an `operation` and without `single_operand` is an
    operation on two tracked values, and its `inverse` and `slope` are pairs.

    Attributes:
        operation: an operation with one or two operands whose inverses and slopes are known; None for any other form.
        position: the index of the tracked operand, None unless there is exactly one.
        single_operand: True if the record is such an operation with exactly one tracked operand.
        affine: True if the result is affine in the tracked operands together.
    """

    __slots__ = ('operation', 'position', 'single_operand', 'affine', 'forward', 'inverse', 'slope')

    def __init__(
        self,
        operation: Any = None,
        position: Optional[int] = None,
        single_operand: bool = False,
        affine: bool = False,
        forward: Any = None,
        inverse: Any = None,
        slope: Any = None,
    ) -> None:
        self.operation = operation
        self.position = position
        self.single_operand = single_operand
        self.affine = affine
        self.forward = forward
        self.inverse = inverse
        self.slope = slope

    def __repr__(self) -> str:
        return '<form of %s at %s>' % (self.operation and self.operation.name, self.position)

    def operands(self, first: Value, second: Value) -> Sequence[Value]:
        """The tracked operands of a record, in their order."""
        raise NotImplementedError

    def with_operands(self, first: Value, second: Value, operands: Sequence[Value]) -> Tuple['Form', Value, Value]:
        """Return a copy of the record with other tracked operands, in the same order."""
        raise NotImplementedError

    def evaluate(self, present: Value, first: Value, second: Value, values: Sequence[Value]) -> Value:
        """The value that a record gives.

        Args:
            present: the plain value of the record's node.
            values: the plain values of the operands.
        """
        raise NotImplementedError

    def slopes(self, first: Value, second: Value, values: Sequence[Value]) -> Sequence[Value]:
        """The derivative for each operand, at such values of the operands.

        Raises:
            ArithmeticError, ValueError, TypeError: there is none.
        """
        raise NotImplementedError

    def is_affine(self, first: Value, second: Value, depends: Sequence[bool]) -> bool:
        """Return True if the value is affine in the operands flagged by `depends`, taken together."""
        return self.affine

    def undo(
        self, place: int, wanted: Value, present: Value, first: Value, second: Value, values: Sequence[Value]
    ) -> Value:
        """Return the value of one operand that gives a wanted value; NotImplemented if that needs a search.

        Args:
            place: the index of the operand that changes; the others keep their values.
            wanted: the value to be given.
            present: the value that `values` give.
            values: the plain values of the operands.

        Raises:
            NoPreimage, ArithmeticError, ValueError: no operand gives that.
        """
        return NotImplemented

    def text(self, present: Value, first: Value, second: Value, texts: Sequence[Text]) -> Text:
        """The record as a person reads it, made of the texts of its operands."""
        raise NotImplementedError

    def instruction(
        self, present: Value, first: Value, second: Value, places: Sequence[int], constant: Callable[[Value], int]
    ) -> Optional[tuple]:
        """The instruction that makes the value (see `instructions.py`), None if only its linearization travels.

        Args:
            places: the indices of the operands' instructions.
            constant: gives the index of the instruction for a plain value.
        """
        return None


class SingleOperand(Form):
    """An operation with one tracked operand `first` and a constant `second` (None for a unary operation)."""

    __slots__ = ()

    def operands(self, first: Value, second: Value) -> Sequence[Value]:
        return (first,)

    def with_operands(self, first: Value, second: Value, operands: Sequence[Value]) -> Tuple[Form, Value, Value]:
        return self, operands[0], second

    def evaluate(self, present: Value, first: Value, second: Value, values: Sequence[Value]) -> Value:
        return self.forward(values[0], second)

    def slopes(self, first: Value, second: Value, values: Sequence[Value]) -> Sequence[Value]:
        return (self.slope(values[0], second),)

    def undo(
        self, place: int, wanted: Value, present: Value, first: Value, second: Value, values: Sequence[Value]
    ) -> Value:
        return self.inverse(wanted, values[0], second)

    def text(self, present: Value, first: Value, second: Value, texts: Sequence[Text]) -> Text:
        operands = list(texts)
        if second is not None:
            operands.insert(1 - self.position, literal(second))  # type: ignore[operator]
        return applied(self.operation, operands)

    def instruction(
        self, present: Value, first: Value, second: Value, places: Sequence[int], constant: Callable[[Value], int]
    ) -> Optional[tuple]:
        if self.operation.code is None:
            return None
        if second is None:
            return self.operation, places[0]
        if self.position == 0:
            return self.operation, places[0], constant(second)
        return self.operation, constant(second), places[0]


class BothOperands(Form):
    """An operation with two tracked operands."""

    __slots__ = ()

    def operands(self, first: Value, second: Value) -> Sequence[Value]:
        return first, second

    def with_operands(self, first: Value, second: Value, operands: Sequence[Value]) -> Tuple[Form, Value, Value]:
        return self, operands[0], operands[1]

    def evaluate(self, present: Value, first: Value, second: Value, values: Sequence[Value]) -> Value:
        return self.forward(*values)

    def slopes(self, first: Value, second: Value, values: Sequence[Value]) -> Sequence[Value]:
        return self.slope[0](*values), self.slope[1](*values)

    def is_affine(self, first: Value, second: Value, depends: Sequence[bool]) -> bool:
        if all(depends):
            return self.affine
        return ('a' if depends[0] else 'b') in self.operation.affine

    def undo(
        self, place: int, wanted: Value, present: Value, first: Value, second: Value, values: Sequence[Value]
    ) -> Value:
        return self.inverse[place](wanted, *values)

    def text(self, present: Value, first: Value, second: Value, texts: Sequence[Text]) -> Text:
        return applied(self.operation, texts)

    def instruction(
        self, present: Value, first: Value, second: Value, places: Sequence[int], constant: Callable[[Value], int]
    ) -> Optional[tuple]:
        return None if self.operation.code is None else (self.operation, *places)


class SourceForm(Form):
    """`(SOURCE, Source, None)`: the value is that source's."""

    __slots__ = ()

    def operands(self, first: Value, second: Value) -> Sequence[Value]:
        return ()

    def with_operands(self, first: Value, second: Value, operands: Sequence[Value]) -> Tuple[Form, Value, Value]:
        return self, first, second

    def evaluate(self, present: Value, first: Value, second: Value, values: Sequence[Value]) -> Value:
        return present

    def slopes(self, first: Value, second: Value, values: Sequence[Value]) -> Sequence[Value]:
        return ()

    def text(self, present: Value, first: Value, second: Value, texts: Sequence[Text]) -> Text:
        return '%s [%s]' % (literal(present)[0], describe_source(first)), LEAF

    def instruction(
        self, present: Value, first: Value, second: Value, places: Sequence[int], constant: Callable[[Value], int]
    ) -> Optional[tuple]:
        return SOURCE_INSTRUCTION, first, present


class AffineForm(Form):
    """`(AFFINE, ((leaf, slope), ...), is_exact)`: the value plus each slope times its leaf's change."""

    __slots__ = ()

    def operands(self, first: Value, second: Value) -> Sequence[Value]:
        return [leaf for leaf, _ in first]

    def with_operands(self, first: Value, second: Value, operands: Sequence[Value]) -> Tuple[Form, Value, Value]:
        return self, tuple([(leaf, slope) for leaf, (_, slope) in zip(operands, first)]), second

    def evaluate(self, present: Value, first: Value, second: Value, values: Sequence[Value]) -> Value:
        for value, (leaf, slope) in zip(values, first):
            if value != leaf._plain:
                present = present + slope * (value - leaf._plain)
        return present

    def slopes(self, first: Value, second: Value, values: Sequence[Value]) -> Sequence[Value]:
        return [slope for _, slope in first]

    def undo(
        self, place: int, wanted: Value, present: Value, first: Value, second: Value, values: Sequence[Value]
    ) -> Value:
        slope = first[place][1]
        if not slope:
            refuse('its slope is 0')
        missing = Fraction(wanted) - present if isinstance(wanted, int) else wanted - present
        return values[place] + missing / slope

    def text(self, present: Value, first: Value, second: Value, texts: Sequence[Text]) -> Text:
        terms = [(text, leaf._plain, slope) for (text, _), (leaf, slope) in zip(texts, first)]
        text = sum_of_terms(present, terms)
        return text if second else ('linearized(%s)' % text[0], FUNCTION)

    def instruction(
        self, present: Value, first: Value, second: Value, places: Sequence[int], constant: Callable[[Value], int]
    ) -> Optional[tuple]:
        return AFFINE_INSTRUCTION, present, tuple([(at, slope) for at, (_, slope) in zip(places, first)]), second


SOURCE = SourceForm()
"""`(SOURCE, Source, None)`: the value is that source's."""

AFFINE = AffineForm(affine=True)
"""`(AFFINE, ((leaf, slope), ...), is_exact)`: the value plus each slope times its leaf's change."""

LAZY = Form()
"""`(LAZY, load, None)`: `load(value)` makes the record; `(LAZY, load, number)`: `load(value, number)` does."""
