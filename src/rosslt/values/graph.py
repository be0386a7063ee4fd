"""Walking expressions: their nodes in order, their sources, their values and slopes for other source values."""

from typing import Any, Dict, Iterable, List, Optional, Tuple

from .operations import SOURCE
from .sources import Source
from .tracked import TRACKED, resolve
from .tree import leaves, rebuilt


class Graph:
    """The nodes that make up some values, each once, operands before their users, left before right.

    The records are taken once: a value that is folded meanwhile does not disturb.

    Attributes:
        nodes: the tracked values.
        records: for each node its record `(form, first, second)`.
        index: the place of each node, by id.
        occurrences: for each source, in order of first appearance, the places of the nodes that are it.
    """

    __slots__ = ('nodes', 'records', 'index', 'occurrences')

    def __init__(self, roots: Iterable[Any]) -> None:
        self.nodes: List[Any] = []
        self.records: List[tuple] = []
        self.index: Dict[int, int] = {}
        self.occurrences: Dict[Source, List[int]] = {}
        for root in roots:
            self._add(root)

    def _add(self, root: Any) -> None:
        index = self.index
        stack = [root]
        while stack:
            node = stack[-1]
            if id(node) in index:
                stack.pop()
                continue
            record = node._record
            form, first, second = record
            if form.single_operand:
                if id(first) not in index:
                    stack.append(first)
                    continue
            elif form.operation is not None:
                if id(first) not in index:
                    if id(second) not in index:
                        stack.append(second)
                    stack.append(first)
                    continue
                if id(second) not in index:
                    stack.append(second)
                    continue
            else:
                record = resolve(node)
                form, first, second = record
                if record[0].operation is not None:
                    continue
                if form is SOURCE:
                    self.occurrences.setdefault(first, []).append(len(self.nodes))
                else:
                    missing = [operand for operand in form.operands(first, second) if id(operand) not in index]
                    if missing:
                        stack.extend(reversed(missing))
                        continue
            index[id(node)] = len(self.nodes)
            self.nodes.append(node)
            self.records.append(record)
            stack.pop()

    def plain(self) -> List[Any]:
        """The present plain value of each node."""
        return [node._plain for node in self.nodes]

    def depending(self, changed: Iterable[Source]) -> List[bool]:
        """For each node, whether it depends on one of the sources."""
        changed = set(changed)
        index = self.index
        flags: List[bool] = []
        for form, first, second in self.records:
            if form.single_operand:
                flag = flags[index[id(first)]]
            elif form is SOURCE:
                flag = first in changed
            else:
                flag = any(flags[index[id(operand)]] for operand in form.operands(first, second))
            flags.append(flag)
        return flags

    def steps(self, depends: List[bool]) -> List[tuple]:
        """What `run` does: a step for each node that depends on what changes, sources aside."""
        index = self.index
        steps: List[tuple] = []
        for place, (form, first, second) in enumerate(self.records):
            if not depends[place] or form is SOURCE:
                continue
            if form.single_operand:
                steps.append((place, form.forward, index[id(first)], None, second))
            elif form.operation is not None:
                steps.append((place, form.forward, index[id(first)], index[id(second)], None))
            else:
                operands = [index[id(operand)] for operand in form.operands(first, second)]
                steps.append((place, None, operands, None, (form, self.nodes[place]._plain, first, second)))
        return steps

    def run(self, steps: List[tuple], values: List[Any], changes: Dict[Source, Any]) -> None:
        """Bring the nodes' values up to date with changed source values, in place.

        Raises:
            ArithmeticError, ValueError, TypeError: as the operations themselves do for such values.
        """
        for source, value in changes.items():
            for place in self.occurrences.get(source, ()):
                values[place] = value
        for place, forward, first, second, constant in steps:
            if forward is None:
                form, present, of, by = constant
                values[place] = form.evaluate(present, of, by, [values[operand] for operand in first])
            elif second is None:
                values[place] = forward(values[first], constant)
            else:
                values[place] = forward(values[first], values[second])

    def values(self, changes: Dict[Source, Any]) -> List[Any]:
        """The plain value of each node where some sources have other values."""
        values = self.plain()
        self.run(self.steps(self.depending(changes)), values, changes)
        return values

    def tried(self, changes: Dict[Source, Any]) -> Optional[List[Any]]:
        """`values`, None where an operation is not defined for such source values."""
        try:
            return self.values(changes)
        except (ArithmeticError, ValueError, TypeError):
            return None

    def slopes(self, place: int, values: List[Any], depends: List[bool]) -> Tuple[Any, ...]:
        """The slope of a node for each of its operands, at such values of the nodes; 0 where there is none."""
        form, first, second = self.records[place]
        index = self.index
        if form.single_operand:
            return (slope_or_zero(form.slope, values[index[id(first)]], second),)
        if form.operation is None:
            operands = form.operands(first, second)
            try:
                slopes = form.slopes(first, second, [values[index[id(operand)]] for operand in operands])
                return tuple([slope if slope - slope == 0 else 0 for slope in slopes])
            except (ArithmeticError, ValueError, TypeError):
                return (0,) * len(operands)
        a, b = index[id(first)], index[id(second)]
        return (
            slope_or_zero(form.slope[0], values[a], values[b]) if depends[a] else 0,
            slope_or_zero(form.slope[1], values[a], values[b]) if depends[b] else 0,
        )

    def gradient(self, root: int, values: List[Any], depends: List[bool]) -> Dict[Source, Any]:
        """The slope of one node for each source that it depends on, by one sweep backwards."""
        index = self.index
        weights: List[Any] = [0] * (root + 1)
        weights[root] = 1
        found: Dict[Source, Any] = {}
        for place in range(root, -1, -1):
            weight = weights[place]
            if not weight or not depends[place]:
                continue
            form, first, second = self.records[place]
            if form is SOURCE:
                found[first] = found.get(first, 0) + weight
            else:
                slopes = self.slopes(place, values, depends)
                for operand, slope in zip(form.operands(first, second), slopes):
                    weights[index[id(operand)]] += weight * slope
        return found

    def tangent(self, values: List[Any], depends: List[bool], root: int) -> Tuple[List[Any], List[bool]]:
        """The slope of each node up to the root for all that changes together, by one sweep forwards.

        Returns:
            The slopes, and for each node whether it is affine in what changes.
        """
        index = self.index
        rise: List[Any] = []
        straight: List[bool] = []
        for place in range(root + 1):
            form, first, second = self.records[place]
            slope, affine = 0, True
            if not depends[place]:
                pass
            elif form is SOURCE:
                slope = 1
            elif form.single_operand:
                a = index[id(first)]
                slope = rise[a] * self.slopes(place, values, depends)[0]
                affine = form.affine and straight[a]
            else:
                places = [index[id(operand)] for operand in form.operands(first, second)]
                slope = sum(rise[at] * part for at, part in zip(places, self.slopes(place, values, depends)))
                affine = form.is_affine(first, second, [depends[at] for at in places])
                affine = affine and all(straight[at] for at in places)
            rise.append(slope)
            straight.append(affine)
        return rise, straight


def slope_or_zero(slope: Any, a: Any, b: Any) -> Any:
    """A slope of the table at a point, 0 where there is none or none that a float holds."""
    try:
        value = slope(a, b)
        return value if value - value == 0 else 0
    except (ArithmeticError, ValueError, TypeError):
        return 0


def tracked_leaves(x: Any) -> List[Any]:
    """The tracked values in a value, message, list or dict."""
    return [x] if type(x) in TRACKED else [leaf for _, leaf in leaves(x) if type(leaf) in TRACKED]


def sources(x: Any) -> List[Source]:
    """The sources of a value, message, list or dict, each once, in order of first appearance."""
    return list(Graph(tracked_leaves(x)).occurrences)


def check_changes(changes: Dict[Source, Any]) -> None:
    """Refuse changes that do not say of which Source.

    Raises:
        TypeError: a key is no Source.
    """
    for key in changes:
        if type(key) is not Source:
            raise TypeError('changes are {Source: value}, and %r is a %s' % (key, type(key).__name__))


def evaluate(x: Any, changes: Dict[Source, Any]) -> Any:
    """The value that an expression has with other source values.

    Args:
        x: a tracked value, or a message, list or dict holding such; it is not changed.
        changes: `{Source: value}`; sources that are missing keep their values.

    Returns:
        The plain value, or a copy of the message, list or dict holding plain values.

    Raises:
        TypeError: a key of `changes` is no Source.
        ArithmeticError, ValueError: as the operations themselves do for such values.
    """
    check_changes(changes)
    if type(x) in TRACKED:
        value = _along_chain(x, changes)
        if value is not None:
            return value
        return Graph([x]).values(changes)[-1]
    graph = Graph(tracked_leaves(x))
    values = graph.values(changes)
    return rebuilt(x, lambda leaf: values[graph.index[id(leaf)]] if type(leaf) in TRACKED else leaf)


def _along_chain(x: Any, changes: Dict[Source, Any]) -> Optional[Any]:
    """The value of a chain of operations on one source, None for any other expression."""
    records = []
    record = x._record
    form, first, _ = record
    while form.single_operand:
        records.append(record)
        record = first._record
        form, first, _ = record
    if form is not SOURCE or first not in changes:
        return None
    value = changes[first]
    for form, _, second in reversed(records):
        value = form.forward(value, second)
    return value
