"""Folding: the affine part of an expression as coefficients per source, and the limit on growth.

A value that is updated in a loop, `x = x + v * dt`, must not grow for ever. Once an expression passes
`tracked.LIMIT`, what is affine in its sources is folded into one record, which means exactly the same; if that is not
enough, the rest is replaced by its linearization at the present values, which `explain` marks as such.
"""

import math
from typing import Any, Dict, List, Optional, Tuple

from .graph import Graph, slope_or_zero
from .operations import AFFINE, SOURCE
from .sources import Source
from .tracked import LIMIT, TRACKED, make, resolve

NUMBERS = (float, int)
WORTH_FOLDING = 8
"""Expressions up to this size stay as they were written where a larger one is shortened."""

MAX_FAST_FOLD = 64
"""The most operations that are passed in one go."""

Fold = Tuple[Dict[Source, Tuple[Any, Any]], bool]
"""The terms of a value, `{Source: (leaf, slope)}`, and whether they are exact."""


def folded(value: Any) -> tuple:
    """The record `(AFFINE, ((leaf, slope), ...), is_exact)` that stands for a value near its present one.

    It is exact where the value is affine in its sources, else a linearization. Results that two tracked operands
    made remember theirs, so that a value which has grown by a step since costs that step only.
    """
    fold = getattr(value, '_fold', None)
    if fold is None:
        fold = _folded_if_short(value)
        if fold is None:
            _fold_all(value)
            return value._fold
        value._fold = fold
    return fold


def _folded_if_short(value: Any) -> Optional[tuple]:
    """The record for a value that few operations made, all of them affine: as `_fold_all` gives it, in a part of the
    time; None for any other value.

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
                if not form.affine:
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


def _fold_all(value: Any) -> List[Tuple[Any, Fold]]:
    """Fold a value and all that it is made of, down to what is remembered; each with its fold."""
    folds: Dict[int, Fold] = {}
    done: List[Tuple[Any, Fold]] = []
    stack = [value]
    while stack:
        node = stack[-1]
        if id(node) in folds:
            stack.pop()
            continue
        form, first, second = resolve(node)
        remembered = (form, first, second) if form is AFFINE else getattr(node, '_fold', None)
        if remembered is not None:
            _, terms, exact = remembered
            fold = {leaf._record[1]: (leaf, slope) for leaf, slope in terms}, exact
        elif form is SOURCE:
            fold = {first: (node, 1)}, type(node._plain) in NUMBERS
        elif form.single_operand:
            if id(first) not in folds:
                stack.append(first)
                continue
            fold = _with_constant(folds[id(first)], form, first, second)
        else:
            missing = [operand for operand in (second, first) if id(operand) not in folds]
            if missing:
                stack.extend(missing)
                continue
            fold = _joined(folds[id(first)], folds[id(second)], form, first, second)
            node._fold = _record(fold)
        folds[id(node)] = fold
        done.append((node, fold))
        stack.pop()
    value._fold = _record(folds[id(value)])
    return done


def _record(fold: Fold) -> tuple:
    return AFFINE, tuple(fold[0].values()), fold[1]


def _scaled(fold: Fold, rise: Any) -> Fold:
    """A fold times a slope; a term that no float holds is dropped, and the rest is not exact."""
    terms, exact = fold
    if rise == 1:
        return dict(terms), exact
    scaled = {}
    for source, (leaf, slope) in terms.items():
        try:
            slope = slope * rise
        except OverflowError:
            slope = math.inf
        finite = slope - slope == 0
        scaled[source] = leaf, slope if finite else 0
        exact = exact and finite
    return scaled, exact


def _with_constant(fold: Fold, form: Any, first: Any, second: Any) -> Fold:
    """The fold of an operation on a tracked value and a constant."""
    rise = slope_or_zero(form.slope, first._plain, second)
    terms, exact = _scaled(fold, rise)
    return terms, exact and form.affine and (rise != 0 or second == 0)


def _joined(left: Fold, right: Fold, form: Any, first: Any, second: Any) -> Fold:
    """The fold of an operation on two tracked values."""
    total, exact = _scaled(left, slope_or_zero(form.slope[0], first._plain, second._plain))
    others, also_exact = _scaled(right, slope_or_zero(form.slope[1], first._plain, second._plain))
    exact = exact and also_exact and form.affine
    for source, (leaf, slope) in others.items():
        if source in total:
            known, part = total[source]
            slope += part
            if known._plain != leaf._plain:
                # The source changed between two readings. All that counts is the sum of both terms: it has both
                # slopes, from the mean of the two values, as far as there is one.
                mean = known._plain + (leaf._plain - known._plain) * (slope - part) / slope if slope else math.inf
                exact = exact and isinstance(mean, type(known._plain)) and math.isfinite(mean)
                known = make(mean, known._record, 1) if exact else known
            leaf = known
        total[source] = leaf, slope
    return total, exact


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


def _is_curved(value: Any) -> bool:
    """Whether the operations nearest a value show already that it is not affine, which folding it would find out late."""
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
    done = _fold_all(value)
    if not value._fold[2]:
        folds = {id(node): fold for node, fold in done}
        for node, (_, exact) in done:
            form, first, second = node._record
            if not exact and form.operation is not None:
                _replace(first, folds)
                if not form.single_operand:
                    _replace(second, folds)
        size = len(Graph([value]).nodes)
        if size <= LIMIT // 2:
            value._size = size
            return
    value._record = value._fold
    value._size = len(value._record[1]) + 1


def _replace(operand: Any, folds: Dict[int, Fold]) -> None:
    """Let the exact fold of an operand that is not so small stand for it."""
    fold = folds.get(id(operand))
    if fold and fold[1] and operand._size > WORTH_FOLDING:
        operand._record = _record(fold)
        operand._size = len(fold[0]) + 1
