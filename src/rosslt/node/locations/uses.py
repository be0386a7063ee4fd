"""Which numbers come from which sources, of all things on a screen or in a message: what others come from as well."""

from typing import Any, Dict, List, Sequence, Set, Tuple

from rosslt import values
from rosslt.values import Source


class Uses:
    """The sources of the numbers of things."""

    def __init__(self) -> None:
        self._sources: Dict[str, List[List[Source]]] = {}  # of each number of a thing, by the name of the thing
        self._users: Dict[Source, Set[Tuple[str, int]]] = {}  # (name of a thing, index of its number)

    def put(self, name: str, numbers: Sequence[Any]) -> bool:
        """A thing has these numbers now; return whether they come from other sources than before."""
        sources = [values.sources(number) for number in numbers]
        if self._sources.get(name) == sources:
            return False
        self.drop(name)
        self._sources[name] = sources
        for index, found in enumerate(sources):
            for source in found:
                self._users.setdefault(source, set()).add((name, index))
        return True

    def drop(self, name: str) -> None:
        """A thing is there no more."""
        for index, found in enumerate(self._sources.pop(name, [])):
            for source in found:
                self._users[source].discard((name, index))
                if not self._users[source]:
                    del self._users[source]

    def shared(self, name: str, numbers: Sequence[Any]) -> List[Set[Source]]:
        """For each number of a thing, those of its sources that move something else as well: numbers of other things
        come from them, and not from all that this number comes from, as the same number shown twice would."""
        own = {(name, index) for index in range(len(numbers))}
        found = []
        for number in numbers:
            users = {source: self._users.get(source, set()) for source in values.sources(number)}
            alike = set.intersection(*sorted(users.values(), key=len)) if users else set()
            others = len(alike - own)
            found.append({source for source, using in users.items() if len(using) - len(own & using) > others})
        return found
