"""`rosslt.tf.Buffer` says what tf2's buffer says, and knows where the numbers came from."""

import math

import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import Point, PointStamped, Quaternion, Transform, TransformStamped, Vector3
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from std_msgs.msg import Header

import rosslt
from rosslt import tf, values

#: Against the size of the numbers.
PRECISION = 1e-9

coordinates = st.floats(-100, 100)


@st.composite
def rotations(draw):
    parts = [draw(st.floats(-1, 1)) for _ in range(4)]
    length = math.sqrt(sum(part * part for part in parts))
    assume(length > 0.1)
    return tuple(part / length for part in parts)


def transform(parent, child, stamp, translation=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0, 1.0)):
    return TransformStamped(
        Header(frame_id=parent, stamp=rospy.Time.from_sec(stamp)),
        child,
        Transform(Vector3(*translation), Quaternion(*rotation)),
    )


@st.composite
def forests(draw):
    """Transforms of a tree of frames f0, f1, ..., each `(TransformStamped, is static)`."""
    made = []
    for index in range(1, draw(st.integers(2, 6))):
        parent = 'f{}'.format(draw(st.integers(0, index - 1)))
        is_static = draw(st.booleans())
        stamps = [0.0] if is_static else sorted({1.0, 4.0, *draw(st.lists(st.integers(1, 40).map(lambda n: n / 10)))})
        for stamp in stamps:
            translation = [draw(coordinates) for _ in range(3)]
            made.append((transform(parent, f'f{index}', stamp, translation, draw(rotations())), is_static))
    return made


def tracked(transforms, is_tracked):
    """The transforms with each number of those for which `is_tracked(index)` holds from a source of its own."""
    made = []
    for index, (stamped, is_static) in enumerate(transforms):
        copy = rosslt.untracked(stamped)
        if is_tracked(index):
            for place, (part, name) in enumerate(numbers_of(copy.transform)):
                setattr(part, name, rosslt.track(getattr(part, name), rosslt.Source('/b', 7 * index + place)))
        made.append((copy, is_static))
    return made


def numbers_of(transform):
    return [(part, name) for part in (transform.translation, transform.rotation) for name in part.__slots__]


def filled(buffer, transforms):
    for stamped, is_static in transforms:
        (buffer.set_transform_static if is_static else buffer.set_transform)(stamped, 'test')
    return buffer


def assert_alike(found, expected):
    assert (found.header, found.child_frame_id) == (expected.header, expected.child_frame_id)
    for (part, name), (wanted_part, _) in zip(numbers_of(found.transform), numbers_of(expected.transform)):
        wanted = getattr(wanted_part, name)
        assert abs(getattr(part, name) - wanted) <= PRECISION * max(1.0, abs(wanted)), name


times = st.sampled_from([0.0, 1.0, 1.25, 2.0, 2.718281828, 3.3, 4.0])


@given(forests(), st.data(), times)
def test_a_lookup_agrees_with_tf2_for_these_numbers_and_for_others(transforms, data, time):
    frames = [stamped.child_frame_id for stamped, _ in transforms]
    chosen_frames = data.draw(st.sets(st.sampled_from(frames), min_size=1))
    chosen = [index for index, frame in enumerate(frames) if frame in chosen_frames]
    plain = filled(tf2_ros.Buffer(debug=False), transforms)
    ours = filled(tf.Buffer(debug=False), tracked(transforms, chosen.__contains__))
    target, source = (data.draw(st.sampled_from(['f0', *frames])) for _ in range(2))
    expected = plain.lookup_transform(target, source, rospy.Time.from_sec(time))
    found = ours.lookup_transform(target, source, rospy.Time.from_sec(time))
    assert_alike(found, expected)

    # with other numbers in one of the tracked transforms, as if they had been broadcast
    changed = data.draw(st.sampled_from(chosen))
    other = rosslt.untracked(transforms[changed][0])
    for part, name in numbers_of(other.transform)[:3]:
        setattr(part, name, getattr(part, name) + 0.25)
    half = math.radians(5)
    other.transform.rotation = Quaternion(
        *tf.quaternion_multiply(other.transform.rotation, (math.sin(half), 0.0, 0.0, math.cos(half)))
    )
    again = list(transforms)
    again[changed] = (other, transforms[changed][1])
    assume(all(map(is_between_well_defined, (transforms, again))))
    expected = filled(tf2_ros.Buffer(debug=False), again).lookup_transform(target, source, rospy.Time.from_sec(time))
    changes = {
        rosslt.Source('/b', 7 * changed + place): getattr(part, name)
        for place, (part, name) in enumerate(numbers_of(other.transform))
    }
    found.transform = rosslt.evaluate(found.transform, changes)
    if expected.transform.rotation.w * found.transform.rotation.w < 0:
        found.transform.rotation = Quaternion(*[-part for _, part in values.leaves(found.transform.rotation)])
    assert_alike(found, expected)


def is_between_well_defined(transforms):
    """Whether no two rotations of a frame, one after the other, are about half a turn apart, where another number may
    lead the other way around, or about the same, where the weights of both are constants."""
    by_frame = {}
    for stamped, _ in transforms:
        by_frame.setdefault(stamped.child_frame_id, []).append(stamped.transform.rotation)
    return all(
        0.2 < abs(sum(getattr(a, name) * getattr(b, name) for name in 'xyzw')) < 1 - 1e-6
        for rotations in by_frame.values()
        for a, b in zip(rotations, rotations[1:])
    )


@pytest.mark.slow
@given(forests(), times, times)
def test_a_lookup_over_time_agrees_with_tf2(transforms, target_time, source_time):
    arguments = ('f1', rospy.Time.from_sec(target_time), 'f2', rospy.Time.from_sec(source_time), 'f0')
    assume(any(stamped.child_frame_id == 'f2' for stamped, _ in transforms))
    expected = filled(tf2_ros.Buffer(debug=False), transforms).lookup_transform_full(*arguments)
    found = filled(tf.Buffer(debug=False), tracked(transforms, lambda _: True)).lookup_transform_full(*arguments)
    assert_alike(found, expected)


def test_what_lies_between_two_frames_is_solved_back_to_their_transforms():
    x, y = (rosslt.track(value, rosslt.Source('/arm', place)) for place, value in enumerate((2.0, 0.5)))
    turn = tf.quaternion_from_euler(0, 0, math.pi / 2)
    buffer = filled(
        tf.Buffer(debug=False),
        [
            (transform('world', 'base', 0, (10.0, 0.0, 0.0), turn), True),
            (transform('base', 'arm', 1, (x, 0.0, 0.0)), False),
            (transform('base', 'arm', 3, (x, 0.0, 0.0)), False),
            (transform('arm', 'tip', 0, (0.0, y, 0.0)), True),
            (transform('world', 'eye', 0, (0.0, 0.0, 1.0)), True),
        ],
    )
    found = buffer.lookup_transform('eye', 'tip', rospy.Time(2)).transform.translation
    assert (round(found.x, 9), round(found.y, 9), found.z) == (9.5, 2.0, -1.0)
    assert rosslt.sources(found.y)[:1] == [rosslt.Source('/arm', 0)]
    assert rosslt.solve(found.y, 5.0)[rosslt.Source('/arm', 0)] == pytest.approx(5.0)
    assert not rosslt.is_tracked(found.z)
    tip = buffer.transform(PointStamped(Header(frame_id='tip'), Point(0.0, 0.0, 0.0)), 'world').point
    length = rosslt.Source('/arm', 1)
    assert rosslt.solve(tip.x, 9.0, source=length) == {length: pytest.approx(1.0)}
    back = buffer.lookup_transform('tip', 'eye', rospy.Time(0)).transform.translation
    assert {source.location_id for source in rosslt.sources(back)} == {0, 1}


@given(forests(), st.data(), times)
def test_a_lookup_agrees_with_tf2_where_a_frame_is_tracked_now_and_then(transforms, data, time):
    chosen = data.draw(st.sets(st.integers(0, len(transforms) - 1), min_size=1))
    plain = filled(tf2_ros.Buffer(debug=False), transforms)
    ours = filled(tf.Buffer(debug=False), tracked(transforms, chosen.__contains__))
    last = transforms[-1][0].child_frame_id
    for arguments in (('f0', last), (last, 'f0'), ('f1', last)):
        assert_alike(*(buffer.lookup_transform(*arguments, rospy.Time.from_sec(time)) for buffer in (ours, plain)))


def test_frames_without_provenance_are_looked_up_plain():
    buffer = filled(tf.Buffer(debug=False), [(transform('world', 'base', 0, (1.0, 2.0, 3.0)), True)])
    assert not rosslt.is_tracked(buffer.lookup_transform('world', 'base', rospy.Time(0)))


@given(st.floats(1.6e9, 1.9e9), st.integers(0, 10**9 - 1))
def test_the_latest_transform_is_found_at_any_time_of_day(seconds, nanoseconds):
    x = rosslt.track(2.0, rosslt.Source('/arm', 1))
    stamped = transform('base', 'arm', 0, (x, 0.0, 0.0))
    stamped.header.stamp = rospy.Time(int(seconds), nanoseconds)
    buffer = filled(tf.Buffer(debug=False), [(stamped, False)])
    for time in (rospy.Time(0), stamped.header.stamp):
        assert rosslt.is_tracked(buffer.lookup_transform('base', 'arm', time))


def test_errors_are_those_of_tf2():
    x = rosslt.track(2.0, rosslt.Source('/arm', 1))
    buffer = filled(tf.Buffer(debug=False), [(transform('base', 'arm', 1, (x, 0.0, 0.0)), False)])
    with pytest.raises(tf2_ros.LookupException):
        buffer.lookup_transform('base', 'nowhere', rospy.Time(0))
    with pytest.raises(tf2_ros.ExtrapolationException):
        buffer.lookup_transform('base', 'arm', rospy.Time(2))
    buffer.clear()
    with pytest.raises(tf2_ros.TransformException):
        buffer.lookup_transform('base', 'arm', rospy.Time(1))


def test_old_transforms_are_forgotten_as_in_tf2():
    buffers = tf.Buffer(rospy.Duration(2.0), debug=False), tf2_ros.Buffer(rospy.Duration(2.0), debug=False)
    for stamp in range(1, 8):
        x = rosslt.track(float(stamp), rosslt.Source('/arm', 1))
        for buffer in buffers:
            buffer.set_transform(transform('base', 'arm', stamp, (x, 0.0, 0.0)), 'test')
    for stamp in (5.0, 5.5, 7.0):
        found, expected = (buffer.lookup_transform('base', 'arm', rospy.Time.from_sec(stamp)) for buffer in buffers)
        assert_alike(found, expected)
        assert rosslt.is_tracked(found)
    for buffer in buffers:
        with pytest.raises(tf2_ros.ExtrapolationException):
            buffer.lookup_transform('base', 'arm', rospy.Time.from_sec(4.5))


@settings(max_examples=20)
@given(st.integers(0, 1))
def test_a_frame_that_changes_its_parent_agrees_with_tf2(way):
    x = rosslt.track(2.0, rosslt.Source('/arm', 1))
    transforms = [
        (transform('world', 'left', 0, (1.0, 0.0, 0.0)), True),
        (transform('world', 'right', 0, (5.0, 0.0, 0.0)), True),
        (transform(('left', 'right')[way], 'cup', 1, (x, 0.0, 0.0)), False),
        (transform(('right', 'left')[way], 'cup', 3, (x + 1, 0.0, 0.0)), False),
    ]
    ours, theirs = filled(tf.Buffer(debug=False), transforms), filled(tf2_ros.Buffer(debug=False), transforms)
    for stamp in (1.0, 2.0, 3.0, 0.0):
        arguments = 'world', 'cup', rospy.Time.from_sec(stamp)
        assert_alike(ours.lookup_transform(*arguments), theirs.lookup_transform(*arguments))
    assert rosslt.is_tracked(ours.lookup_transform('world', 'cup', rospy.Time(3)))


def test_ints_come_out_as_floats_as_from_tf2():
    whole, buffer = transform('a', 'b', 0.0, (1, 2, 0), (0, 0, 0, 1)), tf.Buffer(debug=False)
    whole.transform.translation.x = rosslt.track(1, rosslt.Source('/b', 1))
    buffer.set_transform_static(whole, 'test')
    found = buffer.lookup_transform('a', 'b', rospy.Time(0)).transform.translation
    assert [type(rosslt.untracked(one)) for one in (found.x, found.y)] == [float, float]
    assert rosslt.sources(found.x) == [rosslt.Source('/b', 1)]
    assert rosslt.solve(found.x, 3.0) == {rosslt.Source('/b', 1): 3}
