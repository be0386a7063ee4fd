"""Provenance that was changed at random, and checks of its decoding; `./run bench hostile` runs many more cases."""

import collections
import contextlib
import gc
import logging
import random
import struct
import time
import traceback
from typing import NamedTuple

import genpy
from geometry_msgs.msg import Point, Pose, PoseArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float32, Float64, Int32, Int64, String
from visualization_msgs.msg import Marker

from rosslt import (
    NotInvertible,
    NotTracked,
    Source,
    evaluate,
    explain,
    is_tracked,
    math,
    solve,
    sources,
    track,
    untracked,
)
from rosslt.messages import BadHeader, attach, decode, encode, tracked_type
from rosslt.messages.codec.expressions import agrees
from rosslt.values import SOURCE, disassemble, source_values
from support.filling import Filling, every_leaf, serialized

X = track(0.25, Source('/node', 1))


def messages():
    """Messages whose provenances together have every part that there is."""
    text = track('abc', Source('/node', 1))
    count = track(4, Source('/node', 9))
    y = track(2, Source('/third', 2**47))
    strip = Marker(
        points=[Point(X * place, 2 * X + place, math.sin(X) * place) for place in range(4)],
        text=track('a', Source('/other', 2)) + 'b',
        frame_locked=track(True, Source('/other', 3)),
    )
    strip.id = track(7, Source('/node', 9)) * 3
    strip.ns = strip.text
    return [
        Pose(position=Point(X, X + y, X * y)),
        Pose(position=Point(X, 2 * X, 3 * X + y)),
        Point(X, X, 2 * X),
        strip,
        Filling(3).message(Marker),
        Filling(5).message(PoseArray),
        Marker(text=text),
        Marker(text=text, frame_locked=track(True, Source('/node', 3))),
        JointState(name=[text, track('b', Source('/node', 2))], position=[X, X * 2]),
        JointState(name=[text, 'b' + track('c', Source('/node', 2))], position=[X, X * X]),
        String(text + 'b'),
        Bool(track(True, Source('/node', 1))),
        Float32(X * 3),
        Float64(math.sin(X) ** 2 + math.cos(y)),
        Int32((count // 2) * (count // 2) - count),
        Int64(2**count + 1),
    ]


def samples():
    """`(message class, its provenance)`, short and with its full history."""
    return [(type(message), encode(message, full)) for message in messages() for full in (False, True)]


def mutated(data, chance, others):
    """The data with something changed."""
    data = bytearray(data)
    for _ in range(chance.choice([1, 1, 2, 5])):
        place = chance.randrange(len(data) + 1)
        way = chance.randrange(6)
        if way == 0:
            del data[place:]
        elif way == 1:
            data[place:place] = chance.choice([b'\xff', b'\x80' * 9, b'\0', bytes([chance.randrange(256)])])
        elif way == 2:
            del data[place : place + chance.randrange(1, 9)]
        elif way == 3:
            other = chance.choice(others)
            start = chance.randrange(len(other))
            data[place : place + 8] = other[start : start + 8]
        elif way == 4:
            data[place : place + 8] = struct.pack('<d', chance.choice([float('nan'), float('inf'), 1e308, -0.0]))
        elif data:
            data[place % len(data)] = chance.choice([0, 1, 2, data[place % len(data)] ^ 1, chance.randrange(256)])
    return bytes(data)


def use(message, plain):
    """Send a message on, and what a node would compute from it; ask for all its sources."""
    found = [leaf for _, leaf in every_leaf(message) if is_tracked(leaf)]
    for leaf in found:
        kind = 's' if isinstance(leaf, str) else 'f'
        # what is said to have made the value makes it; two readings of one source may differ
        readings = [instruction[1] for instruction in disassemble([leaf])[0] if instruction[0] == SOURCE]
        again = evaluate(leaf, source_values([leaf]) if len(set(readings)) == len(readings) else {})
        assert agrees(again, untracked(leaf), kind), explain(leaf)
        assert all(isinstance(source, Source) for source in sources(leaf))
        with contextlib.suppress(NotInvertible, NotTracked):
            solve(leaf, leaf)
    for full in (False, True):
        attach(type(message)().deserialize(plain), encode(message, full))
    numbers = [leaf for leaf in found if not isinstance(leaf, str)] or [X]
    computed = []
    for first, second in zip(numbers, numbers[::-1]):
        with contextlib.suppress(ArithmeticError, ValueError):
            computed += [2.0 * first + second, first * second]
    joined = [leaf + '/' for leaf in found if isinstance(leaf, str)]
    for full in (False, True):
        sent = JointState(position=computed[:8], name=joined[:4])
        received = untracked(sent)
        attach(received, encode(sent, full))
        sources(received)


class Result(NamedTuple):
    """What changed provenances have done."""

    attached: int
    """How many were right by chance."""
    faults: collections.Counter
    """How often each fault came: an exception other than BadHeader, or any at all in using a message, or a message that
    is not as it was, or a provenance that does not make the value of its field."""
    slowest: float
    """The longest time that receiving one message and asking for all its sources took, in seconds of processor time."""


def drawn(right, cases, seed):
    """`(message class, data)`: few are right, others random or made for another type, and most changed."""
    chance = random.Random(seed)
    others = [data for _, data in right]
    for _ in range(cases):
        cls, data = chance.choice(right)
        way = chance.random()
        if way < 0.05:
            data = bytes([1]) + bytes(chance.randrange(256) for _ in range(chance.randrange(60)))
        elif way < 0.1:
            cls = chance.choice(right)[0]
        elif way < 0.95:
            data = mutated(data, chance, others)
        yield cls, data


@contextlib.contextmanager
def counted(faults, cls, data):
    """Count what is raised meanwhile."""
    try:
        yield
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        faults['%s: %s (%s:%d)' % (type(error).__name__, error, place.filename, place.lineno)] += 1
        logging.getLogger(__name__).debug('%s with %s', cls.__name__, data.hex())


def fuzz(cases, seed):
    """Attach changed provenances to messages, and use what comes of it."""
    right = samples()
    plain = {cls: serialized(Filling(5).message(cls)) for cls, _ in right}
    attached, slowest, faults = 0, 0.0, collections.Counter()
    gc.collect()
    gc.freeze()  # what is there already is not what a message takes time for
    for cls, data in drawn(right, cases, seed):
        message = cls().deserialize(plain[cls])
        with counted(faults, cls, data):
            begin, is_right = time.process_time(), False
            with contextlib.suppress(BadHeader):
                attach(message, data)
                sources(message)
                is_right = True
            slowest = max(slowest, time.process_time() - begin)
            if is_right:
                attached += 1
                use(message, plain[cls])
            else:
                assert not is_tracked(message)
            assert serialized(message) == plain[cls]
    return Result(attached, faults, slowest)


def fuzz_stream(cases, seed):
    """Decode what came over a connection, ordinary messages and those of tracked types, with anything in it changed.

    Returns:
        How many came with a provenance, and of each fault how often it came: any exception but that for a message that
        cannot be read.
    """
    right = []
    for message, (_, data) in zip(messages() * 2, samples()[::2] + samples()[1::2]):
        plain = serialized(untracked(message))
        right.append((type(message), plain + data + struct.pack('<I4s', len(data), b'rSLT')))
        wrapped = tracked_type(type(message))(data=untracked(message))
        wrapped.provenance.data = data
        right.append((type(wrapped), serialized(wrapped)))
    tracked, faults = 0, collections.Counter()
    for cls, data in drawn(right, cases, seed):
        with counted(faults, cls, data), contextlib.suppress(genpy.DeserializationError):
            message, error, _ = decode(data, cls)
            found = sources(message)
            assert not (error and found)
            tracked += bool(found)
    return tracked, faults
