"""Provenance behind ordinary messages: found where it is, and only there."""

import io
import random

import genpy
import pytest
from geometry_msgs.msg import Point, Pose
from std_msgs.msg import ByteMultiArray, Empty, String, UInt8MultiArray
from visualization_msgs.msg import Marker

from rosslt import Source, track
from rosslt.messages import attach, encode, split_provenance
from rosslt.node.topics.serialization import serializer
from support.filling import Filling, assert_arrived, in_band, serialized

X = track(0.25, Source('/node', 1))


TRACKED_POSE = Pose(position=Point(X, 2 * X, 0.0))


def test_the_provenance_is_found_behind_the_message():
    plain, provenance = split_provenance(in_band(TRACKED_POSE), Pose)
    assert plain == serialized(TRACKED_POSE)
    assert Pose().deserialize(in_band(TRACKED_POSE)) == TRACKED_POSE
    assert provenance == encode(TRACKED_POSE)


@pytest.mark.parametrize('cls', [String, UInt8MultiArray, ByteMultiArray])
def test_a_message_that_holds_a_recorded_message_is_not_mistaken(cls):
    recorded = in_band(String(track('a', Source('/node', 1))))
    for data in (recorded, recorded[2:], in_band(TRACKED_POSE)):
        if cls is String:
            holder = String(data.decode('latin-1').encode('latin-1').decode('utf-8', 'ignore'))
        else:
            holder = cls(data=data if cls is UInt8MultiArray else [byte - 256 if byte > 127 else byte for byte in data])
        sent = serialized(holder)
        assert split_provenance(sent, cls) == (sent, b'')


def test_a_message_cut_short_is_not_mistaken():
    # genpy would shorten the text without a word, and take what follows for its end.
    data = in_band(String(track('hello world', Source('/node', 1))))
    for missing in range(1, 12):
        cut = data[:4] + data[4 + missing :]
        assert split_provenance(cut, String) == (cut, b'')


@pytest.mark.parametrize('size', [0, 1, 7, 8, 2**31, 2**32 - 1])
def test_a_footer_that_lies_is_no_footer(size):
    data = serialized(Pose()) + size.to_bytes(4, 'little') + b'rSLT'
    plain, provenance = split_provenance(data, Pose)
    assert provenance == b''
    assert Pose().deserialize(plain) == Pose()


@pytest.mark.parametrize('data', [b'', b'rSLT', b'1234rSLT', b'\0\0\0\0rSLT'])
def test_what_is_shorter_than_a_message_has_none(data):
    assert split_provenance(data, Pose) == (data, b'')


def test_an_empty_message_can_be_told_from_its_provenance():
    assert split_provenance(b'', Empty) == (b'', b'')
    assert split_provenance(b'ab\2\0\0\0rSLT', Empty) == (b'', b'ab')


def test_a_wrong_field_is_named_also_beside_a_tracked_one():
    message = Pose(position=Point(X, 'text', 0.0))
    with pytest.raises(genpy.SerializationError, match=r'position\.y'):
        serializer(Pose)(message).serialize(io.BytesIO())


def test_any_bytes_come_back_whole():
    chance = random.Random(1)
    message = Filling(2).message(Marker)
    data = in_band(message)
    for _ in range(3000):
        mutated = bytearray(data)
        for _ in range(chance.choice([1, 2, 5])):
            mutated[chance.randrange(len(mutated))] = chance.randrange(256)
        mutated = bytes(mutated[: chance.choice([len(mutated), chance.randrange(len(mutated))])])
        plain, provenance = split_provenance(mutated, Marker)
        assert mutated.startswith(plain + provenance)
        assert len(plain) + len(provenance) in (len(mutated), len(mutated) - 8)
    plain, provenance = split_provenance(data, Marker)
    received = Marker().deserialize(plain)
    attach(received, provenance)
    assert_arrived(message, received)
