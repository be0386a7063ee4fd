"""Walking expressions: their nodes in order, their sources, their values and slopes for other source values."""

from typing import Any, Dict, Iterable, List, Mapping, Optional

from .accelerator import CORE
from .annotations import Value
from .operations import SOURCE
from .sources import Source
from .tracked import TRACKED, resolve
from .tree import leaves, rebuilt, scalars

UNDEFINED = (ArithmeticError, ValueError, TypeError)
"""Exceptions of undefined arithmetic: a result that is not real or not finite, or unsuitable operands."""


class Graph:
    """The nodes that make up some values, each once, operands before their users, left before right.

    The records are taken once: a value that is folded meanwhile does not disturb.

    Attributes:
        nodes: the tracked values.
        records: for each node its record `(form, first, second)`.
        index: the index of each node in `nodes`, by id.
        occurrences: for each source, in order of first appearance, the indices of its nodes.
        begins: for the index of each root, the index of the first node that was added for it. All nodes from there to
            the root belong to it.
    """

    __slots__ = ('nodes', 'records', 'index', 'occurrences', 'begins', '_steps')

    def __init__(self, roots: Iterable[Value]) -> None:
        self.nodes: List[Value] = []
        self.records: List[tuple] = []
        self.index: Dict[int, int] = {}
        self.occurrences: Dict[Source, List[int]] = {}
        self.begins: Dict[int, int] = {}
        self._steps: Optional[List[tuple]] = None
        for root in roots:
            begin = len(self.nodes)
            if CORE is None:
                self._add(root)
            else:
                CORE.add_nodes(root, self.nodes, self.records, self.index, self.occurrences)
            if begin < len(self.nodes):
                self.begins[len(self.nodes) - 1] = begin

    def _add(self, root: Value) -> None:
        index = self.index
        stack = [root]
        while stack:
            node = stack[-1]
            if id(node) in index:
                stack.pop()
                continue
            record = resolve(node)
            form, first, second = record
            missing = [operand for operand in form.operands(first, second) if id(operand) not in index]
            if missing:
                stack.extend(reversed(missing))
                continue
            if form is SOURCE:
                self.occurrences.setdefault(first, []).append(len(self.nodes))
            index[id(node)] = len(self.nodes)
            self.nodes.append(node)
            self.records.append(record)
            stack.pop()

    def plain(self) -> List[Value]:
        """The present plain value of each node."""
        return [node._plain for node in self.nodes]

    def depending(self, changed: Iterable[Source]) -> List[bool]:
        """Return a flag for each node: True if it depends on one of the sources."""
        changed = set(changed)
        if changed.issuperset(self.occurrences):
            return [True] * len(self.nodes)
        flags = [False] * len(self.nodes)
        for source, places in self.occurrences.items():
            if source in changed:
                for place in places:
                    flags[place] = True
        for place, forward, first, second, _ in self.steps():
            if forward is None:
                flags[place] = any(flags[operand] for operand in first)
            else:
                flags[place] = flags[first] if second is None else flags[first] or flags[second]
        return flags

    def steps(self, depends: Optional[List[bool]] = None) -> List[tuple]:
        """List the steps of `run`: one for each operation that depends on changed sources, or by default for all.

        A step is `(index, forward, index of the operand, None, constant)`, `(index, forward, index, index, None)` with
        two operands, or `(index, None, indices of the operands, None, present value)` if the form evaluates it.
        """
        if self._steps is None:
            self._steps = self._all_steps()
        if depends is None or False not in depends:
            return self._steps
        return [step for step in self._steps if depends[step[0]]]

    def _all_steps(self) -> List[tuple]:
        index = self.index
        steps: List[tuple] = []
        for place, (form, first, second) in enumerate(self.records):
            if form is SOURCE:
                continue
            if form.single_operand:
                steps.append((place, form.forward, index[id(first)], None, second))
            elif form.operation is not None:
                steps.append((place, form.forward, index[id(first)], index[id(second)], None))
            else:
                operands = [index[id(operand)] for operand in form.operands(first, second)]
                steps.append((place, None, operands, None, self.nodes[place]._plain))
        return steps

    def run(self, steps: List[tuple], values: List[Value], changes: Mapping[Source, Value], most_bits: int = 0) -> None:
        """Update the list of the nodes' values for changed source values.

        Args:
            steps: the steps to run, from `steps`.
            values: the value of each node; it is changed.
            changes: `{Source: value}`.
            most_bits: the length at which whole numbers are refused, 0 for none.

        Raises:
            ArithmeticError, ValueError, TypeError: as the operations themselves do for such values.
        """
        records = self.records
        for source, value in changes.items():
            for place in self.occurrences.get(source, ()):
                values[place] = value
        for place, forward, first, second, constant in steps:
            if second is not None:
                value = forward(values[first], values[second])
            elif forward is not None:
                value = forward(values[first], constant)
            else:
                form, of, by = records[place]
                value = form.evaluate(constant, of, by, [values[operand] for operand in first])
            if most_bits and type(value) is int and value.bit_length() > most_bits:
                raise OverflowError('a number of %d digits' % (value.bit_length() * 0.30103))
            values[place] = value

    def values(self, changes: Mapping[Source, Value]) -> List[Value]:
        """The plain value of each node if some sources have other values."""
        values = self.plain()
        self.run(self.steps(self.depending(changes)), values, changes)
        return values

    def partials(self, steps: List[tuple], values: List[Value]) -> Dict[int, tuple]:
        """The slopes of each node for its operands, at given values of the nodes: `{index: ((operand, slope), ...)}`.

        It is 0 if there is none, or none that a float holds. Constants are left out.
        """
        found: Dict[int, tuple] = {}
        records = self.records
        for place, forward, first, second, constant in steps:
            form = records[place][0]
            if forward is None:
                found[place] = tuple(zip(first, slopes_or_zeros(records[place], [values[at] for at in first])))
            elif second is None:
                found[place] = ((first, slope_or_zero(form.slope, values[first], constant)),)
            else:
                a, b = values[first], values[second]
                one, other = form.slope
                try:
                    slopes = one(a, b), other(a, b)
                    total = slopes[0] + slopes[1]
                    is_known = total - total == 0 and type(total) is not complex
                except UNDEFINED:
                    is_known = False
                if not is_known:
                    slopes = slope_or_zero(one, a, b), slope_or_zero(other, a, b)
                found[place] = ((first, slopes[0]), (second, slopes[1]))
        return found

    def below(self, root: int, partials: Dict[int, tuple]) -> List[int]:
        """List the indices of a node and of all nodes below it that may change, users before their operands."""
        begin = self.begins.get(root, root)
        own = range(root, begin - 1, -1)
        # The shared nodes that other roots brought in.
        shared = {operand for place in own if place in partials for operand, _ in partials[place] if operand < begin}
        stack = list(shared)
        while stack:
            for operand, _ in partials.get(stack.pop(), ()):
                if operand not in shared:
                    shared.add(operand)
                    stack.append(operand)
        return [*own, *sorted(shared, reverse=True)]

    def gradient(self, root: int, partials: Dict[int, tuple], below: List[int], one: Value = 1) -> Dict[Source, Value]:
        """The slope of one node for each source that may change, by one sweep backwards.

        Args:
            root: the index of the node.
            partials: as `partials` gives them.
            below: as `below` gives it for this root.
            one: the node's slope for itself: 1 if slopes that are whole numbers stay exact, 1.0 if all are floats.
        """
        records = self.records
        weights: Dict[int, Value] = {root: one}
        found: Dict[Source, Value] = {}
        for place in below:
            weight = weights.pop(place, 0)
            if not weight:
                continue
            slopes = partials.get(place)
            if slopes is None:
                form, source, _ = records[place]
                if form is SOURCE:
                    found[source] = found.get(source, 0) + weight
                continue
            for operand, slope in slopes:
                if slope:
                    weights[operand] = weights.get(operand, 0) + weight * slope
        return found

    def tangent(self, source: Source, partials: Dict[int, tuple], one: Value = 1) -> Dict[int, Value]:
        """The slope of each node for one source, by one sweep forwards: `{index: slope}`, without zeros.

        Args:
            source: it moves; if it was read several times, all its readings move together.
            partials: as `partials` gives them, in the order of the indices.
            one: the slope of the source for itself, as in `gradient`.
        """
        rise: Dict[int, Value] = dict.fromkeys(self.occurrences[source], one)
        for place, slopes in partials.items():
            total = 0
            for operand, slope in slopes:
                if slope and operand in rise:
                    total += slope * rise[operand]
            if total:
                rise[place] = total
        return rise

    def affine(self, depends: List[bool]) -> List[bool]:
        """Return a flag for each node: True if it is affine in all changing sources together."""
        flags = [True] * len(self.nodes)
        for place, forward, first, second, _ in self.steps(depends):
            form, of, by = self.records[place]
            if form.single_operand:
                flags[place] = form.affine and flags[first]
                continue
            places = first if forward is None else (first, second)
            is_affine = all(flags[at] for at in places)
            flags[place] = is_affine and form.is_affine(of, by, [depends[at] for at in places])
        return flags


def slope_or_zero(slope: Any, a: Any, b: Any) -> Any:
    """A slope of the table at a point, 0 if there is none or none that a float holds."""
    try:
        value = slope(a, b)
        return value if value - value == 0 and type(value) is not complex else 0
    except UNDEFINED:
        return 0


def slopes_or_zeros(record: tuple, values: List[Value]) -> List[Value]:
    """The slopes of any form of record at such values of its operands, 0 if there are none that a float holds."""
    form, first, second = record
    try:
        slopes = form.slopes(first, second, values)
        return [slope if slope - slope == 0 else 0 for slope in slopes]
    except UNDEFINED:
        return [0] * len(values)


def tracked_leaves(x: Value) -> List[Value]:
    """The tracked values in a value, message, list or dict."""
    return [x] if type(x) in TRACKED else [leaf for _, leaf in leaves(x) if type(leaf) in TRACKED]


def sources(x: Value) -> List[Source]:
    """The sources of a value, message, list or dict, each once, in order of first appearance."""
    return list(Graph(tracked_leaves(x)).occurrences)


def check_changes(changes: Mapping[Source, Value]) -> None:
    """Refuse changes whose keys are not Sources.

    Raises:
        TypeError: a key is no Source.
    """
    for key in changes:
        if not isinstance(key, Source):
            raise TypeError('changes are {Source: value}, and %r is of type %s' % (key, type(key).__name__))


def evaluate(x: Value, changes: Mapping[Source, Value]) -> Value:
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
        # A chain of operations on one source is evaluated in a fifth of the time by the core.
        value = CORE.along_chain(x, changes) if CORE is not None else NotImplemented
        if value is not NotImplemented:
            return value
        return Graph([x]).values(changes)[-1]
    found = scalars(x)
    graph = Graph([leaf for leaf in found if type(leaf) in TRACKED])
    values = graph.values(changes)
    made = iter([values[graph.index[id(leaf)]] if type(leaf) in TRACKED else leaf for leaf in found])
    return rebuilt(x, lambda _: next(made))
