"""Any ROS parameter as a source: what `rosslt.get_param` reads.

The parameter itself is the truth here. A dict on the parameter server is a tree of parameters of their own; a
list is one parameter, so that a change of one element writes the whole list. The type is what the parameter
says: a number that somebody sets from 1 to 1.5 was an int and is a float.
"""

from typing import Any, Callable, ContextManager, Dict, List, Optional, Protocol, Tuple, Union

import rospy

from rosslt import values
from rosslt.node.access import Access
from rosslt.node.call_sites import CallSite
from rosslt.node.json_scalars import Refused
from rosslt.node.locations import Location, Locations, ParameterLocation
from rosslt.node.parameters import Parameter, ParameterMirror, default_key

_Read = Callable[[], Any]


class Owner(Protocol):
    """What is used of this node as the owner of locations; `server.Owner` is it."""

    locations: Locations
    mirror: ParameterMirror
    access: Access

    @property
    def lock(self) -> ContextManager[Any]: ...

    def applied(self, changes: List[Tuple[Location, Any, Any]], requester: str) -> None: ...


class ParameterTrees:
    """The parameters that this node reads as sources, each once, however often and from wherever it is read.

    Args:
        owner: this node as the owner of locations.
    """

    def __init__(self, owner: Owner) -> None:
        self._owner = owner
        self._by_key: Dict[str, Union[Branch, Leaf]] = {}

    def at(self, key: str, site: CallSite, value: Any) -> Union['Branch', 'Leaf']:
        """What reads the parameter of that full name.

        Args:
            site: the call that asks for it, the place of the locations in it.
            value: what the parameter says.
        """
        kind = Branch if isinstance(value, dict) else Leaf
        known = self._by_key.get(key)
        if known is not None and type(known) is kind:
            return known
        if known is not None or self.are_met_by(key, value):
            self.drop(key)
        made = self._by_key[key] = kind(self, self._owner, key, site, value)
        self._owner.mirror.add(made)
        return made

    def are_met_by(self, key: str, value: Any) -> bool:
        """Whether a parameter of that value cannot be there beside others that were read: one of them would have to be
        a dict, and is none."""
        return self._owner.locations.conflicting_location(key, isinstance(value, dict)) is not None

    def drop(self, key: str) -> None:
        """Forget what reads a parameter that has become a dict, or is none any more, and what reads those above and
        below it: whoever asks for them next reads them anew."""
        with self._owner.lock:
            for name, known in list(self._by_key.items()):
                if name == key or name.startswith(key + '/') or key.startswith(name + '/'):
                    del self._by_key[name]
                    self._owner.mirror.remove(known)
                    if isinstance(known, Leaf):
                        known.forget()

    def get(self, key: str) -> Optional[Union['Branch', 'Leaf']]:
        """What reads the parameter of that full name, None where nobody has asked for it yet."""
        return self._by_key.get(key)


class Default:
    """What a call reads of a parameter that is not set, where an earlier call had another default."""

    as_float = False

    def __init__(self, value: Any) -> None:
        self._value = value

    def read(self) -> Any:
        return self._value

    def make_float(self) -> None:
        self._value = _floats(self._value)


def warn_of_int(key: str, site: CallSite, value: Any, default: Tuple[Any, ...]) -> None:
    """Warn of a parameter that is an int where the call has a float as its default."""
    if type(value) is int and default and type(values.untracked(default[0])) is float:
        rospy.logwarn(
            '%s: the parameter %s is the int %r, though its default is a float: it takes no fractions, and '
            '0.5 * n is not tracked. Write %r in the parameter, or get_param(..., as_float=True)',
            site.place,
            key,
            value,
            float(value),
        )


def unless_deleted(known: Union['Branch', 'Leaf'], default: Tuple[Any, ...]) -> Union['Branch', 'Leaf', Default]:
    """What a call reads of a parameter that another one has asked for before, or that has been deleted since.

    Args:
        known: what reads the parameter.
        default: that of the call, if it has one.

    Raises:
        KeyError: the parameter is not set, and there is no default.
    """
    if known.is_set:
        return known
    if not default:
        raise KeyError(known.key)
    value = values.untracked(default[0])
    is_same = type(value) is type(known.value()) and value == known.value()
    return known if is_same else Default(default[0])


class Branch(Parameter):
    """A parameter that is a dict; each of its parts is a parameter of its own."""

    def __init__(self, trees: ParameterTrees, owner: Owner, key: str, site: CallSite, value: Any) -> None:
        super().__init__(key)
        self.as_float = False
        self._trees = trees
        self._owner = owner
        self._site = site
        self._put(value)

    def make_float(self) -> None:
        """Take each int in it for a float from now on."""
        self.as_float = True
        for part in self._parts.values():
            part.make_float()

    def note_default(self, default: Any, is_set: bool = False) -> None:
        """Note that it was read as the default in the code, by an earlier run where it is set."""
        self.is_set = is_set

    def read(self) -> Any:
        """The current value, tracked."""
        return {name: part.read() for name, part in self._parts.items()}

    def value(self) -> Any:
        return {name: part.value() for name, part in self._parts.items()}

    def take(self, value: Any) -> None:
        # Its parts notice their own changes; here parts are added and removed.
        with self._owner.lock:
            if isinstance(value, dict):
                self._put(value)
            else:
                self._trees.drop(self.key)

    def _put(self, value: Dict[str, Any]) -> None:
        self._parts: Dict[str, Union[Branch, Leaf]] = {
            name: self._trees.at('{}/{}'.format(self.key, name), self._site, part) for name, part in value.items()
        }
        if self.as_float:
            self.make_float()


class Leaf(Parameter):
    """A parameter that is no dict: a scalar, or a list of anything. Its scalars are locations."""

    is_kept = True

    def __init__(self, trees: ParameterTrees, owner: Owner, key: str, site: CallSite, value: Any) -> None:
        super().__init__(key)
        self.as_float = False
        self._trees = trees
        self._owner = owner
        self._site = site
        self._read: _Read
        self._plain: _Read
        self._locations: Dict[str, ParameterLocation] = {}
        self._put(value)

    def read(self) -> Any:
        """The current value, tracked."""
        return self._read()

    def value(self) -> Any:
        return self._plain()

    def note_default(self, default: Any, is_set: bool = False) -> None:
        """Note that it was read as the default in the code, by an earlier run where it is set.

        Args:
            default: what the code says.
        """
        self.is_set = is_set
        location = self._locations.get(self.key)
        if location is not None:
            location.default = values.plain_scalar(default)

    @property
    def records(self) -> List[Tuple[str, Any]]:
        location = self._locations.get(self.key)
        if location is None or location.default is None:
            return []
        return [(default_key(rospy.get_name(), self.key), [location.default, location.value])]

    def make_float(self) -> None:
        """Take each int in it for a float from now on."""
        self.as_float = True
        self._put(_floats(self.value()))

    def take(self, value: Any) -> None:
        if self.as_float:
            value = _floats(value)
        with self._owner.lock:
            if type(value) is not type(self.value()) or value != self.value():
                for name in self._locations or [self.key]:
                    self._owner.access.check(name, 'parameter server')
                if isinstance(value, dict) or (not self._locations and self._trees.are_met_by(self.key, value)):
                    self._trees.drop(self.key)
                    return
                before = self.value()
                try:
                    self._put(value)
                except ValueError as error:
                    self._put(before)
                    raise Refused(str(error)) from None

    def forget(self) -> Dict[str, ParameterLocation]:
        """Have no locations any more; returns those that it had."""
        before, self._locations = self._locations, {}
        for location in before.values():
            self._owner.locations.remove(location)
        return before

    def _put(self, value: Any) -> None:
        """Make `value` the one in force; locations that it no longer contains are dropped."""
        before = self.forget()
        self._read, self._plain = self._readers(self.key, value, before)

    def _readers(self, name: str, value: Any, before: Dict[str, ParameterLocation]) -> Tuple[_Read, _Read]:
        """The functions that read a part tracked and plain."""
        if isinstance(value, list):
            parts = [self._readers('{}/{}'.format(name, index), part, before) for index, part in enumerate(value)]
            return (lambda: [read() for read, _ in parts]), (lambda: [plain() for _, plain in parts])
        if isinstance(value, dict):
            branches = {key: self._readers('{}/{}'.format(name, key), part, before) for key, part in value.items()}
            return (lambda: {key: read() for key, (read, _) in branches.items()}), (
                lambda: {key: plain() for key, (_, plain) in branches.items()}
            )
        plain = values.plain_scalar(value)
        if plain is None:
            return (lambda: value), (lambda: value)
        location = before.get(name)
        if location is None:
            location = ParameterLocation(name, name, self._site, plain)
            location.parameter = self
            self._owner.locations.add(location)
        else:
            self._owner.locations.add(location)
            old = location.value
            location.retype(plain)
            self._owner.applied([(location, old, location.value)], 'parameter server')
        self._locations[name] = location
        return (lambda: location.tracked), (lambda: location.value)


def _floats(value: Any) -> Any:
    """A parameter's value with a float in the place of each int."""
    if isinstance(value, list):
        return [_floats(part) for part in value]
    if isinstance(value, dict):
        return {name: _floats(part) for name, part in value.items()}
    return float(value) if type(value) is int else value
