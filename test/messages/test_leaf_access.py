"""Leaves before the first array: found, and given their provenance, as the general walks do it."""

import itertools

import pytest
from geometry_msgs.msg import Point, Pose, PoseArray, PoseStamped, PoseWithCovariance, TransformStamped, Twist
from sensor_msgs.msg import NavSatStatus, Range
from std_msgs.msg import Bool, ColorRGBA, Empty, Float64, Int8, String, Time
from visualization_msgs.msg import Marker

from rosslt import Source, is_tracked, sources, track, untracked
from rosslt.messages import attach, encode
from rosslt.messages.codec.encoder import _encoded
from rosslt.messages.codegen.leaf_access import leaf_readers, leaf_writer
from rosslt.messages.codegen.walkers import walkers
from rosslt.values import leaves
from support.filling import Filling, assert_arrived

X = track(0.25, Source('/node', 1))
WITHOUT_ARRAYS = (
    Pose,
    PoseStamped,
    TransformStamped,
    Twist,
    Range,
    NavSatStatus,
    Bool,
    ColorRGBA,
    Empty,
    Float64,
    Int8,
    String,
    Time,
)


def collected(message):
    found = []
    walkers(type(message)).collect(message, 0, found)
    return found


@pytest.mark.parametrize('cls', WITHOUT_ARRAYS)
def test_what_is_gathered_is_what_the_general_walk_collects(cls):
    for seed in range(20):
        message = Filling(seed).message(cls)
        if seed % 2 and cls is not Empty:
            path, value = leaves(message)[0]
            owner, _, name = path.rpartition('.')
            setattr(message if not owner else getattr(message, owner), name, untracked(value))
        found = collected(message)
        which, values = leaf_readers(cls).gather(message)
        assert which == sum(1 << index for index, _, _ in found)
        assert list(map(id, values)) == [id(value) for _, value, _ in found]
        assert leaf_readers(cls).is_plain(message) == (not found)
        assert leaf_readers(cls).is_plain(untracked(message))


@pytest.mark.parametrize('cls', [PoseArray, Marker, PoseWithCovariance])
def test_a_class_with_arrays_has_no_leaf_readers(cls):
    assert leaf_readers(cls) is None


def test_a_value_of_another_type_than_its_field_is_left_to_the_general_walk():
    one = track(1, Source('/node', 2))
    message = Pose(position=Point(X, one, 0.0))
    assert leaf_readers(Pose).gather(message) is None
    received = untracked(message)
    attach(received, encode(message))
    assert_arrived(message, received)


@pytest.mark.parametrize('cls', WITHOUT_ARRAYS)
def test_sources_themselves_are_sent_by_leaf_readers_as_by_the_general_walk(cls):
    message = cls()
    for number, (path, value) in enumerate(leaves(message)):
        owner, _, name = path.rpartition('.')
        part = message
        for each in filter(None, owner.split('.')):
            part = getattr(part, each)
        setattr(part, name, track(value, Source('/node_%d' % (number % 3), number)))
    by_readers, general = encode(message), _encoded(cls._type, collected(message), False)
    assert len(by_readers) <= len(general)
    for data in (by_readers, general):
        received = untracked(message)
        attach(received, data)
        assert_arrived(message, received)


@pytest.mark.parametrize('indices', [each for count in range(1, 8) for each in itertools.combinations(range(7), count)])
def test_provenance_is_placed_on_any_leaves(indices):
    sent = Pose()
    for index in indices:
        owner, name = (sent.position, 'xyz'[index]) if index < 3 else (sent.orientation, 'xyzw'[index - 3])
        setattr(owner, name, 2 * track(float(index), Source('/node', index)))
    received = untracked(sent)
    attach(received, encode(sent))
    assert_arrived(sent, received)


def test_the_leaves_before_an_array_are_placed_by_a_leaf_writer():
    scale = [index for index, (path, _) in enumerate(walkers(Marker).layout.head()) if path.startswith('scale.')]
    message = Marker()
    assert leaf_writer(Marker, tuple(scale)).write(message, [lambda value: ((Source('/node', 1), value, 1),)] * 3)
    assert sources(message) == [Source('/node', 1)]
    assert [path for path, leaf in leaves(message) if is_tracked(leaf)] == ['scale.x', 'scale.y', 'scale.z']


@pytest.mark.parametrize('indices', [(), (0,), (3, 99)], ids=['none', 'an integer', 'beyond'])
def test_other_leaves_are_left_to_the_general_walk(indices):
    assert leaf_writer(Marker, indices) is None


def test_nothing_is_placed_where_a_leaf_holds_no_plain_float():
    for other in (1, X, 'text'):
        message = Pose(position=Point(0.5, other, 0.5))
        assert not leaf_writer(Pose, (0, 1)).write(message, [None, None])
        assert message == Pose(position=Point(0.5, other, 0.5))
        assert not is_tracked(message.position.x)


def test_what_was_received_for_one_class_is_placed_anew_in_another():
    data = encode(Float64(X))
    for cls in (Float64, Pose, Float64, Pose):
        message = cls()
        attach(message, data)
        assert sources(message) == [Source('/node', 1)]
        assert sum(is_tracked(leaf) for _, leaf in leaves(message)) == 1
