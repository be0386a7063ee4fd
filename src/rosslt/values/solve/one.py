"""One source's try at making one result become what is wanted (paper, IV.A, `force_value`).

From the result, the operations are undone one after the other as long as only one operand depends on the source.
Where two do, the source appears more than once: if the rest is affine in it, its slope gives the answer, else Newton.
"""

import math
from fractions import Fraction
from typing import Any, Dict, List, Tuple

from ..graph import Graph
from ..operations import SOURCE, Form
from ..operations.inverses import NoPreimage, near, refuse
from ..sources import Source
from .root_finding import Search

MARK = '\ue000'
"""A character of Unicode's private use area."""


def meets(found: Any, wanted: Any) -> bool:
    """Whether a result is the wanted one: whole numbers, bools and texts exactly, floats to a relative 1e-9."""
    if found == wanted:
        return True
    try:
        return isinstance(found, float) and abs(found - wanted) <= 1e-9 * abs(wanted)
    except (OverflowError, TypeError):
        return False


def almost_meets(found: Any, wanted: Any, present: Any) -> bool:
    """`meets`, or as near as rounding lets a result come that was of ordinary size: the difference of two numbers near
    1 cannot be made 1e-17, and a marker is not dragged to within less than a picometre."""
    if meets(found, wanted):
        return True
    try:
        return isinstance(found, float) and abs(found - wanted) <= 1e-12 * min(1.0, abs(present))
    except (OverflowError, TypeError):
        return False


class Attempt:
    """A result of a graph as a function of one source.

    Args:
        graph: holds the result and all it is made of.
        root: the place of the result in it.
        source: the source that may change.
        changes: values that other sources take on meanwhile.
    """

    def __init__(self, graph: Graph, root: int, source: Source, changes: Dict[Source, Any]) -> None:
        self._graph = graph
        self._root = root
        self._source = source
        base = graph.tried(changes) if changes else graph.plain()
        self._base: List[Any] = base or refuse('it is not defined once the others are as wanted')
        self._depends = graph.depending([source])
        self._steps = [step for step in graph.steps(self._depends) if step[0] <= root]
        leaf = graph.occurrences[source][0]
        self.present = self._base[leaf]
        self._kind = type(graph.nodes[leaf]._plain)
        if not self._depends[root]:
            refuse('it does not depend on that')

    def answer(self, wanted: Any, start: Any) -> Any:
        """The value of the source that makes the result the wanted one, found from a start.

        Raises:
            NoPreimage: there is none, or none was found.
        """
        if self._kind is bool:
            fitting = [value for value in (self.present, not self.present) if meets(self._result(value), wanted)]
            return fitting[0] if fitting else refuse('neither True nor False gives that')
        try:
            values = self._at(start)
        except (ArithmeticError, ValueError, TypeError) as error:
            raise NoPreimage('it is not defined at %s (%s)' % (shown(start), error)) from None
        found = self._undone(wanted, values)
        present = self._base[self._root]
        if wanted == present and self._result(self.present) == wanted:
            return self.present
        candidates = self._of_kind(found)
        for candidate in candidates:
            if meets(self._result(candidate), wanted):
                return candidate
        if self._kind is float:
            better = self._searched(
                self._root, wanted, candidates[0], lambda result: almost_meets(result, wanted, present)
            )
            return float(better)
        if self._kind is int:
            return refuse('%s would have to be %s, and is a whole number', '{source}', shown(found))
        return refuse('%r gives %r', candidates[0], self._result(candidates[0]))

    def _at(self, value: Any) -> List[Any]:
        values = list(self._base)
        self._graph.run(self._steps, values, {self._source: value})
        return values

    def _result(self, value: Any) -> Any:
        try:
            return self._at(value)[self._root]
        except (ArithmeticError, ValueError, TypeError):
            return math.nan

    def _undone(self, wanted: Any, values: List[Any]) -> Any:
        graph, index, depends = self._graph, self._graph.index, self._depends
        place = self._root
        while True:
            form, first, second = graph.records[place]
            if form is SOURCE:
                return wanted
            if form.operation is None:
                dependent = [
                    at for at, operand in enumerate(form.operands(first, second)) if depends[index[id(operand)]]
                ]
                if len(dependent) > 1:
                    return self._several(place, wanted, values)
                wanted, place = self._through_form(place, dependent[0], wanted, values)
                continue
            a = index[id(first)]
            if form.single_operand:
                wanted = undone(form, form.inverse, wanted, values[a], second)
                place = a
                continue
            b = index[id(second)]
            if depends[a] and depends[b]:
                return self._several(place, wanted, values)
            side = 0 if depends[a] else 1
            wanted = undone(form, form.inverse[side], wanted, values[a], values[b])
            place = b if side else a

    def _through_form(self, place: int, operand: int, wanted: Any, values: List[Any]) -> Tuple[Any, int]:
        """What an operand of a value must become that is no row's, and the operand's place."""
        form, first, second = self._graph.records[place]
        places = [self._graph.index[id(node)] for node in form.operands(first, second)]
        at = places[operand]
        try:
            found = form.undo(operand, wanted, values[place], first, second, [values[one] for one in places])
        except (ArithmeticError, TypeError):
            return refuse('{source} would be beyond what a float holds')
        if found is NotImplemented:

            def result(value: Any) -> Any:
                others = [value if one == at else values[one] for one in places]
                return form.evaluate(self._graph.nodes[place]._plain, first, second, others)

            def slope(value: Any) -> Any:
                others = [value if one == at else values[one] for one in places]
                return form.slopes(first, second, others)[operand]

            found = Search(result, slope, wanted, lambda made: meets(made, wanted)).near(values[at])
        return found, at

    def _several(self, place: int, wanted: Any, values: List[Any]) -> Any:
        """The source's value where it appears more than once below a node."""
        if isinstance(wanted, str):
            return self._text_within(place, wanted)
        if self._kind is str:
            return refuse('a text that gives a number is not solved for')
        rise, affine = self._graph.tangent(values, self._depends, place)
        start = values[self._graph.occurrences[self._source][0]]
        if affine[place]:
            if not rise[place]:
                refuse('its occurrences cancel out')
            return start + quotient(difference(wanted, values[place]), rise[place])
        return self._searched(place, wanted, start, lambda result: meets(result, wanted))

    def _text_within(self, place: int, wanted: str) -> str:
        """The text that a source must hold which appears in a longer one more than once.

        The result for a text of some length shows, by a letter that nobody uses, where the source goes in it.
        """
        if self._kind is not str:
            return refuse('it appears more than once in a text')
        least = len(self._at('')[place])
        times = len(self._at(MARK)[place]) - least
        mark = MARK * ((len(wanted) - least) // times if times else 0)
        first = self._at(mark)[place].find(mark)
        return wanted[first : first + len(mark)]

    def _searched(self, place: int, wanted: Any, start: Any, accepts: Any) -> Any:
        def slope(value: Any) -> Any:
            return self._graph.tangent(self._at(value), self._depends, place)[0][place]

        return Search(lambda value: self._at(value)[place], slope, wanted, accepts).near(start)

    def _of_kind(self, found: Any) -> List[Any]:
        """What the source can hold nearest to a number found: a float, whole numbers around it, a text."""
        if self._kind is str:
            return [found] if isinstance(found, str) else refuse('%r is not a text', found)
        if isinstance(found, str):
            refuse('%r is not a number', found)
        if self._kind is float:
            try:
                value = float(found)
            except OverflowError:
                value = math.inf
            return [value] if math.isfinite(value) else refuse('{source} would be beyond what a float holds')
        near = round(found)
        return [near, near + 1, near - 1]


def undone(form: Form, inverse: Any, wanted: Any, first: Any, second: Any) -> Any:
    """The operand that gives a wanted result.

    Whole numbers are divided as fractions, so that they stay exact however large.

    Raises:
        NoPreimage: there is none; the operation is named.
    """
    row = form.operation
    if isinstance(wanted, (int, Fraction)):
        if row.left.affine and not isinstance(wanted, bool):
            wanted = Fraction(wanted)
        elif isinstance(wanted, Fraction):
            wanted = float(wanted) if wanted.denominator != 1 else wanted.numerator
    try:
        if row.image is not None and not row.image[0] <= wanted <= row.image[1]:
            refuse('%s takes values in %s', row.shown_as, interval(*row.image))
        if row.stepped and near(round(wanted), wanted):
            wanted = round(wanted)
        operand = inverse(wanted, first, second)
        if isinstance(operand, complex) or (isinstance(operand, float) and not math.isfinite(operand)):
            refuse('%s would need an operand beyond what a float holds', row.shown_as)
    except NoPreimage:
        raise
    except (ArithmeticError, ValueError, TypeError) as error:
        if isinstance(error, ZeroDivisionError):
            raise NoPreimage('%s cannot be undone there (division by zero)' % row.shown_as) from None
        raise NoPreimage('%s cannot give %s (%s)' % (row.shown_as, shown(wanted), error)) from None
    return operand.numerator if isinstance(operand, Fraction) and operand.denominator == 1 else operand


def difference(wanted: Any, present: Any) -> Any:
    """`wanted - present`, as a fraction for whole numbers."""
    try:
        return Fraction(wanted) - present if isinstance(wanted, int) else wanted - present
    except (ArithmeticError, TypeError):
        return refuse('%s is out of reach', shown(wanted))


def quotient(missing: Any, slope: Any) -> Any:
    """`missing / slope`, refused where no float holds it."""
    try:
        change = missing / slope
        return change if change - change == 0 else refuse('{source} would be beyond what a float holds')
    except OverflowError:
        return refuse('{source} would be beyond what a float holds')


def shown(number: Any) -> str:
    """A number found on the way, for a message."""
    return '%.6g' % number if isinstance(number, (float, Fraction)) else repr(number)


def interval(low: float, high: float) -> str:
    """An interval as people write it."""
    return '%s%g, %g%s' % ('[' if low > -math.inf else '(', low, high, ']' if high < math.inf else ')')
