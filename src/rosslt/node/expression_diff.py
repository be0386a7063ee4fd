"""The difference between two expressions of a field: whether its node computes it in another way than before.

An expression shows which locations a node has used, what it has done to them, and the numbers in its code that are no
locations. Where a node takes another branch (`a if x < 5 else b`), some of them come and others go.
"""

from typing import Any, Callable, Dict, FrozenSet, List, NamedTuple, Tuple

from rosslt import values
from rosslt.values import AFFINE, CONSTANT, SOURCE, Source

#: Numbers that differ by less than this, relative to the size of what they are computed from, count as equal.
TOLERANCE = 1e-9

#: The maximal number of added or removed numbers that are named.
MOST_NAMED = 4


class Difference(NamedTuple):
    """The difference between two expressions.

    Attributes:
        gone, came: the sources that only the first one, or only the second one has.
        is_other_form: whether the operations are others.
        numbers: {index: (number before, number after)}, those that are no sources; empty where the form is another one.
    """

    gone: List[Source]
    came: List[Source]
    is_other_form: bool
    numbers: Dict[int, Tuple[Any, Any]]

    def is_branch(self, moving: FrozenSet[int] = frozenset()) -> bool:
        """Return whether it shows another branch.

        Args:
            moving: the indices of numbers that change by themselves from message to message.
        """
        return bool(self.gone or self.came or self.is_other_form or self.numbers.keys() - moving)

    def describe(self, name_of: Callable[[Source], str]) -> str:
        """The difference in words."""
        parts = [f'{name_of(one)} went' for one in self.gone] + [f'{name_of(one)} came' for one in self.came]
        parts += ['{} became {}'.format(*map(_short, pair)) for pair in list(self.numbers.values())[:MOST_NAMED]]
        return ', '.join(parts) or 'other operations'


class Expression:
    """The expression that computed a part of a message, without the values of its sources.

    Args:
        part: a scalar, a message or an array, with tracked leaves.
    """

    def __init__(self, part: Any) -> None:
        tracked = [leaf for _, leaf in values.leaves(part) if values.is_tracked(leaf)]
        instructions, roots = values.disassemble(tracked)
        self.sources: List[Source] = values.sources(tracked)
        #: {source: its values that were used}; of a counter or an integral several.
        self.readings: Dict[Source, List[Any]] = {}
        self._numbers: List[Tuple[Any, float]] = []  # (number, size of what it belongs to)
        form: List[Any] = [tuple(roots)]
        at: List[Any] = []  # the value of each source, by index
        for kind, *rest in instructions:
            at.append(rest[1] if kind == SOURCE else None)
            if kind == SOURCE:
                self.readings.setdefault(rest[0], []).append(rest[1])
                form.append((SOURCE, rest[0]))
            elif kind == CONSTANT:
                self._numbers.append((rest[0], 0.0))
                form.append(CONSTANT)
            elif kind == AFFINE:
                value, terms, is_exact = rest
                form.append((AFFINE, tuple(index for index, _ in terms), is_exact))
                if is_exact:
                    size = abs(value) + sum(abs(slope * at[index]) for index, slope in terms)
                    self._numbers += [(slope, 0.0) for _, slope in terms]
                    self._numbers.append((value - sum(slope * at[index] for index, slope in terms), size))
            else:
                form.append((kind.name, *rest))
        self._form = tuple(form)

    def difference(self, other: 'Expression') -> Difference:
        """The Difference from this expression to another one."""
        is_other = self._form != other._form
        numbers = {} if is_other else dict(enumerate(zip(self._numbers, other._numbers)))
        return Difference(
            [source for source in self.sources if source not in other.sources],
            [source for source in other.sources if source not in self.sources],
            is_other,
            {index: (old[0], new[0]) for index, (old, new) in numbers.items() if not _are_equal(old, new)},
        )


def _are_equal(old: Tuple[Any, float], new: Tuple[Any, float]) -> bool:
    (one, size), (other, other_size) = old, new
    if one == other:
        return True
    try:
        return bool(abs(one - other) <= TOLERANCE * max(abs(one), abs(other), size, other_size))
    except TypeError:
        return False


def _short(number: Any) -> str:
    return f'{number:.6g}' if isinstance(number, float) else repr(number)
