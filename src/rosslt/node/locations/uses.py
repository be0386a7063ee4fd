"""Notes the sources of all numbers on a screen or in a message, to tell which sources several things share."""

import ctypes
import re
from typing import Any, Dict, List, Sequence, Set, Tuple

from rosslt import messages, values
from rosslt.values import Source

#: The types of parts of messages that say where something is; vectors do so, or how large it is, in some types only.
PLACES = ('geometry_msgs/Point', 'geometry_msgs/Point32', 'geometry_msgs/Quaternion')
VECTOR, VECTORS_IN = 'geometry_msgs/Vector3', ('geometry_msgs/Transform', 'visualization_msgs/Marker')

#: The types whose position and turn are one thing.
POSES = ('geometry_msgs/Pose', 'geometry_msgs/Transform')

_INDEX = re.compile(r'\[\d+\]')


class Shared(List[Set[Source]]):
    """The shared sources of each number of a thing: those that move numbers of other things as well, each of which
    comes from something else besides or instead.

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
        self._wholes: Dict[str, str] = {}  # of a thing: what it is a part of, by default itself

    def put(self, name: str, numbers: Sequence[Any], whole: str = '') -> bool:
        """A thing has these numbers now; return whether they come from other sources than before.

        Args:
            whole: the name of what it is a part of, if that moves as one: its parts are no others of each other.
        """
        sources = [values.sources(number) for number in numbers]
        if self._sources.get(name) == sources:
            self._numbers[name] = numbers
            return False
        self.drop(name)
        self._numbers[name], self._sources[name], self._wholes[name] = numbers, sources, whole or name
        for index, found in enumerate(sources):
            for source in found:
                self._users.setdefault(source, set()).add((name, index))
        return True

    def drop(self, name: str) -> None:
        """A thing is there no more."""
        self._numbers.pop(name, None)
        self._wholes.pop(name, None)
        for index, found in enumerate(self._sources.pop(name, [])):
            for source in found:
                self._users[source].discard((name, index))
                if not self._users[source]:
                    del self._users[source]

    def shared(self, name: str, numbers: Sequence[Any]) -> Shared:
        """For each number of a thing, those of its sources that move something else as well: numbers of other things
        come from them, and not from all that this number comes from, as the same number shown twice would. Those from
        just the same sources are told apart by their values, in `Shared.alike`."""
        whole = self._wholes.get(name, name)
        sources = [values.sources(number) for number in numbers]
        found = Shared()
        for mine in sources:
            users = {
                source: {user for user in self._users.get(source, ()) if self._wholes[user[0]] != whole}
                for source in mine
            }
            alike = set.intersection(*sorted(users.values(), key=len)) if users else set()
            found.append({source for source, using in users.items() if len(using) > len(alike)})
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


def tracked_of_thing(message: messages.Message, path: str) -> List[Any]:
    """The tracked numbers of what a field is a part of: all coordinates of a point, whichever of them is meant."""
    part, _ = messages.part_at(message, _thing_at(message, path))
    return [leaf for _, leaf in values.leaves(part) if values.is_tracked(leaf)]


def shared_in(message: messages.Message, path: str) -> Shared:
    """Of each of the numbers that `tracked_of_thing` gives, the sources that move others of its kind as well, as of
    `Uses.shared`: those at the same place in other elements of an array of the message; and of what says where or how
    large something is, all others that say so of other things."""
    thing, uses, types = _thing_at(message, path).strip('/').replace('/', '.'), Uses(), _PartTypes(message)
    outer = _outer(thing)
    whole = outer if thing and types.of(outer) in POSES else thing
    kind, is_placed = _INDEX.sub('', thing), False
    others = []
    for where, leaf in values.leaves(message) if thing else ():
        if not values.is_tracked(leaf):
            continue
        if _is_in(where, thing):
            is_placed = is_placed or types.is_place(_outer(where))
        elif not _is_in(where, whole):
            others.append((where, leaf))
    for where, leaf in others:
        is_alike = kind != thing and _INDEX.sub('', where).startswith(kind + '.')
        if is_alike or (is_placed and types.is_place(_outer(where))):
            uses.put(where, [leaf])
    return uses.shared(thing, tracked_of_thing(message, path))


class _PartTypes:
    """The types of the parts of a message, each looked up once for all elements of an array."""

    def __init__(self, message: messages.Message) -> None:
        self._message = message
        self._types: Dict[str, str] = {}

    def of(self, path: str) -> str:
        place = _INDEX.sub('', path)
        if place not in self._types:
            self._types[place] = messages.part_at(self._message, path)[1]
        return self._types[place]

    def is_place(self, path: str) -> bool:
        """Return whether a part says where something is or how large it is."""
        return self.of(path) in PLACES or (self.of(path) == VECTOR and self.of(_outer(path)) in VECTORS_IN)


def _outer(path: str) -> str:
    return path.rpartition('.')[0]


def _is_in(where: str, part: str) -> bool:
    return where == part or where.startswith((part + '.', part + '['))


def _thing_at(message: messages.Message, path: str) -> str:
    part, _ = messages.part_at(message, path)
    is_number = isinstance(values.untracked(part), (int, float, str))
    return re.sub(r'[./]?\w+/?$|\[\d+\]/?$', '', path) if is_number else path
