"""Folding: the affine part of an expression as coefficients per source, and the limit on growth.

A value that is updated in a loop, `x = x + v * dt`, must not grow for ever. Once an expression passes `LIMIT`, its
older half is folded: each value at the border gets one record of a slope for each source, which means exactly the same
if the value is affine, and else is its linearization at the present values, which `explain` marks as such. Values that
share the folded part, such as the other elements of a covariance, become shorter as well, so each operation is folded
once.

A fold is made by one sweep from the values down to their sources, which multiplies and adds up slopes: it takes time
and memory in proportion to the operations and sources below them.
"""

import math
from typing import Any, Dict, Iterable, List, Optional, Sequence, Set, Tuple

from .accelerator import CORE
from .annotations import Value
from .graph import slope_or_zero, slopes_or_zeros
from .operations import AFFINE, LAZY, SOURCE, Record
from .sources import Source
from .tracked import PLAIN_CLASSES, TRACKED, new, resolve

LIMIT = 8192
"""The size at which the older half of a value's expression is folded."""

HALF = LIMIT // 2

NUMBERS = (float, int)

MAX_SHARED_SIZE = 16
"""The most that the smaller of two operands adds to the size of a result. Operands mostly share their past; adding
up their sizes would count it twice at every step, and so pass the limit in no time."""

Node = Tuple[Value, Record]
"""A tracked value and the record that is used for it."""

Leaves = List[Tuple[Value, Value]]
"""Values of sources, each with a slope."""

Terms = Tuple[Tuple[Source, Value, Value], ...]
"""`((Source, source's value, slope), ...)`, in order of first appearance."""


def joint_size(first: int, second: int) -> int:
    """The size of a result of two tracked operands of such sizes."""
    return max(first, second) + min(first, second, MAX_SHARED_SIZE) + 1


def size_of(operands: Sequence[Value]) -> int:
    """The size of a result of tracked operands."""
    sizes = sorted([operand._size for operand in operands])
    return sizes[-1] + min(sum(sizes[:-1]), MAX_SHARED_SIZE) + 1 if sizes else 1


def folded(value: Value) -> Record:
    """The record `(AFFINE, ((leaf, slope), ...), is_exact)` that stands for a value near its present one.

    It is exact if the value is affine in its sources, else a linearization. A value remembers its own.
    """
    fold = getattr(value, '_fold', None)
    if fold is None:
        (fold,) = _folds([value])
        if value._record[0] is not SOURCE:  # what is a leaf of folds has none itself
            value._fold = fold
    return fold


def _folds(values: List[Value]) -> List[Record]:
    """The folds of some values."""
    swept = CORE.swept(values) if CORE is not None else NotImplemented
    if swept is NotImplemented:
        nodes = _nodes_below(values)
        swept = [_swept(nodes, value) for value in values]
    return [(AFFINE, *_merged(leaves, is_exact)) for leaves, is_exact in swept]


def _nodes_below(values: List[Value]) -> List[Node]:
    """List the nodes that make up some values, each once, operands before their users, with their folds if they
    remember one, else with their records."""
    found: List[Node] = []
    seen: Set[int] = set()
    stack: List[Tuple[Value, Optional[Record]]] = [(value, None) for value in reversed(values)]
    while stack:
        node, record = stack.pop()
        if record is not None:
            found.append((node, record))
        elif id(node) not in seen:
            seen.add(id(node))
            record = getattr(node, '_fold', None) or resolve(node)
            form, first, second = record
            stack.append((node, record))
            stack.extend([(operand, None) for operand in reversed(form.operands(first, second))])
    return found


def _swept(nodes: List[Node], root: Value) -> Tuple[Leaves, bool]:
    """The slope of a node for each source's value below it, by one sweep backwards, and whether these say exactly what
    it is."""
    weights: Dict[int, Value] = {id(root): 1}
    exact = True
    for node, record in reversed(nodes):
        form, first, second = record
        if id(node) not in weights:
            continue
        if form is SOURCE:
            exact = exact and type(node._plain) in NUMBERS
            continue
        weight = weights.pop(id(node))
        exact = exact and _is_exact(record)
        if form.single_operand:
            operands: Iterable[Value] = (first,)
            slopes: Iterable[Value] = (slope_or_zero(form.slope, first._plain, second),)
        else:
            operands = form.operands(first, second)
            slopes = slopes_or_zeros(record, [operand._plain for operand in operands])
        for operand, slope in zip(operands, slopes):
            try:
                total = weights.get(id(operand), 0) + weight * slope
                finite = total - total == 0
            except OverflowError:
                finite = False
            exact = exact and finite
            weights[id(operand)] = total if finite else 0
    # Only sources are left.
    return [(node, weights[id(node)]) for node, _ in nodes if id(node) in weights], exact


def _is_exact(record: Record) -> bool:
    """Return True if the slopes at the present values describe a record exactly."""
    form, first, second = record
    if form is AFFINE:
        return bool(second)
    if form.single_operand:
        # A slope of 0 may stand for one that no float can hold.
        return form.affine and (second == 0 or slope_or_zero(form.slope, first._plain, second) != 0)
    return bool(form.affine)


def _merged(leaves: Leaves, is_exact: bool) -> Tuple[Tuple[Tuple[Value, Value], ...], bool]:
    """Terms with each source once, and whether they are exact."""
    terms: Dict[Source, Tuple[Value, Value]] = {}
    for leaf, slope in leaves:
        source = leaf._record[1]
        if source in terms:
            known, part = terms[source]
            slope += part
            if known._plain != leaf._plain:
                # The source changed between two readings. All that counts is the sum of both terms: it has both
                # slopes, from the mean of the two values, as far as there is one.
                mean = known._plain + (leaf._plain - known._plain) * (slope - part) / slope if slope else math.inf
                is_exact = is_exact and isinstance(mean, type(known._plain)) and math.isfinite(mean)
                known = new(mean, known._record, 1) if is_exact else known
            leaf = known
        terms[source] = leaf, slope
    return tuple(terms.values()), is_exact


def affine(x: Value) -> Optional[Terms]:
    """The terms of a value that is affine in its sources.

    Returns:
        `((Source, source's value, slope), ...)` in order of first appearance, so that the value for other source
        values is its present one plus the sum of each slope times its source's change; None if it is not
        affine (texts and bools are not); `()` for an untracked value.
    """
    if type(x) not in TRACKED:
        return ()
    if type(x) not in PLAIN_CLASSES:
        return affine(x.tracked)
    if x._record[0] is LAZY:
        resolve(x)
        return affine(x)  # the core knows it now
    form, first, _ = x._record
    if form is SOURCE:
        return ((first, x._plain, 1),) if type(x._plain) in NUMBERS else None
    return linearized(x) if folded(x)[2] else None


affine_of_python = affine
if CORE is not None:
    affine = CORE.affine


def linearized(x: Value) -> Terms:
    """The terms of a tracked value near its present one: those of `affine` if it is affine.

    Returns:
        `((Source, source's value, slope), ...)` in order of first appearance, each source once. A slope is 0 if the
        value has none, and the source's value may be a text or a bool.
    """
    return tuple([(leaf._record[1], leaf._plain, slope) for leaf, slope in folded(x)[1]])


def shorten(value: Value) -> None:
    """Keep a value's expression within the limit: fold the older half of it."""
    borders = _resized(value)
    if value._size > LIMIT:
        for border, fold in zip(borders, _folds(borders)):
            _replace(border, fold)
        _resized(value)
    if value._size > LIMIT:
        _replace(value, *_folds([value]))


def _replace(value: Value, fold: Record) -> None:
    """Replace a value's record with its fold, which counts as one operation."""
    value._record = value._fold = fold
    value._size = 1


def _resized(value: Value) -> List[Value]:
    """Work out anew how large the newer half of an expression is, as its operands may have been folded since.

    Returns:
        The values at the border to the older half, except those that few operations made.
    """
    if CORE is not None:
        found: Any = CORE.resized(value, HALF)
        if found is not NotImplemented:
            return list(found)
    borders: List[Value] = []
    seen: Set[int] = set()
    stack: List[Tuple[Value, Sequence[Value]]] = [(value, ())]
    while stack:
        node, operands = stack.pop()
        if operands:
            node._size = size_of(operands)
        elif id(node) not in seen:
            seen.add(id(node))
            if node._size > HALF:
                form, first, second = resolve(node)
                operands = form.operands(first, second)
                stack.append((node, operands))
                stack.extend([(operand, ()) for operand in reversed(operands)])
            elif node._size > HALF // 2:
                borders.append(node)
    return borders
