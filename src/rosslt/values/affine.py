"""Folding: the affine part of an expression as coefficients per source, and the limit on growth.

A value that is updated in a loop, `x = x + v * dt`, must not grow for ever. Once an expression passes `LIMIT`, what is
affine in its sources is folded into one record, which means exactly the same; if that is not enough, the rest is
replaced by its linearization at the present values, which `explain` marks as such.

A fold is made by one sweep from the value down to its sources, which multiplies and adds up slopes: it takes time and
memory in proportion to the operations and sources below the value.
"""

import math
from typing import Any, Callable, Dict, Iterable, List, Optional, Tuple

from .accelerator import CORE
from .graph import slope_or_zero, slopes_or_zeros
from .operations import AFFINE, SOURCE
from .sources import Source
from .tracked import TRACKED, new, resolve

LIMIT = 8192
"""The size at which a value's expression is shortened."""

NUMBERS = (float, int)
WORTH_FOLDING = 8
"""Expressions up to this size stay as they were written where a larger one is shortened."""

MAX_FAST_FOLD = 64
"""The most operations that are passed in one go."""

MAX_VISITS = 8
"""The most visits of a node, on average, while parts of an expression are folded."""


class Shortening:
    """Settings for shortening long expressions.

    Attributes:
        is_hasty: linearize a long expression as a whole if it is not affine. The default keeps its affine parts exact,
            which takes several times as long.
    """

    def __init__(self) -> None:
        self.is_hasty = False


#: The settings of this process.
SHORTENING = Shortening()

Node = Tuple[Any, tuple]
"""A tracked value and the record that is used for it."""


def folded(value: Any) -> tuple:
    """The record `(AFFINE, ((leaf, slope), ...), is_exact)` that stands for a value near its present one.

    It is exact where the value is affine in its sources, else a linearization. A value remembers its own, so that one
    which has grown by a step since costs that step only.
    """
    fold = getattr(value, '_fold', None)
    if fold is None:
        fold = _folded_if_short(value) or _fold_below(value)
        value._fold = fold
    return fold


def _folded_if_short(value: Any) -> Optional[tuple]:
    """The record for a value that few operations made, all of them affine: as `_fold_of` gives it; None for any
    other value. Without it, `affine` of a sum of three terms over two sources takes 4 times as long.

    On the way down to the sources, the slopes are multiplied. What several ways lead to is passed several times.
    """
    terms: Dict[Source, Tuple[Any, Any]] = {}
    others: List[Tuple[Any, Any]] = []
    node, rise = value, 1
    try:
        for _ in range(MAX_FAST_FOLD):
            form, first, second = resolve(node)
            if form is SOURCE:
                record: Optional[tuple] = (AFFINE, ((node, 1),), type(node._plain) in NUMBERS)
            elif form is AFFINE:
                record = form, first, second
            else:
                record = getattr(node, '_fold', None)
            if record is None:
                if not form.affine or form.operation is None:
                    return None
                if form.single_operand:
                    rise *= form.slope(first._plain, second)
                else:
                    others.append((second, rise * form.slope[1](first._plain, second._plain)))
                    rise *= form.slope[0](first._plain, second._plain)
                node = first
                continue
            if not (rise and record[2]):
                return None
            for leaf, slope in record[1]:
                source = leaf._record[1]
                slope = slope * rise
                if source in terms:
                    known, part = terms[source]
                    slope += part
                    if known._plain != leaf._plain:
                        return None
                    leaf = known
                if slope - slope != 0:
                    return None
                terms[source] = leaf, slope
            if not others:
                return AFFINE, tuple(terms.values()), True
            node, rise = others.pop()
    except ArithmeticError:
        pass
    return None


def _remembered(node: Any) -> tuple:
    """The fold of a value that has one already, else its record."""
    return getattr(node, '_fold', None) or resolve(node)


def _exactly_remembered(node: Any) -> tuple:
    """The record of a value, replaced by its fold where that is known and means the same."""
    fold = getattr(node, '_fold', None)
    if fold is not None and fold[2] and node._size > WORTH_FOLDING:
        _replace(node, fold)
    return resolve(node)


def _nodes_below(value: Any, record_of: Callable[[Any], tuple]) -> List[Node]:
    """List the nodes of a value's expression with their records, each once, operands before their users."""
    found: List[Node] = []
    seen = set()
    stack: List[Tuple[Any, Optional[tuple]]] = [(value, None)]
    while stack:
        node, record = stack.pop()
        if record is not None:
            found.append((node, record))
            continue
        if id(node) in seen:
            continue
        seen.add(id(node))
        record = record_of(node)
        stack.append((node, record))
        form, first, second = record
        if form.single_operand:
            stack.append((first, None))
        else:
            stack.extend([(operand, None) for operand in reversed(form.operands(first, second))])
    return found


def _fold_below(value: Any) -> tuple:
    """The fold of a value that has none, made of those that are remembered below it."""
    swept = CORE.swept(value) if CORE is not None else NotImplemented
    if swept is NotImplemented:
        return _fold_of(_nodes_below(value, _remembered))
    leaves, exact = swept
    terms, can_merge = _merged(leaves)
    return AFFINE, terms, exact and can_merge


def _fold_of(nodes: List[Node]) -> tuple:
    """The fold of the last of some nodes."""
    leaves, exact = _swept(nodes)
    terms, can_merge = _merged(leaves)
    return AFFINE, terms, exact and can_merge


def _swept(nodes: List[Node]) -> Tuple[List[Tuple[Any, Any]], bool]:
    """The slope of the last of some nodes for each source's value among them, by one sweep backwards, and whether these
    say exactly what it is."""
    weights: Dict[int, Any] = {id(nodes[-1][0]): 1}
    exact = True
    for node, record in reversed(nodes):
        form, first, second = record
        if form is SOURCE:
            exact = exact and _is_exact_leaf(node)
            continue
        weight = weights.pop(id(node))
        exact = exact and _is_exact(record)
        if form.single_operand:
            operands: Iterable[Any] = (first,)
            slopes: Iterable[Any] = (slope_or_zero(form.slope, first._plain, second),)
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
    return [(node, weights[id(node)]) for node, record in nodes if record[0] is SOURCE], exact


def _is_exact(record: tuple) -> bool:
    """Return True if the slopes at the present values describe a record exactly."""
    form, first, second = record
    if form is AFFINE:
        return bool(second)
    if form.single_operand:
        # A slope of 0 may stand for one that no float can hold.
        return form.affine and (second == 0 or slope_or_zero(form.slope, first._plain, second) != 0)
    return bool(form.affine)


def _merged(leaves: List[Tuple[Any, Any]]) -> Tuple[Tuple[Tuple[Any, Any], ...], bool]:
    """Terms with each source once, and whether they mean the same as the leaves given."""
    terms: Dict[Source, Tuple[Any, Any]] = {}
    exact = True
    for leaf, slope in leaves:
        source = leaf._record[1]
        if source in terms:
            known, part = terms[source]
            slope += part
            if known._plain != leaf._plain:
                # The source changed between two readings. All that counts is the sum of both terms: it has both
                # slopes, from the mean of the two values, as far as there is one.
                mean = known._plain + (leaf._plain - known._plain) * (slope - part) / slope if slope else math.inf
                exact = exact and isinstance(mean, type(known._plain)) and math.isfinite(mean)
                known = new(mean, known._record, 1) if exact else known
            leaf = known
        terms[source] = leaf, slope
    return tuple(terms.values()), exact


def affine(x: Any) -> Optional[Tuple[Tuple[Source, Any, Any], ...]]:
    """The terms of a value that is affine in its sources.

    Returns:
        `((Source, source's value, slope), ...)` in order of first appearance, so that the value for other source
        values is its present one plus the sum of each slope times its source's change; None where it is not
        affine (texts and bools are not); `()` for an untracked value.
    """
    if type(x) not in TRACKED:
        return ()
    form, first, _ = resolve(x)
    if form is SOURCE:
        return ((first, x._plain, 1),) if type(x._plain) in NUMBERS else None
    if _is_curved(x):
        return None
    _, terms, exact = folded(x)
    return tuple([(leaf._record[1], leaf._plain, slope) for leaf, slope in terms]) if exact else None


affine_of_python = affine
if CORE is not None:
    affine = CORE.affine


def _is_curved(value: Any) -> bool:
    """Return True if a value's last few operations show that it is not affine. Folding would find this out late."""
    node = value
    for _ in range(MAX_FAST_FOLD):
        form, first, second = node._record
        if form.operation is None:
            return False
        if not form.affine:
            return True
        if not form.single_operand and second._record[0].operation is not None and not second._record[0].affine:
            return True
        node = first
    return False


def shorten(value: Any) -> None:
    """Keep a value's expression within the limit: fold what is affine, linearize it where that is not enough."""
    fold = _fold_below(value)
    if not (fold[2] or SHORTENING.is_hasty):
        _fold_exact_parts(_nodes_below(value, _exactly_remembered))
        size = len(_nodes_below(value, resolve))
        if size <= LIMIT // 2:
            value._fold = fold
            value._size = size
            return
    _replace(value, fold)


def _replace(value: Any, fold: tuple) -> None:
    """Replace a value's record with its fold."""
    value._record = value._fold = fold
    # A fold of many terms is made again only after as many operations: otherwise every operation would cost all terms.
    terms = len(fold[1])
    value._size = min(terms + 1, LIMIT - terms)


def _fold_exact_parts(nodes: List[Node]) -> None:
    """Let folds stand for those operands that are affine in their sources and not so small.

    It ends early where the parts overlap so much that folding each takes long; what is then too large is linearized.
    """
    exact: Dict[int, bool] = {}
    parts: List[Any] = []
    for node, record in nodes:
        form, first, second = record
        operands = form.operands(first, second)
        exact[id(node)] = _is_exact_leaf(node) if form is SOURCE else _is_exact(record)
        exact[id(node)] = exact[id(node)] and all(exact[id(operand)] for operand in operands)
        if not exact[id(node)]:
            parts.extend([operand for operand in operands if exact[id(operand)]])
    # The last part is mostly what goes on growing; the others build on each other from the first one on.
    visits = MAX_VISITS * len(nodes)
    for part in parts[-1:] + parts[:-1]:
        if visits > 0 and part._size > WORTH_FOLDING and part._record[0] is not AFFINE:
            below = _nodes_below(part, _remembered)
            fold = _fold_of(below)
            visits -= len(below)
            if fold[2]:
                _replace(part, fold)


def _is_exact_leaf(node: Any) -> bool:
    """Return True for a source that is a number."""
    return type(node._plain) in NUMBERS
