"""Locations: the changeable places of this node.

What the paper calls `create_location` (section IV-A): the place where a value is written down, here a literal
in the code, gets an identity that outlives a restart, a name, and a current value that can be changed from
outside. This module knows places and values; that parameters and services stand behind them is the business
of its neighbours `parameters` and `owner`.
"""

import dis
import hashlib
import json
import linecache
import math
import os
import re
from collections import namedtuple

from rosslt import values
from rosslt.node.refresh import READINGS

CallSite = namedtuple('CallSite', 'file line column text')


class Refused(Exception):
    """A value that a location does not take; the text is the reason."""


class Location:
    """One changeable place in this node; the base of its kinds.

    Attributes:
        id: 48 bits, the same after a restart.
        name: below `<node>/rosslt/`; a full name where it is a parameter elsewhere.
        site: the CallSite that created it.
        source: it, as a Source.
        type: `float`, `int`, `str` or `bool`.
        value: the plain value in force.
        tracked: the same, tracked.
        minimum, maximum: bounds, or None.
        read_only: True where no change is taken.
        rank: how willingly it is changed where several locations could be: 0 first.
        parameter: the Parameter that follows it, or None.
    """

    __slots__ = ('id', 'name', 'site', 'source', 'type', 'minimum', 'maximum', 'read_only', 'parameter')
    rank = 0

    def __init__(self, node, identity, name, site, value, minimum=None, maximum=None, read_only=False):
        self.id = _location_id(identity)
        self.name = name
        self.site = site
        self.source = values.Source(node, self.id)
        self.type = type(value)
        self.minimum, self.maximum, self.read_only = minimum, maximum, read_only
        self.parameter = None
        self.checked(value)

    @property
    def place(self):
        """Where it is, for people: `talker.py:12:9`."""
        return f'{os.path.basename(self.site.file)}:{self.site.line}:{self.site.column}'

    def checked(self, value):
        """`value` as this location takes it.

        Raises:
            Refused: it is of another type, not finite, or out of bounds.
        """
        value = scalar(value)
        # A float takes an int, and an int a float without a fraction, as YAML and JSON write them alike.
        if self.type is float and type(value) is int:
            try:
                value = float(value)
            except OverflowError:
                raise Refused(f'{value!r} is too large for a float') from None
        elif self.type is int and type(value) is float and value.is_integer():
            value = int(value)
        if type(value) is not self.type:
            raise Refused(f'{self.name} is a {self.type.__name__}, and {value!r} is not')
        if self.type is float and not math.isfinite(value):
            raise Refused(f'{value!r} is not a finite number')
        if self.minimum is not None and value < self.minimum:
            raise Refused(f'{value!r} is below its minimum {self.minimum!r}')
        if self.maximum is not None and value > self.maximum:
            raise Refused(f'{value!r} is above its maximum {self.maximum!r}')
        return value

    def put(self, value):
        """Make a checked value the one in force.

        Raises:
            Refused: what stands behind the location does not take it.
        """
        raise NotImplementedError


class HeldLocation(Location):
    """A location whose value this node holds in its memory: a literal's, or that of a part of a parameter.

    Attributes:
        literal: the value that it was created with.
    """

    __slots__ = ('literal', 'value', 'tracked')

    def __init__(self, node, identity, name, site, literal, **limits):
        super().__init__(node, identity, name, site, literal, **limits)
        self.literal = literal
        self.put(literal)

    def put(self, value):
        before = getattr(self, 'tracked', None)
        self.value = value
        self.tracked = values.track(value, self.source)
        if before is not None:
            READINGS.replace(before, self.tracked)

    def retype(self, value):
        """Make `value` the one in force, and its type the location's."""
        self.type = type(value)
        self.put(value)


class ExternalLocation(Location):
    """A location outside of the code, in a file say, that a pair of functions reads and writes (section
    IV-A).

    Args:
        getter: returns the value; its type at the start is the location's.
        setter: takes a new value; what it raises is the reason of a refusal. None: read-only.
    """

    __slots__ = ('_getter', '_setter', '_reading')

    def __init__(self, node, identity, name, site, getter, setter, read_only=False, **bounds):
        self._getter, self._setter, self._reading = getter, setter, None
        super().__init__(node, identity, name, site, self.value, read_only=read_only or setter is None, **bounds)

    @property
    def value(self):
        return scalar(self._getter())

    @property
    def tracked(self):
        value, reading = self.value, self._reading
        if reading is None or scalar(reading) != value or type(scalar(reading)) is not type(value):
            reading = self._reading = values.track(value, self.source)
        return reading

    def put(self, value):
        before = self._reading
        try:
            self._setter(value)
        except Exception as error:  # the user's function: whatever it raises is its way to refuse
            raise Refused(f'the setter of {self.name} refuses {value!r}: {type(error).__name__}: {error}') from error
        # What changes by itself is a record of a moment, what was put here is meant to act everywhere.
        latest = self.tracked
        if before is not None and latest is not before:
            READINGS.replace(before, latest)


class Locations:
    """All locations of this node, by id, by name, and by the call that reads them.

    Attributes:
        node: the full name of this node.
        by_id: {id: Location}, in the order of their creation.
        lock: held while locations come and go, and while their values change.
    """

    def __init__(self, node):
        self.node = node
        self.by_id = {}
        self._by_name = {}
        self._by_call = {}
        self._namespaces = {}
        self.lock = READINGS.lock

    def at_call(self, frame, name, key, build):
        """What `location()` returns for a call: built at the first one, looked up at every other.

        Args:
            frame: the frame that makes the call.
            name, key: what the call gives as such; they tell the turns of a loop apart.
            build: makes the function that reads the value; called once.
        """
        # By the identity of the code object: hashing one takes longer than all the rest here. The entry
        # keeps the code alive, so that its id is not given to another one.
        call = (id(frame.f_code), frame.f_lasti, name, key)
        entry = self._by_call.get(call)
        if entry is None:
            with self.lock:
                entry = self._by_call.get(call)
                if entry is None:
                    entry = self._by_call[call] = (build(), frame.f_code)
        return entry[0]()

    def add(self, location):
        """Take a new location in, and return the one that is in force: an earlier one of the same call site
        where the code has been loaded twice.

        Raises:
            ValueError: its name or its id is taken by another place.
        """
        with self.lock:
            other = (
                self._by_name.get(location.name) or self._below_or_above(location.name) or self.by_id.get(location.id)
            )
            if other is None:
                self._by_name[location.name] = self.by_id[location.id] = location
                for namespace in namespaces_of(location.name):
                    self._namespaces.setdefault(namespace, {})[location.name] = location
                return location
            if (other.name, other.id, other.site) == (location.name, location.id, location.site):
                return other
            raise ValueError(
                f'the location {location.name} at {location.place} meets {other.name} at '
                f'{other.place}: give one of them another name='
            )

    def _below_or_above(self, name):
        """A location that would share a parameter with this name: a parameter is a value or a namespace."""
        for location in self._namespaces.get(name, {}).values():
            return location
        return next(filter(None, map(self._by_name.get, namespaces_of(name))), None)

    def remove(self, location):
        """Forget a location; a change to it is refused from now on."""
        with self.lock:
            del self._by_name[location.name], self.by_id[location.id]
            for namespace in namespaces_of(location.name):
                del self._namespaces[namespace][location.name]


def call_site(frame):
    """File, line, column (from 1) and text of the call that a frame is making.

    The column comes from `co_positions` (Python 3.11); before that, the offset of the call's instruction from the
    first one of its line stands in for it: it tells two calls on one line apart and is as stable as the line.
    """
    code, line = frame.f_code, frame.f_lineno
    column = frame.f_lasti + 1 - min(offset for offset, at in dis.findlinestarts(code) if at == line)
    positions = getattr(code, 'co_positions', None)
    if positions is not None:
        start_line, _, start_column, _ = list(positions())[frame.f_lasti // 2]
        if start_line is not None and start_column is not None:
            line, column = start_line, start_column + 1
    return CallSite(code.co_filename, line, column, linecache.getline(code.co_filename, line))


def identity_of(site, key):
    """What makes a location at a call site itself: not the number that is written there, which may be
    edited."""
    text = re.sub(r'[-+]?[\d.]+(e[-+]?\d+)?', '0', ''.join(site.text.split()))
    return f'{os.path.realpath(site.file)}\n{site.line}\n{site.column}\n{text}\n{key}'


def name_of(site, key):
    """A parameter's name for a call site that was given none: `talker_12_9`."""
    stem = os.path.splitext(os.path.basename(site.file))[0]
    parts = [stem, str(site.line), str(site.column)]
    if key is not None:
        parts.append(str(key))
    name = re.sub(r'\W', '_', '_'.join(parts), flags=re.ASCII)
    return name if name[0].isalpha() else 'l_' + name


def namespaces_of(name):
    """`a/b/c` stands in the namespaces `a/b` and `a`."""
    parts = name.split('/')
    return ['/'.join(parts[:count]) for count in range(len(parts) - 1, 0, -1)]


def scalar(value):
    """A float, int, str or bool as exactly that: without provenance, and without NumPy's or another's
    subclass.

    Anything else comes back as it is.
    """
    value = values.untracked(value)
    for kind in (bool, int, float, str):
        if isinstance(value, kind):
            return kind(value)
    return value


def to_json(value):
    """A plain scalar as it travels; JSON writes a float with all its digits."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def from_json(text):
    """A plain scalar from the wire.

    Raises:
        Refused: the text is no JSON scalar, or a number that is not finite.
    """

    def not_finite(constant):
        raise Refused(f'{constant} is not a finite number')

    try:
        value = json.loads(text, parse_constant=not_finite)
    except (ValueError, RecursionError) as error:
        raise Refused(f'{text!r} is not a JSON scalar ({error})') from None
    if type(value) not in (float, int, str, bool):
        raise Refused(f'{text!r} is not a JSON scalar')
    return value


def _location_id(identity):
    return int.from_bytes(hashlib.blake2b(identity.encode('utf-8'), digest_size=6).digest(), 'big')
