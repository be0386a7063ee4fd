"""Locations: the values of this node that can be changed from outside (the paper's `create_location`, section IV-A).

It has an identity that outlives a restart, a name, and a value; `parameters` has the ROS parameters behind it.
"""

import functools
import hashlib
import math
import threading
import weakref
from types import CodeType, FrameType
from typing import Any, Callable, Dict, List, Optional, Protocol, Sequence, Tuple, Type

from rosslt import files, values
from rosslt.messages import Scalar
from rosslt.node.json_scalars import Refused, to_json
from rosslt.node.locations.call_sites import CallSite
from rosslt.node.locations.mutex import CHANGE_LOCK
from rosslt.node.memory.remembered import MEMORY
from rosslt.node.parameters.server import as_sent


class Location:
    """A value of this node that can be changed; the base of all kinds of locations.

    Attributes:
        id: 48 bits, the same after a restart.
        name: below `<node>/rosslt/`; a full name if it is a parameter elsewhere.
        is_named: False if the code gives no name, and the name is made of file and line.
        literal: the value in the code, None if that is not a literal.
        site: the CallSite that created it.
        source: the location as a Source.
        type: `float`, `int`, `str` or `bool`.
        value: the plain value in force.
        tracked: the same, tracked.
        minimum, maximum: bounds, or None.
        sendable: the least and the greatest number that the fields hold which it is sent in as it is.
        read_only: True if no change is taken.
        weight: how hard it is to move, against 1.0 of others; None if nobody has said it.
        rank: how willingly it is changed if several locations could be: 0 first.
        row: the row of a table that it is in, its index in brackets at the end; '' if it is in none.
        row_holds_none: as of rosslt/Location.
        unsaved: why its value cannot be written where the code says it; '' if it can.
        remembered: True while the value in force is one that the parameter had when the node started.
        changed: called without arguments when a change of its value is in force.
        is_shared: True if several calls in the code give its name, each with a literal.
        turn: how often it has been changed.
    """

    __slots__ = (
        'id',
        'name',
        'is_named',
        'site',
        'source',
        'type',
        'minimum',
        'maximum',
        'sendable',
        'read_only',
        'weight',
        'remembered',
        'changed',
        'is_shared',
        'turn',
    )
    rank = 0
    row = ''
    row_holds_none = False
    unsaved = ''

    def __init__(
        self,
        identity: str,
        name: str,
        site: CallSite,
        value: Scalar,
        minimum: Optional[float] = None,
        maximum: Optional[float] = None,
        read_only: bool = False,
        weight: Optional[float] = None,
        changed: Tuple[Callable[[], None], ...] = (),
        is_named: bool = True,
    ) -> None:
        self.id = location_id(identity)
        self.name, self.site, self.is_named = name, site, is_named
        self.source: values.Source = values.UnnamedSource(self.id)
        self.type: Type[Any] = type(value)
        self.minimum, self.maximum, self.read_only, self.weight = minimum, maximum, read_only, weight
        self.sendable: Tuple[float, float] = -math.inf, math.inf
        self.remembered = False
        self.changed = changed
        self.is_shared = False
        self.turn = 0
        self.checked(value)

    @property
    def place(self) -> str:
        """Its position as people read it: `talker.py:12:9`."""
        return self.site.place

    @property
    def literal(self) -> Optional[Scalar]:
        return None

    @property
    def value_in_code(self) -> Optional[Scalar]:
        """The value that the code gives where it was read; None if it was not read there."""
        return self.literal

    def find_in(self, source: files.SourceText) -> Optional[int]:
        """The index of the literal in its file, as that was when it was loaded, that is its value; None if none
        is."""
        return None

    @property
    def value(self) -> Scalar:
        """The plain value in force.

        Raises:
            Refused: it has none, or one that cannot be sent.
        """
        raise NotImplementedError

    @property
    def tracked(self) -> Any:
        """The value in force, tracked."""
        return values.track(self.value, self.source)

    def name_node(self, node: str) -> None:
        """Set the node that owns it, known once `init_node` was called."""
        if isinstance(self.source, values.UnnamedSource):
            self.source.name_node(node)
        self.source = values.Source(node, self.id)

    def checked(self, value: object) -> Scalar:
        """Convert a value to the type of this location, after checking it.

        Raises:
            Refused: it is of another type, not finite, or out of bounds.
        """
        given, value = value, values.plain_scalar(value)
        # A float takes an int, and an int a float without a fraction, as YAML and JSON write them alike.
        if self.type in (float, int) and type(value) is int:
            try:
                as_float = float(value)  # also for an int: most results of arithmetic with it are floats
            except OverflowError:
                raise Refused(f'{value!r} is too large for a float') from None
            value = as_float if self.type is float else value
        elif self.type is int and type(value) is float and float.is_integer(value):
            value = int(value)
        if type(value) is not self.type:
            kind = self.type.__name__
            raise Refused(f'{self.name} is a{"n" if kind == "int" else ""} {kind}, and {given!r} is not')
        to_json(value)
        minimum, maximum = self.bounds
        if minimum is not None and value < minimum:
            raise Refused(f'{value!r} is below its minimum {minimum!r}')
        if maximum is not None and value > maximum:
            raise Refused(f'{value!r} is above its maximum {maximum!r}')
        return value

    @property
    def bounds(self) -> Tuple[Optional[float], Optional[float]]:
        """Its minimum and maximum, or None: those of the code, or those of the fields that it is sent in."""
        least, greatest = self.sendable
        if math.isinf(least):
            return self.minimum, self.maximum
        return (
            least if self.minimum is None else max(least, self.minimum),
            greatest if self.maximum is None else min(greatest, self.maximum),
        )

    def is_read_again(self) -> bool:
        """Return whether the node sees a change of it by itself, whatever it keeps of earlier values."""
        return True

    def read_in_round(self) -> None:
        """Note that the node reads it in its rounds, or in a callback: it does so again."""

    def reread(self, value_in_code: Scalar) -> None:
        """Take in the value in the code after an edit; the value in force stays."""

    def set_outside(self, value: Scalar) -> Tuple[Scalar, Scalar]:
        """Hand a checked value to whatever keeps it outside of this process, before `put` makes it the one in force.

        Returns:
            (the value before, the value after).

        Raises:
            Refused: it is not taken, and nothing has changed.
        """
        return self.value, value

    def put(self, value: Scalar) -> None:
        """Make a value that `set_outside` has returned the one in force."""
        raise NotImplementedError


#: A location, its value before and after.
Change = Tuple[Location, Scalar, Scalar]


def put_in_force(pairs: Sequence[Tuple[Location, Scalar]]) -> None:
    """Make values those in force, as `Location.put`, and have the memory of the node follow them, at one moment.

    Raises:
        Refused: a value that the node keeps could not be computed; nothing has changed.
    """
    following = MEMORY.following(
        {
            location.source: value
            for location, value in pairs
            if not isinstance(location, HeldLocation) or location.is_other(value)
        }
    )
    before = [(location.tracked, location) for location, _ in pairs if isinstance(location, HeldLocation)]
    for location, value in pairs:
        location.put(value)
    readings = {}
    for reading, location in before:
        readings[id(reading)] = location.tracked
        if isinstance(location, ParameterLocation) and location.is_polled:
            location.staying.append(reading)
            readings.update((id(one), one) for one in location.staying)
    MEMORY.follow(following, readings)


class HeldLocation(Location):
    """A location whose value this node holds; `is_polled` says whether the node reads it again in its rounds, and
    `next_id` is its id at the next start, as its file may have been edited since it was loaded."""

    __slots__ = ('_value', 'is_polled', 'next_id', 'tracked')

    tracked: Any

    def __init__(self, identity: str, name: str, site: CallSite, value: Scalar, **limits: Any) -> None:
        super().__init__(identity, name, site, value, **limits)
        self.is_polled = False
        self.next_id = self.id
        self.tracked = None
        self.put(value)

    @property
    def value(self) -> Scalar:
        return self._value

    def is_other(self, value: Scalar) -> bool:
        """Return whether a value differs from the one in force, or has a different type."""
        return type(value) is not type(self._value) or bool(value != self._value)

    def read_in_round(self) -> None:
        self.is_polled = True

    def is_read_again(self) -> bool:
        return self.is_polled or bool(self.changed) or not MEMORY.has_begun

    def name_node(self, node: str) -> None:
        super().name_node(node)
        self.tracked = self.reading_of(self._value)

    def reading_of(self, value: Scalar) -> Any:
        """A tracked value that says of a plain one that this location is its source."""
        return values.track(value, self.source)

    def put(self, value: Scalar) -> None:
        self._value = value
        self.tracked = self.reading_of(value)


class LiteralLocation(HeldLocation):
    """The location of a literal in the code."""

    __slots__ = ('_literal',)

    def __init__(self, identity: str, name: str, site: CallSite, literal: Scalar, **limits: Any) -> None:
        self._literal = literal
        super().__init__(identity, name, site, literal, **limits)

    @property
    def literal(self) -> Scalar:
        return self._literal

    def find_in(self, source: files.SourceText) -> Optional[int]:
        return source.argument_of_call(self.site.line, self.site.column, 0, 'value')

    def reread(self, value_in_code: Scalar) -> None:
        self._literal = value_in_code


class Defaults(Protocol):
    """The defaults that the code gives for parameters."""

    def default_of(self, name: str) -> Tuple[Any, List[str]]: ...

    def reread(self, name: str, said: Scalar) -> None: ...


class ParameterLocation(HeldLocation):
    """The location of a scalar in a ROS parameter; its type is what the parameter says.

    Args:
        defaults: where the code's default is found.

    Attributes:
        unsaved: why its value cannot be written into the default in the code; '' if it can.
        staying: readings that the node may compare with later readings in its rounds. They stay; results of them
            follow.
    """

    __slots__ = ('row', 'unsaved', '_defaults', 'staying')

    def __init__(self, name: str, site: CallSite, value: Scalar, defaults: Defaults) -> None:
        super().__init__(name, name, site, value)
        self.row = self.unsaved = ''
        self.staying: List[Any] = []
        self._defaults = defaults

    @property
    def value_in_code(self) -> Optional[Scalar]:
        return self._defaults.default_of(self.name)[0]

    def checked(self, value: object) -> Scalar:
        return as_sent(super().checked(value))

    def find_in(self, source: files.SourceText) -> Optional[int]:
        value, path = self._defaults.default_of(self.name)
        return None if value is None else source.argument_of_call(self.site.line, self.site.column, 1, 'default', path)

    def reread(self, value_in_code: Scalar) -> None:
        self._defaults.reread(self.name, value_in_code)

    def put(self, value: Scalar) -> None:
        self.type = type(value)
        before = self.tracked
        super().put(value)
        if before is not None and self.type is float and values.plain_scalar(before) == value:
            # Readings as an int keep their number, and take fractions from now on.
            values.remake(before, values.widened(self.tracked))


class Readable(Protocol):
    """A location, or several that one call of `location()` reads together."""

    @property
    def tracked(self) -> Any:
        """The value in force."""

    def read_in_round(self) -> None:
        """Override the attribute of `Location`."""


class Locations:
    """All locations of this node, by id, by name, and by the call that reads them.

    Attributes:
        node: the full name of this node, '' until it is known.
        by_id: {id: Location}, in the order of their creation.
        by_call: {(id of the code, offset in it, name, key): Readable} of the calls that were made, as in `at_call`.
        lock: CHANGE_LOCK.
    """

    def __init__(self) -> None:
        self.node = ''
        self.by_id: Dict[int, Location] = {}
        self._by_name: Dict[str, Location] = {}
        self.by_call: Dict[Any, Readable] = {}
        self._in_set_up: Dict[Any, Readable] = {}  # those of calls that were made before the first round alone
        self._codes: Dict[int, Tuple[weakref.ref[CodeType], List[Any]]] = {}  # by id of the code, its calls
        self._namespaces: Dict[str, Dict[str, Location]] = {}
        self._locations_changed: Callable[[], None] = lambda: None
        self.lock = CHANGE_LOCK

    def on_locations_changed(self, function: Callable[[], None]) -> None:
        """Have a function called whenever a location was created or dropped."""
        self._locations_changed = function

    def name_node(self, node: str) -> None:
        """Set the name of this node."""
        with self.lock:
            self.node = node
            for location in self.by_id.values():
                location.name_node(node)

    def at_call(self, frame: FrameType, name: object, key: object, make: Callable[[], Readable]) -> Readable:
        """Find or make the Readable of a call of `location()`: made at the first call, in `by_call` from then on.

        Args:
            frame: the frame that makes the call.
            name, key: what the call gives as such; they tell the turns of a loop apart. Keys that are equal are one.
            make: makes it; called once.
        """
        # By the identity of the code object: hashing one takes longer than all the rest. Its calls are forgotten when
        # it is no more: programs execute texts again and again, and another code object may get its id.
        code = frame.f_code
        call = (id(code), frame.f_lasti, name, key)
        with self.lock:
            found = self.by_call.get(call)
            if found is None:
                found = self._in_set_up.pop(call, None)
                if found is None:
                    found = make()
                    if id(code) not in self._codes:
                        self._codes[id(code)] = weakref.ref(code, functools.partial(self._forget, id(code))), []
                    self._codes[id(code)][1].append(call)
                self.by_call[call] = found
            if MEMORY.has_begun or threading.current_thread() is not threading.main_thread():
                found.read_in_round()
            return found

    def begin_rounds(self) -> None:
        """Note which calls are made again from now on."""
        with self.lock:
            self._in_set_up.update(self.by_call)
            self.by_call.clear()

    def _forget(self, code_id: int, _ended: object) -> None:
        """Forget the calls of a code object that is no more; called at any time, and waits for no lock."""
        for call in self._codes.pop(code_id)[1]:
            self.by_call.pop(call, None)
            self._in_set_up.pop(call, None)

    def add(self, location: Location) -> Location:
        """Take a new location in, and return the one that is in force: an earlier one of the same name and literal,
        or of the same call if the code has been loaded twice.

        Raises:
            ValueError: its name or its id is taken by another call.
        """
        with self.lock:
            other = self._conflicting_location(location.name) or self.by_id.get(location.id)
            if other is None:
                if self.node:
                    location.name_node(self.node)
                self._by_name[location.name] = self.by_id[location.id] = location
                for namespace in namespaces_of(location.name):
                    self._namespaces.setdefault(namespace, {})[location.name] = location
                self._locations_changed()
                return location
            if _is_same(other, location):
                other.changed += location.changed
                other.is_shared = other.is_shared or other.site != location.site
                return other
            raise ValueError(
                f'the location {location.name} at {location.place} meets {other.name} at {other.place}: '
                'give one of them another name='
            )

    def is_taken(self, name: str) -> bool:
        """True if a location has that name."""
        return name in self._by_name

    def _conflicting_location(self, name: str) -> Optional[Location]:
        """A location that would share a parameter with this name: a parameter is a value or a namespace."""
        for location in self._namespaces.get(name, {}).values():
            return location
        return next(filter(None, map(self._by_name.get, [name, *namespaces_of(name)])), None)

    def remove(self, location: Location) -> None:
        """Forget a location, if it is in force; a change to it is refused from now on."""
        with self.lock:
            if self._by_name.get(location.name) is not location:
                return
            del self._by_name[location.name], self.by_id[location.id]
            for namespace in namespaces_of(location.name):
                del self._namespaces[namespace][location.name]
            self._locations_changed()


def _is_same(other: Location, location: Location) -> bool:
    if (other.name, other.id) != (location.name, location.id):
        return False
    return other.site == location.site or (_has_same_literal(other, location) and _has_limits_of(other, location))


def _has_same_literal(other: Location, location: Location) -> bool:
    return (
        isinstance(other, LiteralLocation)
        and isinstance(location, LiteralLocation)
        and type(other.literal) is type(location.literal)
        and other.literal == location.literal
    )


def _has_limits_of(other: Location, location: Location) -> bool:
    """True if a location has the limits of an earlier one, or leaves them out."""
    return (location.minimum, location.maximum, location.read_only) in (
        (None, None, False),
        (other.minimum, other.maximum, other.read_only),
    )


def namespaces_of(name: str) -> List[str]:
    """`a/b/c` stands in the namespaces `a/b` and `a`."""
    parts = name.split('/')
    return ['/'.join(parts[:count]) for count in range(len(parts) - 1, 0, -1)]


def location_id(identity: str) -> int:
    return int.from_bytes(hashlib.blake2b(identity.encode('utf-8', 'surrogatepass'), digest_size=6).digest(), 'big')
