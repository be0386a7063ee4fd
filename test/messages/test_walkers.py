"""What the compiled walks of a message class find, whatever its fields hold."""

import array
import contextlib
import random
import struct

import genpy.dynamic
import numpy
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseWithCovariance
from rosgraph_msgs.msg import TopicStatistics
from rosslt.srv import GetValuesRequest, GetValuesResponse, ListLocationsResponse
from sensor_msgs.msg import Image, JointState, LaserScan, PointCloud2
from std_msgs.msg import Empty, UInt8MultiArray
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import InteractiveMarkerUpdate, Marker, MarkerArray

from rosslt import Source, track
from rosslt.messages.walkers import END, TRACKED, walkers
from rosslt.values import leaves
from support.filling import Filling, serialized

X = track(0.25, Source('/node', 1))


def collected(message):
    """The indices of the tracked leaves, and how many leaves there are."""
    found = []
    count = walkers(type(message)).collect(message, 0, found)
    return [index for index, _, _ in found], count


def located(message, indices):
    """The values of the leaves with these indices."""
    return [value for value, _ in with_kinds(message, indices)]


def with_kinds(message, indices):
    """The values and kinds of the leaves with these indices."""
    found, arrays = [], []
    walkers(type(message)).locate(message, 0, [*indices, END], 0, found.append, arrays.append)
    return [(value, kind) for _, _, value, kind in found]


FILLED = [
    Filling(4).message(cls)
    for cls in (
        Pose,
        Marker,
        MarkerArray,
        InteractiveMarkerUpdate,
        JointTrajectory,
        DiagnosticArray,
        LaserScan,
        TopicStatistics,
        PoseWithCovariance,
        Empty,
        GetValuesRequest,
        GetValuesResponse,
        ListLocationsResponse,
    )
]


@pytest.mark.parametrize('message', FILLED, ids=lambda message: message._type)
def test_every_leaf_is_counted_once_in_the_order_of_the_fields(message):
    everything = [leaf for _, leaf in leaves(message)]
    tracked = [index for index, leaf in enumerate(everything) if type(leaf) in TRACKED]
    assert collected(message) == (tracked, len(everything))
    assert located(message, range(len(everything))) == everything


@pytest.mark.parametrize('message', FILLED, ids=lambda message: message._type)
def test_any_leaves_are_located_where_they_are(message):
    everything = [leaf for _, leaf in leaves(message)]
    chance = random.Random(6)
    for _ in range(200):
        borders = sorted(chance.choices(range(len(everything) + 1), k=6))
        wanted = [*range(*borders[:2]), *range(*borders[2:4]), *range(*borders[4:])]  # many next to each other
        wanted = [index for index in wanted if chance.random() < 0.97]
        found, arrays = [], []
        walkers(type(message)).locate(message, 0, [*wanted, END], 0, found.append, arrays.append)
        assert [id(value) for _, _, value, _ in found] == [id(everything[index]) for index in wanted]
        copies = [copy for _, _, _, copy in arrays]
        for owner, key, value, _ in found:
            is_copied = type(owner) is list
            assert (owner[key] if is_copied else getattr(owner, key)) is value
            assert not is_copied or any(owner is copy for copy in copies)


def test_what_is_no_message_is_told_by_its_attribute():
    missing = Point()
    del missing.y
    for wrong in (None, 3, object(), missing):
        pose = Pose()
        pose.position = wrong
        with pytest.raises(AttributeError, match=r"'[xy]'"):
            walkers(Pose).collect(pose, 0, [])


def test_an_array_of_fixed_length_has_its_leaves_whatever_it_holds():
    for wrong in (5, None, [], [X] * 2):
        pose = PoseWithCovariance()
        pose.covariance = wrong
        assert walkers(PoseWithCovariance).collect(pose, 0, []) == 7 + 36


@pytest.mark.parametrize('message', FILLED, ids=lambda message: message._type)
def test_a_serialized_message_ends_where_the_walk_says(message):
    data = serialized(message)
    end = walkers(type(message)).end
    assert end(data, 0, len(data)) == len(data)
    assert end(data + b'more', 0, len(data) + 4) == len(data)


@pytest.mark.parametrize(
    'message',
    [
        Image(data=b'123'),
        Image(data=bytearray(b'123')),
        Image(data=(1, 2, 3)),
        Image(data=numpy.zeros(3, numpy.uint8)),
        LaserScan(ranges=array.array('f', [1, 2])),
        LaserScan(ranges=numpy.ones(2)),
        JointState(name=['a', 'b']),
        PointCloud2(data=memoryview(b'1234')),
    ],
    ids=lambda message: message._type,
)
def test_arrays_of_any_sort_hold_nothing_tracked_by_themselves(message):
    assert collected(message)[0] == []


@pytest.mark.parametrize(
    'sort', [list, tuple, type('Readings', (list,), {}), lambda items: numpy.array(items, dtype=object)]
)
def test_tracked_elements_are_found_in_arrays_that_can_hold_them(sort):
    scan = LaserScan(ranges=sort([1.0, X, 3.0]), intensities=sort([X]))
    (first, second), count = collected(scan)
    assert located(scan, [first, second]) == [0.25, 0.25]
    assert (first, second, count) == (count - 3, count - 1, count)


def test_a_long_array_of_bytes_is_taken_for_data():
    image = UInt8MultiArray(data=[track(1, Source('/node', 1))] + [0] * (1 << 18))
    assert collected(image)[0] == []
    assert located(UInt8MultiArray(data=bytes(1 << 20)), [3]) == []


def test_a_subclass_of_a_message_is_walked_as_it():
    class Reading(Pose):
        __slots__ = ()

    reading = Reading()
    reading.position = Point(0, X, 0)
    assert collected(reading)[0] == [1]


def test_fields_with_names_of_python_are_walked():
    message = genpy.dynamic.generate_dynamic('a/B', 'float64 self\nfloat64 lambda\nfloat64[] class\n')['a/B']()
    message.lambda_, message.class_ = X, [0.0, X]
    assert collected(message) == ([1, 3], 4)


def test_a_cut_message_ends_beyond_the_data():
    data = serialized(DiagnosticArray(status=[DiagnosticStatus(name='n', values=[KeyValue('a', 'b')])]))
    end = walkers(DiagnosticArray).end
    for size in range(len(data)):
        with contextlib.suppress(struct.error):
            assert end(data[:size], 0, size) > size


def test_a_length_that_lies_ends_the_walk():
    lying = bytearray(serialized(DiagnosticArray(status=[DiagnosticStatus()])))
    lying[16:20] = b'\xff' * 4  # the number of statuses
    with pytest.raises(struct.error):
        walkers(DiagnosticArray).end(bytes(lying), 0, len(lying))
