"""Messages of any type with tracked values in every field, and checks of received ones."""

import io
import random

import genpy
import pytest
from genmsg.msgs import parse_type

from rosslt import Source, evaluate, is_tracked, math, sources, track
from rosslt.messages import append_provenance
from rosslt.values import leaves

INTEGERS = {
    'int8': (-(2**7), 2**7 - 1),
    'byte': (-(2**7), 2**7 - 1),
    'uint8': (0, 2**8 - 1),
    'char': (0, 2**8 - 1),
    'int16': (-(2**15), 2**15 - 1),
    'uint16': (0, 2**16 - 1),
    'int32': (-(2**31), 2**31 - 1),
    'uint32': (0, 2**32 - 1),
    'int64': (-(2**63), 2**63 - 1),
    'uint64': (0, 2**64 - 1),
}
TEXTS = ('', 'world', 'grün', '\u6771\u4eac', 'a\0b', '\U0001f916' * 3)


class Filling:
    """Fills messages, each leaf from sources of its own or of a leaf before it."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self._count = 0

    def source(self):
        self._count += self.random.random() < 0.8
        return Source('/node_%d' % (self._count % 5), (self._count * 2654435761) % 2**48)

    def message(self, cls):
        message = cls()
        for name, type_ in zip(cls.__slots__, cls._slot_types):
            setattr(message, name, self.field(type_))
        return message

    def field(self, type_):
        base, is_array, length = parse_type(type_)
        if not is_array:
            return self.one(base)
        return [self.one(base) for _ in range(self.random.randrange(1, 4) if length is None else length)]

    def one(self, type_):
        if type_ in INTEGERS:
            return self.integer(*INTEGERS[type_])
        if type_ in ('float32', 'float64'):
            return self.number()
        if type_ == 'bool':
            return track(self.random.random() < 0.5, self.source())
        if type_ == 'string':
            text = track(self.random.choice(TEXTS), self.source())
            return self.random.choice([text, text + 'é', 'ns/' + text])
        if type_ in ('time', 'duration'):
            # Their constructors make plain integers of what they are given.
            instant = genpy.Time() if type_ == 'time' else genpy.Duration()
            instant.secs = self.integer(*INTEGERS['uint32' if type_ == 'time' else 'int32'])
            instant.nsecs = self.integer(0, 10**9 - 1)
            return instant
        return self.message(genpy.message.get_message_class(type_))

    def integer(self, low, high):
        way = self.random.randrange(4)
        if way == 0:
            return track(self.random.choice([low, high]), self.source())
        if way == 1:
            return track(self.random.randrange(low // 4, high // 4 + 1), self.source()) * 2 + 1
        if way == 2:
            return track(self.random.randrange(low, high + 1), self.source()) // 3
        return track(self.random.randrange(low, high + 1), self.source())

    def number(self):
        x = track(self.random.randrange(-800, 800) / 8, self.source())
        y = track(self.random.choice([0.5, -3, 1e-3]), self.source())
        return self.random.choice([x, 2 * x + 1.5, x + y, 0.25 * x - 3 * y + x, math.sin(x) + y, x * y, x])


def serialized(message):
    """A message as rospy sends it."""
    buff = io.BytesIO()
    message.serialize(buff)
    return buff.getvalue()


def in_band(message):
    """A message with its provenance behind it, as a publisher of the ordinary type sends it."""
    buff = io.BytesIO()
    message.serialize(buff)
    append_provenance(message, buff)
    return buff.getvalue()


def assert_arrived(sent, received, seed=0):
    """Every value arrived, and every provenance: the same sources, and the same value whatever theirs become."""
    chance = random.Random(seed)
    arrived = dict(every_leaf(received))
    for path, leaf in every_leaf(sent):
        other = arrived.pop(path)
        assert_same(path, leaf, other)
        assert is_tracked(leaf) == is_tracked(other), path
        assert sources(leaf) == sources(other), path
        if not is_tracked(leaf):
            continue
        changes = {source: changed(leaf, chance) for source in sources(leaf)}
        assert_same(path, evaluate(leaf, changes), evaluate(other, changes))
    assert not arrived


def every_leaf(message):
    """The leaves of a message, with those of `bytes` one by one."""
    for path, leaf in leaves(message):
        if isinstance(leaf, bytes):
            yield from (('%s[%d]' % (path, index), byte) for index, byte in enumerate(leaf))
        else:
            yield path, leaf


def changed(leaf, chance):
    """Another value for the sources of a leaf."""
    if isinstance(leaf, str):
        return 'other'
    if isinstance(leaf, float):
        return chance.uniform(-5, 5)
    return chance.randrange(0, 1000)


def assert_same(path, sent, received):
    """A value is the same after its way; a field of 32 bits rounds."""
    if isinstance(sent, str):
        assert sent == received, path
    elif isinstance(received, float):
        assert received == pytest.approx(float(sent), rel=1e-6, abs=1e-4), path
    else:
        assert sent == received, path
