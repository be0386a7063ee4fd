"""Solves one result for one source (paper, IV.A, `force_value`).

From the result, the operations are undone one after the other as long as only one operand depends on the source.
If two do, the source appears more than once: if the rest is affine in it, its slope gives the answer. An operation
with several inverses is undone to the one nearest its operand's value. If that gives no answer, or one out of bounds,
the source's values are searched.
"""

import math
from fractions import Fraction
from typing import Any, List, Tuple

from ..annotations import Value
from ..graph import UNDEFINED, Graph
from ..operations import SOURCE, Form
from ..operations.inverses import NoPreimage, refuse
from ..operations.table import MOST_BITS
from ..sources import Source
from ..tolerances import almost_meets, is_at, is_same, meets
from .budget import Budget, Exhausted, Trial
from .freedom import in_floats
from .periods import Periods, turns_too_many
from .root_finding import Search

Limits = Tuple[Value, Value]


class OutOfBounds(NoPreimage):
    """The answer found is beyond a bound; there may be a second one within."""


class NoFormula(NoPreimage):
    """The source appears more than once, and the result is not affine in it."""


class Attempt:
    """A result of a graph as a function of one source.

    Args:
        graph: holds the result and the nodes below it.
        root: the index of the result in the graph.
        source: the source that may change.
        base: the values of the nodes after the changes that are already decided for other sources.
        limits: the source's minimum and maximum, infinite for none.
        budget: the work that it may take.
        wanted: the wanted result.
    """

    def __init__(
        self,
        graph: Graph,
        root: int,
        source: Source,
        base: List[Value],
        limits: Limits,
        budget: Budget,
        wanted: Value,
    ) -> None:
        self._graph = graph
        self._root = root
        self._source = source
        self._base = base
        self._trial = Trial(graph, [source], [root], base, budget)
        self._wanted = wanted
        self._depends = self._trial.depends
        leaf = graph.occurrences[source][0]
        self.present = base[leaf]
        self._kind = type(graph.nodes[leaf]._plain)
        self._low: Value
        self._high: Value
        self._low, self._high = in_floats(limits) if self._kind is float else limits
        if self._kind is int:
            self._low = math.ceil(self._low) if math.isfinite(self._low) else self._low
            self._high = math.floor(self._high) if math.isfinite(self._high) else self._high
        if not self._depends[root]:
            refuse('it does not depend on that')

    def answer(self) -> Value:
        """The value of the source that makes the result the wanted one, the nearest to the present one of those found.

        Raises:
            NoPreimage: there is none, or none was found.
        """
        wanted = self._wanted
        if self._kind is bool:
            fitting = [value for value in (self.present, not self.present) if meets(self._result(value), wanted)]
            fitting = [value for value in fitting if self._low <= value <= self._high or value == self.present]
            return fitting[0] if fitting else refuse('neither True nor False gives that')
        try:
            return self._from_present(wanted)
        except Exhausted:
            raise
        except NoPreimage as reason:
            if self._kind is str or self._is_final(reason):
                raise
            if self._gives_it_now(wanted):
                return self.present
            try:
                return self._searched(wanted)
            except Exhausted as end:
                raise NoPreimage('%s; %s' % (reason, end)) from None
            except NoPreimage as other:
                raise (other if isinstance(reason, NoFormula) else reason) from None

    def _gives_it_now(self, wanted: Value) -> bool:
        """Return True if the present value gives the wanted result. It is then kept even if it is out of bounds."""
        return bool(wanted == self._base[self._root] and self._result(self.present) == wanted)

    def _is_final(self, reason: NoPreimage) -> bool:
        """Return True if an answer beyond a bound is the only answer, so that a search is useless."""
        return isinstance(reason, OutOfBounds) and self._graph.affine(self._depends)[self._root]

    def _from_present(self, wanted: Value) -> Value:
        """The answer to which undoing the operations leads, where those with several inverses take the one
        nearest to the present value."""
        try:
            values = self._trial.values({self._source: self.present})
        except Exhausted:
            raise
        except UNDEFINED as error:
            raise NoPreimage('it is not defined at %s (%s)' % (shown(self.present), error)) from None
        found = self._undone(wanted, values)
        if self._gives_it_now(wanted):
            return self.present
        candidates = self._of_kind(found)
        for candidate in candidates:
            if meets(self._result(candidate), wanted):
                return self._bounded(candidate, wanted)
        if self._kind is float:
            search = self._search(wanted)
            better = search.descend(candidates[0])
            return self._bounded(better if search.is_met(better) else search.near(candidates[0]), wanted)
        if self._kind is int:
            return refuse('%s would have to be %s, and is a whole number', '{source}', shown(found))
        return refuse('%r gives %r', candidates[0], self._result(candidates[0]))

    def _accepts(self, result: Value, wanted: Value) -> bool:
        if self._kind is float:
            return almost_meets(result, wanted, self._base[self._root])
        return meets(result, wanted)

    def _bounded(self, value: Value, wanted: Value) -> Value:
        """An answer within the bounds: a bound itself if the answer misses it, or lies before it, by roundings.

        Raises:
            OutOfBounds: the answer is beyond a bound, which is named.
        """
        if isinstance(value, str):
            return value
        low, high = self._low, self._high
        for bound, word, is_beyond in (
            (low, 'below its minimum', value < low),
            (high, 'above its maximum', value > high),
        ):
            if is_beyond or (self._kind is float and is_at(value, bound) and value != bound):
                if math.isfinite(bound) and self._accepts(self._result(self._kind(bound)), wanted):
                    return self._kind(bound)
                if is_beyond:
                    raise OutOfBounds(beyond_bound(value, bound, word))
        return value

    def _result(self, value: Value) -> Value:
        values = self._trial.tried({self._source: value})
        return math.nan if values is None else values[self._root]

    def _undone(self, wanted: Value, values: List[Value]) -> Value:
        graph, index, depends = self._graph, self._graph.index, self._depends
        place = self._root
        while True:
            form, first, second = graph.records[place]
            if form is SOURCE:
                return wanted
            if form.operation is None:
                operands = [index[id(operand)] for operand in form.operands(first, second)]
                changing = [at for at, operand in enumerate(operands) if depends[operand]]
                found = NotImplemented
                if len(changing) == 1:
                    found = self._through_form(
                        place, changing[0], wanted, [values[at] for at in operands], values[place]
                    )
                if found is NotImplemented:
                    return self._affine(place, wanted, values)
                wanted, place = found, operands[changing[0]]
                continue
            a = index[id(first)]
            if form.single_operand:
                wanted = undone(form, form.inverse, wanted, values[a], second)
                place = a
                continue
            b = index[id(second)]
            if depends[a] and depends[b]:
                return self._affine(place, wanted, values)
            side = 0 if depends[a] else 1
            wanted = undone(form, form.inverse[side], wanted, values[a], values[b])
            place = b if side else a

    def _through_form(self, place: int, operand: int, wanted: Value, values: List[Value], present: Value) -> Value:
        """Return the operand's value for a wanted value of a record that is not in the table of operations.

        NotImplemented if that needs a search.
        """
        form, first, second = self._graph.records[place]
        try:
            found = form.undo(operand, wanted, present, first, second, values)
        except NoPreimage:
            raise
        except UNDEFINED:
            return refuse('{source} would be beyond what a float holds')
        if isinstance(found, float) and not math.isfinite(found):
            refuse('{source} would be beyond what a float holds')
        return found

    def _affine(self, place: int, wanted: Value, values: List[Value]) -> Value:
        """The source's value if it appears more than once below a node that is affine in it.

        Raises:
            NoFormula: the node is not.
        """
        if str in (self._kind, type(wanted)):
            return refuse('it appears more than once, and texts are not searched')
        if not self._graph.affine(self._depends)[place]:
            raise NoFormula('it appears more than once')
        rise = self._graph.tangent(self._source, self._trial.partials(values)).get(place, 0)
        if not rise:
            refuse('its occurrences cancel out')
        return self.present + quotient(difference(wanted, values[place]), rise)

    def _search(self, wanted: Value, low: float = -math.inf, high: float = math.inf) -> Search:
        def slope(value: Value) -> Value:
            values = self._trial.values({self._source: value})
            return self._graph.tangent(self._source, self._trial.partials(values)).get(self._root, 0)

        def result(value: Value) -> Value:
            return self._trial.values({self._source: value})[self._root]

        return Search(result, slope, wanted, lambda found: self._accepts(found, wanted), low, high)

    def _searched(self, wanted: Value) -> Value:
        """The source's value that gives the wanted result, searched for, within half a period of the present one."""
        search = self._search(wanted, self._low, self._high)
        found = search.near(self.present)
        if self._kind is float and abs(found - self.present) > 1:
            values = self._trial.values({self._source: found})
            (periods,) = Periods(self._trial).of([self._source], values)
            for period in periods:
                turns = turns_too_many(self.present, found, period)
                turned = search.descend(found - turns * period, 4) if turns else found
                if abs(turned - self.present) < abs(found - self.present) and search.is_met(turned):
                    found = turned
        return found

    def _of_kind(self, found: Value) -> List[Value]:
        """Convert an answer to values of the source's type: a float, the whole numbers around it, or a text."""
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
        nearest = round(found)
        return [nearest, nearest + 1, nearest - 1]


def undone(form: Form, inverse: Any, wanted: Any, first: Any, second: Any) -> Any:
    """The operand that gives a wanted result.

    Whole numbers are divided as fractions, so that they stay exact however large.

    Raises:
        NoPreimage: there is none; the operation is named.
    """
    row = form.operation
    if isinstance(wanted, (int, Fraction)):
        if wanted.numerator.bit_length() > MOST_BITS:
            refuse('%s would have to give a number of too many digits', row.shown_as)
        if 'a' in row.affine and not isinstance(wanted, bool):
            wanted = Fraction(wanted)
        elif isinstance(wanted, Fraction):
            wanted = float(wanted) if wanted.denominator != 1 else wanted.numerator
    try:
        if row.image is not None and not row.image[0] <= wanted <= row.image[1]:
            refuse('%s takes values in %s', row.shown_as, interval(*row.image))
        if row.stepped and is_same(round(wanted), wanted):
            wanted = round(wanted)
        operand = inverse(wanted, first, second)
        if isinstance(operand, complex) or (isinstance(operand, float) and not math.isfinite(operand)):
            refuse('%s would need an operand beyond what a float holds', row.shown_as)
    except NoPreimage:
        raise
    except UNDEFINED as error:
        if isinstance(error, ZeroDivisionError):
            raise NoPreimage('%s cannot be undone there (division by zero)' % row.shown_as) from None
        raise NoPreimage('%s cannot give %s (%s)' % (row.shown_as, shown(wanted), error)) from None
    return operand.numerator if isinstance(operand, Fraction) and operand.denominator == 1 else operand


def difference(wanted: Value, present: Value) -> Value:
    """`wanted - present`, as a fraction for whole numbers."""
    try:
        return Fraction(wanted) - present if isinstance(wanted, int) else wanted - present
    except (ArithmeticError, TypeError):
        return refuse('%s is out of reach', shown(wanted))


def quotient(missing: Any, slope: Any) -> Any:
    """`missing / slope`, refused if no float holds it."""
    try:
        change = missing / slope
        return change if change - change == 0 else refuse('{source} would be beyond what a float holds')
    except OverflowError:
        return refuse('{source} would be beyond what a float holds')


def shown(number: Value) -> str:
    """A number found on the way, for a message."""
    return '%.6g' % number if isinstance(number, float) else written(number)


def beyond_bound(value: Value, bound: Value, word: str) -> str:
    """Why a source does not take a value."""
    return '{source} would have to be %s, %s %r' % (written(value), word, bound)


def written(number: Value) -> str:
    """A number in full, unless it is a whole number or a fraction too long to read."""
    if isinstance(number, (int, Fraction)) and number.numerator.bit_length() > 1000:
        return 'a number of %d digits' % (number.numerator.bit_length() * 0.30103)
    return '%.6g' % number if isinstance(number, Fraction) else repr(number)


def interval(low: float, high: float) -> str:
    """An interval as people write it."""
    return '%s%g, %g%s' % ('[' if low > -math.inf else '(', low, high, ']' if high < math.inf else ')')
