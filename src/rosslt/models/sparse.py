"""Few columns of a matrix that explain many outputs, by orthogonal matching pursuit."""

from typing import Any, List, Optional, Set, Tuple

import numpy as np

Array = Any


def propose(matrix: Array, moved: Array, floor: Array, forced: List[int]) -> Tuple[List[int], bool, Optional[int]]:
    """Columns that explain outputs: each output alone, and together those that are not explained alone.

    Args:
        matrix: the changes (trials, inputs)
        moved: how far the outputs moved (trials, outputs)
        floor: the length of what may be left of each output
        forced: columns that are known to count

    Returns:
        new columns that explain some outputs; whether all outputs are explained; else the likeliest column
    """
    new: Set[int] = set()
    left = []
    for each in range(moved.shape[1]):
        support, is_whole = pursue(matrix, moved[:, [each]], floor[[each]], forced)
        if is_whole:
            new.update(support[len(forced) :])
        else:
            left.append(each)
    if not left:
        return sorted(new), True, None
    support, is_whole = pursue(matrix, moved[:, left], floor[left], forced)
    added = support[len(forced) :]
    if is_whole:
        return sorted(new.union(added)), True, None
    return sorted(new), False, added[0] if added else None


def pursue(matrix: Array, moved: Array, floor: Array, forced: List[int]) -> Tuple[List[int], bool]:
    """Orthogonal matching pursuit: few columns whose combinations are `moved`, and whether they are up to `floor`.

    That some k of n columns leave a part e of q random outputs in T trials has a chance of about
    n**k * e**(q * (T - k)). Only what has a chance below 1e-3 counts.
    """
    support = list(forced)
    first: Optional[Array] = None
    lengths = np.linalg.norm(matrix, axis=0)
    while True:
        chosen = matrix[:, support]
        rest = moved - chosen @ np.linalg.lstsq(chosen, moved, rcond=None)[0] if support else moved
        sizes = np.linalg.norm(rest, axis=0)
        first = np.maximum(sizes, 1e-300) if first is None else first
        added, spare = len(support) - len(forced), len(matrix) - len(support)
        if np.all(sizes <= floor):
            gain = -spare * np.sum(np.log(np.maximum(sizes / first, 1e-16)))
            return support, added == 0 or bool(gain > added * np.log(matrix.shape[1]) + np.log(1e3))
        if len(support) - len(forced) >= 2 * (len(matrix) - len(forced)) // 3 or len(support) == matrix.shape[1]:
            return support, False
        rest = rest[:, sizes > floor] / sizes[sizes > floor]
        scores = np.sum((matrix.T @ rest) ** 2, axis=1) / lengths**2
        scores[support] = -1
        support.append(int(np.argmax(scores)))
