"""Which numbers come from which sources, of all things on a screen or in a message: what others come from as well."""

import ctypes
from typing import Any, Dict, List, Sequence, Set, Tuple

from rosslt import values
from rosslt.values import Source


class Shared(List[Set[Source]]):
    """For each number of a thing, those of its sources that move numbers of other things as well, each of which comes
    from something else besides or instead: what others come from.

    Attributes:
        alike: the sources of those numbers that are one of several: another thing has a number from just the same
            sources with another value, as `X0 + i * STEP`. None of these sources is more a thing's own than another.
    """

    def __init__(self) -> None:
        super().__init__()
        self.alike: Set[Source] = set()


class Uses:
    """The sources of the numbers of things."""

    def __init__(self) -> None:
        self._numbers: Dict[str, Sequence[Any]] = {}  # of a thing, by its name
        self._sources: Dict[str, List[List[Source]]] = {}  # of each of these
        self._users: Dict[Source, Set[Tuple[str, int]]] = {}  # (name of a thing, index of its number)

    def put(self, name: str, numbers: Sequence[Any]) -> bool:
        """A thing has these numbers now; return whether they come from other sources than before."""
        sources = [values.sources(number) for number in numbers]
        if self._sources.get(name) == sources:
            self._numbers[name] = numbers
            return False
        self.drop(name)
        self._numbers[name], self._sources[name] = numbers, sources
        for index, found in enumerate(sources):
            for source in found:
                self._users.setdefault(source, set()).add((name, index))
        return True

    def drop(self, name: str) -> None:
        """A thing is there no more."""
        self._numbers.pop(name, None)
        for index, found in enumerate(self._sources.pop(name, [])):
            for source in found:
                self._users[source].discard((name, index))
                if not self._users[source]:
                    del self._users[source]

    def shared(self, name: str, numbers: Sequence[Any]) -> Shared:
        """For each number of a thing, those of its sources that move something else as well: numbers of other things
        come from them, and not from all that this number comes from, as the same number shown twice would. Those from
        just the same sources are told apart by their values, in `Shared.alike`."""
        own = {(name, index) for index in range(len(numbers))}
        sources = [values.sources(number) for number in numbers]
        found = Shared()
        for mine in sources:
            users = {source: self._users.get(source, set()) for source in mine}
            alike = set.intersection(*sorted(users.values(), key=len)) - own if users else set()
            found.append({source for source, using in users.items() if len(using) - len(own & using) > len(alike)})
            if not found.alike.issuperset(mine):
                shown = [number for number, others in zip(numbers, sources) if set(others) == set(mine)]
                if any(self._is_another(*user, mine, shown) for user in alike):
                    found.alike.update(mine)
        return found

    def _is_another(self, name: str, index: int, sources: Sequence[Source], shown: Sequence[Any]) -> bool:
        """Return whether a number, which comes from all of some sources, comes from no others and is none of those that
        are shown."""
        if len(self._sources[name][index]) > len(sources):
            return False
        number = self._numbers[name][index]
        return number not in shown and not any(
            _is_same(values.untracked(number), values.untracked(one)) for one in shown
        )


def _is_same(one: Any, other: Any) -> bool:
    """Return whether two numbers are equal, or would be if one was not carried in 32 bits."""
    if values.is_same(one, other):
        return True
    are_floats = isinstance(one, float) and isinstance(other, float)
    return are_floats and (ctypes.c_float(one).value == other or ctypes.c_float(other).value == one)
