"""ROS parameters as sources: what `rosslt.get_param` reads.

The master has the truth. This node keeps one tree of what the master says of the parameters that it has read; each
number, text and truth value in it is a location, and its name is the path to it. A list is one parameter of the
master, so that a change of one element writes the whole list; a default that is a dict is written whole as well. The
type is what the parameter says: a number that somebody sets from 1 to 1.5 was an int and is a float.
"""

import json
import math
import operator
from types import FrameType
from typing import Any, Callable, Collection, Dict, Iterator, List, Sequence, Set, Tuple, Union

import rospy

from rosslt import files, values
from rosslt.messages import Scalar
from rosslt.node.change.owner_interface import Owner
from rosslt.node.json_scalars import Refused
from rosslt.node.locations.call_sites import CallSite, call_site
from rosslt.node.locations.location import Change, Defaults, ParameterLocation, put_in_force
from rosslt.node.locations.source_files import SOURCE_FILES
from rosslt.node.memory.remembered import MEMORY
from rosslt.node.parameters.mirror import Parameters
from rosslt.node.parameters.readers import REQUESTER, check_readers
from rosslt.node.parameters.robots import numbers_in, text_with
from rosslt.node.parameters.server import (
    Tree,
    as_sent,
    element_of,
    is_related,
    is_sent_alike,
    is_within,
    part_of,
    with_part,
)

#: Makes a location of the full name and the value of a scalar in a parameter.
Maker = Callable[[str, Scalar, Defaults], ParameterLocation]


class ReadParameters:
    """The parameters that this node reads as sources, however often and from wherever it reads them.

    Args:
        owner: this node as the owner of locations.
        parameters: the parameters of this node.
    """

    def __init__(self, owner: Owner, parameters: Parameters) -> None:
        self._owner, self._parameters = owner, parameters
        self._asked: Dict[str, CallSite] = {}  # by full name, the call that reads it
        self._defaults: Dict[str, Tree] = {}  # by full name, what the code says while it is not set
        self._default_sources: Dict[str, List[values.Source]] = {}  # by full name, what its first default came from
        self._polled: Set[str] = set()  # names that are read in the node's rounds
        self._floats: Set[str] = set()  # names below which an int is taken for a float
        self._known: Tree = {}  # what the master says, a tree from the root; never changed, but replaced
        self._said: Dict[str, Scalar] = {}  # the scalars in it and in the defaults in force, by name
        self._robots: Set[str] = set()  # full names of texts that are URDF: the numbers in them are the scalars
        self._makers: Dict[str, Maker] = {}  # by full name, what makes the locations in it that are others'
        self._made: Dict[str, ParameterLocation] = {}  # all that there ever were, by name
        self._present: Dict[str, ParameterLocation] = {}  # those of the scalars that there are now

    def read(self, key: str, where: Union[FrameType, CallSite], *default: Any, as_float: bool = False) -> Any:
        """The present value of a parameter, tracked.

        Args:
            key: its full name.
            where: the call that asks for it.
            default, as_float: as in `rosslt.get_param`.

        Raises:
            KeyError: the parameter is not set, and there is no default.
        """
        if key not in self._asked:
            self._ask(key, where, default)
        if MEMORY.has_begun and key not in self._polled:
            self._polled.add(key)
            for location in [one for name, one in self._present.items() if is_within(name, key)]:
                location.read_in_round()
        if as_float and key not in self._floats:
            self.take_fractions(key)
        value = part_of(self._known, key)
        if value is None:
            if not default:
                raise KeyError(key)
            value = default[0]
            is_source = key in self._defaults or self._take_default(key, where, value)
            if not is_source or not is_sent_alike(self._defaults[key], value):
                return _leafwise(key, value, self._as_read)
        return self._mapped(key, value, operator.attrgetter('tracked'))

    def own(self, key: str, site: CallSite, make: Maker, is_robot: bool = False) -> None:
        """Own the locations of a parameter that another process reads.

        Args:
            key: its full name.
            site: where it stands.
            make: makes a location of the full name and the value of a scalar in it, and these `Defaults`.
            is_robot: whether it is the text of a URDF, and the scalars in it are the numbers of that.
        """
        self._makers[key] = make
        if is_robot:
            self._robots.add(key)
        self._ask(key, site, ())

    def _ask(self, key: str, where: Union[FrameType, CallSite], default: Tuple[Any, ...]) -> None:
        """Read a parameter from the master, and follow it from now on."""
        with self._owner.lock:
            if key in self._asked:
                return
            site = where if isinstance(where, CallSite) else call_site(where)
            self._parameters.server.subscribe(key)
            value = self._parameters.read(key)
            self._asked[key] = site
            self._default_sources[key] = values.sources(default)
            self._take_in(key, value)
            if value is not None and default and self._was_default(key, value):
                self._take_default(key, site, default[0])

    def _take_default(self, key: str, where: Union[FrameType, CallSite], value: Tree) -> bool:
        """Note what the code says for a parameter, which is its value while it is not set; False if parameters that
        were read before stand in the way, or where no parameter can hold it."""
        with self._owner.lock:
            if part_of(self._known, key) is None and (
                is_within(self._parameters.namespace, key) or any(is_related(name, key) for name in self._present)
            ):
                return False
            plain = values.untracked(value)
            try:
                as_sent(plain)
            except Refused:
                return False
            site = self._asked[key] = where if isinstance(where, CallSite) else call_site(where)
            SOURCE_FILES.keep(site.file)
            self._defaults[key] = plain
            self._renew(self._known)
            for name, location in self._present.items():
                if is_within(name, key):
                    location.site = site
                    made_of = self._names_of(values.sources(element_of(value, name[len(key) :])))
                    if made_of:
                        location.unsaved = f'its default at {location.place} comes from {made_of}: set that as well'
            return True

    def _names_of(self, sources: Collection[values.Source]) -> str:
        """The names of locations of this node, as a part of a sentence."""
        found = [self._owner.locations.by_id.get(one.location_id) for one in sources if one.node == self._owner.name]
        return ' and '.join(location.name for location in found if location is not None)

    def take_fractions(self, key: str) -> None:
        """Take each int in a parameter for a float from now on."""
        with self._owner.lock:
            self._floats.add(key)
            self._renew(self._known)

    def _was_default(self, key: str, value: Tree) -> bool:
        """Return whether an earlier run set a parameter to that value because it had read the default in the code."""
        if not is_sent_alike(self._parameters.record_of_default(key)[1], [value]):
            return False
        try:
            # a launch file may have set it since
            return key not in json.loads(str(self._parameters.read(files.ORIGINS) or '{}'))
        except (TypeError, ValueError):  # what is there is not what `rosslt launch` writes
            return True

    def default_of(self, name: str) -> Tuple[Any, List[str]]:
        """Return the default that the code gives for a location (None if none), and its path in the call's argument."""
        for key, default in self._defaults.items():
            if is_within(name, key):
                return values.plain_scalar(element_of(default, name[len(key) :])), name[len(key) :].split('/')[1:]
        return None, []

    def set_for(self, source: values.Source) -> str:
        """The name of a parameter that is set, and whose default comes from a source; '' if there is none."""
        behind = (key for key, sources in self._default_sources.items() if source in sources)
        return next((key for key in behind if part_of(self._known, key) is not None), '')

    def reread(self, name: str, said: Scalar) -> None:
        """Take in what the code says of a location since it was edited."""
        for key, default in self._defaults.items():
            self._defaults[key] = _leafwise(key, default, lambda one, part: said if one == name else part)
        self._said = self._scalars(self._known)

    def learn(self, key: str) -> None:
        """Read again what stands at a key, above or below it, as it may have been set or deleted."""
        is_own = self._parameters.is_own
        with self._owner.lock:
            asked = [one for one in self._asked if is_own(one) or not is_own(key)]
            for part in {key if is_within(key, one) else one for one in asked if is_related(key, one)}:
                self._take_in(part, self._parameters.read(part))

    def follow(self, is_new_master: bool = False) -> None:
        """Subscribe to the parameters that were read, at a new master as well, and set those that it lacks."""
        with self._owner.lock:
            for key in list(self._asked):
                self._parameters.server.subscribe(key)
                known = part_of(self._known, key)
                if is_new_master and known is not None:
                    stands = self._parameters.read(key)
                    self._parameters.server.set(list(_lacking(key.rstrip('/'), self._in_force(key), stands)))
                self.learn(key)

    def _take_in(self, key: str, value: Tree) -> None:
        """Put the master's value of a parameter in force, None if it is not set. The lock is held."""
        known = with_part(self._known, key, value)
        said = self._scalars(known)
        try:
            changed = [
                location
                for name, location in self._present.items()
                if name not in said or (said[name] != location.value and not self._is_unwritten(location))
            ]
            for location in changed:
                self._owner.access.check(location.name, REQUESTER)
            self.check_other_readers(changed)
        except Refused as refused:
            rospy.logerr('rosparam set %s is refused, it is set back: %.500s', key, refused)
            unit = self._unit_of(key)
            self._parameters.server.set([(unit, self._in_force(unit))])
        else:
            self._renew(known)

    def check_other_readers(self, locations: Collection[ParameterLocation]) -> None:
        """Raises Refused if another node reads one of these parameters and does not let it be changed: it would set
        it back, and this node would follow."""
        if locations:
            check_readers(self._parameters.server, self._owner.name, {one.name: one.id for one in locations})

    def _is_unwritten(self, location: ParameterLocation) -> bool:
        """Return whether a location's change has not been sent to the master yet."""
        return bool(location.value != self._said.get(location.name))

    def _renew(self, known: Tree) -> None:
        """Make the locations match the parameters at the master, and the defaults. The lock is held."""
        unwritten = {name for name, location in self._present.items() if self._is_unwritten(location)}
        self._known, self._said = known, self._scalars(known)
        for name in [name for name in self._present if name not in self._said]:
            self._owner.locations.remove(self._present.pop(name))
        changes: List[Change] = []
        has_other_types = False
        for name, value in self._said.items():
            location = self._present.get(name)
            if location is None:
                self._add(name, value)
            elif name not in unwritten and (type(value) is not location.type or value != location.value):
                has_other_types = has_other_types or type(value) is not location.type
                changes.append((location, location.value, value))
        for key in self._asked:
            tree = part_of(known, key)
            for name, row in _rows(key, self._defaults.get(key) if tree is None else tree):
                if name in self._present:
                    self._present[name].row = row
        _put(changes)
        if self._owner.name:
            self._owner.applied([change for change in changes if change[1] != change[2]], REQUESTER)
            if has_other_types:
                self._owner.publish_locations()

    def _add(self, name: str, value: Scalar) -> None:
        """Return a location for a scalar, a new one or the former one."""
        location = self._made.get(name)
        if location is None:
            site = next(site for key, site in self._asked.items() if is_within(name, key))
            make = next((make for key, make in self._makers.items() if is_within(name, key)), None)
            location = make(name, value, self) if make else ParameterLocation(name, site, value, self)
            self._made[name] = location
            if any(is_within(name, key) for key in self._polled):
                location.read_in_round()
        else:
            _put([(location, location.value, value)])
        try:
            self._owner.locations.add(location)
        except ValueError as error:
            rospy.logwarn('the parameter %s is not a source: %s', name, error)
        else:
            self._present[name] = location

    def _scalars(self, known: Tree) -> Dict[str, Scalar]:
        """The plain values of all that are to be locations, by name."""
        found: Dict[str, Scalar] = {}
        _leafwise('', known, found.setdefault)
        for key in self._robots:
            # Somebody may have set it to a list or dict, whose scalars are no numbers of a robot.
            found = {name: value for name, value in found.items() if not is_within(name, key)}
            numbers = numbers_in(part_of(known, key))
            found.update((f'{key}/{name}', value) for name, value in numbers.items())
        for key, default in self._defaults.items():
            if part_of(known, key) is None:
                _leafwise(key, default, found.setdefault)
        plain = ((name, self._as_read(name, values.plain_scalar(value))) for name, value in found.items())
        return {name: value for name, value in plain if '//' not in name and _can_be_sent(value)}

    def _as_read(self, name: str, value: Scalar) -> Scalar:
        """A scalar; an int is converted to a float if a float was asked for."""
        is_float = type(value) is int and any(is_within(name, key) for key in self._floats)
        return float(value) if is_float else value

    def _mapped(self, key: str, value: Tree, read: Callable[[ParameterLocation], Any]) -> Any:
        """A parameter's value, each leaf of which is replaced by the value read from its location."""

        def part(name: str, leaf: Scalar) -> Any:
            location = self._present.get(name)
            return leaf if location is None else read(location)

        return _leafwise(key.rstrip('/'), value, part)

    def _in_force(self, key: str) -> Tree:
        """A parameter as it is to stand on the parameter server; None if there is nothing to be set."""
        known = part_of(self._known, key)
        value = self._defaults.get(key) if known is None else known
        if key in self._robots:
            return text_with(value, {one[len(key) + 1 :]: at.value for one, at in self._present.items()})
        return None if value is None else self._mapped(key, value, operator.attrgetter('value'))

    def write(self) -> List[Tuple[str, Tree]]:
        """Write what has changed here; returns the records of the defaults that it was read from."""
        with self._owner.lock:
            changed = [name for name, location in self._present.items() if self._is_unwritten(location)]
            units = dict.fromkeys(map(self._unit_of, changed))
        for key in units:
            self._write(key)
        defaults = [key for key in list(self._defaults) if any(is_within(name, key) for name in changed)]
        known = {key: part_of(self._known, key) for key in defaults}
        return [
            (self._parameters.record_of_default(key)[0], json.dumps([value], default=str))
            for key, value in known.items()
            if value is not None
        ]

    def _unit_of(self, name: str) -> str:
        """The parameter that is written whole if a location has changed."""
        unset = (key for key in self._defaults if is_within(name, key) and part_of(self._known, key) is None)
        return next(unset, '') or _unit(self._known, name)

    def _write(self, key: str) -> None:
        """Set a parameter to the values in force. If another process has set it since it was read, the changes of that
        process are taken in, and written again together with those made here."""
        expected = part_of(self._known, key)
        while True:
            with self._owner.lock:
                known = part_of(self._known, key)
                value = self._in_force(key)
                if value is None:  # it was deleted meanwhile
                    self.learn(key)
                    return
            wanted = as_sent(value)
            stood = self._parameters.server.exchange(key, wanted)
            with self._owner.lock:
                if part_of(self._known, key) is known and is_sent_alike(stood, expected):
                    self._known = with_part(self._known, key, wanted)
                    self._said = self._scalars(self._known)
                    return
                self._take_in(key, stood)
                expected = wanted


def _put(changes: Sequence[Change]) -> None:
    """Put the master's values in force. Results in the node's memory that cannot be computed from them stay."""
    try:
        put_in_force([(location, new) for location, _, new in changes])
    except Refused as refused:
        rospy.logerr('%s', refused)
        for location, _, new in changes:
            location.put(new)


def _unit(tree: Tree, name: str) -> str:
    """The name of the parameter of the master that holds a part: of a list, the list."""
    key = ''
    for step in filter(None, name.split('/')):
        if not isinstance(tree, dict) or step not in tree:
            break
        key, tree = f'{key}/{step}', tree[step]
    return key


def _lacking(key: str, value: Tree, stands: Tree) -> Iterator[Tuple[str, Tree]]:
    """The parameters of a tree that a second tree lacks: (full name, value)."""
    if stands is None:
        yield key, value
    elif isinstance(value, dict) and isinstance(stands, dict):
        for name, part in value.items():
            yield from _lacking(f'{key}/{name}', part, stands.get(name))


def _leafwise(name: str, value: Tree, function: Callable[[str, Any], Any]) -> Any:
    """Replace each leaf of a list or dict by a function of its name and value.

    Names with `//` in them are of keys that no parameter can have.
    """
    if isinstance(value, list):
        return [_leafwise(f'{name}/{index}', part, function) for index, part in enumerate(value)]
    if not isinstance(value, dict):
        return function(name, value)
    found = {}
    for key, part in value.items():
        is_name = isinstance(key, str) and key and '/' not in key
        found[key] = _leafwise(f'{name}/{key}' if is_name else f'{name}//{key}', part, function)
    return found


def _rows(name: str, value: Tree, row: str = '') -> Iterator[Tuple[str, str]]:
    """(name of a scalar, the row of a table that it is in); the row is '' if there is none.

    A table is a list or dict of several lists or dicts that are alike; of tables of tables, the inner ones count.
    """
    if not isinstance(value, (list, dict)):
        yield name, row
        return
    parts = list(value.items() if isinstance(value, dict) else enumerate(value))
    shapes = {_shape(part) for _, part in parts}
    is_table = len(parts) > 1 and len(shapes) == 1 and isinstance(parts[0][1], (list, dict))
    for number, (step, part) in enumerate(parts):
        yield from _rows(f'{name}/{step}', part, f'{name}[{number}]' if is_table else row)


def _shape(value: Tree) -> Tuple[Any, ...]:
    if isinstance(value, list):
        return tuple(map(_shape, value))
    if isinstance(value, dict):
        return tuple((key, _shape(part)) for key, part in sorted(value.items(), key=str))
    return (isinstance(value, (int, float)),)


def _can_be_sent(value: object) -> bool:
    """Return whether a value is a scalar that JSON can carry."""
    if type(value) is str:
        return value.isascii() or value == value.encode('utf-8', 'ignore').decode('utf-8')
    return type(value) in (int, bool) or (type(value) is float and math.isfinite(value))
