"""Messages with other source values: what changing bytes gives is what decoding, evaluating and encoding gives."""

import io
import random
import struct

import genpy
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, Pose, PoseArray, PoseStamped, Quaternion
from hypothesis import event, given, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import CompressedImage, Image, Imu, JointState, NavSatFix
from std_msgs.msg import Bool, Float32, Float64, Int32, Int64, String, UInt8
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import Marker, MarkerArray

from rosslt import Source, math, messages, track, values
from support.expressions import expressions, ordinary, pools, texts
from support.filling import Filling, changed

SPEED, TURN, NUMBER, FRAME, LIT = (Source('/planner', number) for number in range(5))
RECORDED = {SPEED: 0.5, TURN: 0.25, NUMBER: 3, FRAME: 'map', LIT: True}
CHANGES = {SPEED: 0.8, NUMBER: 7000, FRAME: 'a much longer frame', LIT: False}
TRACKED = [track(value, source) for source, value in RECORDED.items()]
TYPES = [
    Bool,
    CompressedImage,
    DiagnosticArray,
    Float32,
    Imu,
    Int64,
    JointState,
    JointTrajectory,
    Marker,
    MarkerArray,
    NavSatFix,
    Odometry,
    Path,
    PoseArray,
    String,
    TFMessage,
    UInt8,
]


def in_band(message):
    """A message as it is sent."""
    buff = io.BytesIO()
    message.serialize(buff)
    messages.append_provenance(message, buff)
    return buff.getvalue()


def in_tracked_type(message):
    """A message as it is sent in its tracked type."""
    buff = io.BytesIO()
    messages.wrap(message, messages.tracked_type(type(message))).serialize(buff)
    return buff.getvalue()


def decoded(data, message_class):
    """A message with its provenance, which is right."""
    message, error = messages.decode(data, message_class)
    assert error is None
    return message


def evaluated(data, message_class, changes):
    """A message with other source values, by decoding it; None where there is none."""
    message = decoded(data, message_class)
    fields = messages.tracked_fields(message)
    try:
        new = values.reapply([leaf for _, leaf, _ in fields], changes)
        messages.set_leaves(message, {index: made for (index, _, _), made in zip(fields, new)})
        return decoded(in_band(message), type(message))
    except (ArithmeticError, ValueError, TypeError, genpy.SerializationError):
        return None


def assert_alike(message, wanted, changes):
    """Two messages have the same values, and the same sources, which make the same of other changes."""
    fields, others = messages.tracked_fields(message), messages.tracked_fields(wanted)
    assert [(index, kind) for index, _, kind in fields] == [(index, kind) for index, _, kind in others]
    for (index, leaf, kind), (_, other, _) in zip(fields, others):
        assert values.sources(leaf) == values.sources(other), index
        assert_equal(values.untracked(leaf), values.untracked(other), kind, 0)
        assert_equal(after(leaf, changes), after(other, changes), kind, 1e-12)


def after(leaf, changes):
    """What a value becomes, or the class of the error that says that it has none then."""
    try:
        return values.evaluate(leaf, changes)
    except (ArithmeticError, ValueError, TypeError) as error:
        return type(error).__name__


def assert_equal(value, wanted, kind, tolerance):
    """Two values of a field are equal; decoding rounds to 32 bits before it evaluates, and once more after it."""
    tolerance = 1e-5 if kind == 'f' else tolerance
    if kind in 'df' and not isinstance(wanted, str):
        assert value == pytest.approx(wanted, rel=tolerance, abs=tolerance, nan_ok=True)
    else:
        assert value == wanted


def same_type(value, chance):
    """Another value of the type of a source's."""
    if isinstance(value, int):
        return type(value)(chance.randrange(0, 2 if isinstance(value, bool) else 120))
    return changed(value, chance)


class OwnSources(Filling):
    """Fills messages, each leaf from sources of its own: each source has values of one type, as locations do."""

    def source(self):
        self._count += 1
        return super().source()


@pytest.mark.parametrize('message_class', TYPES, ids=lambda each: each._type)
def test_messages_of_any_type_are_what_evaluating_gives(message_class):
    patched_count = 0
    for seed in range(40):
        message, chance = OwnSources(seed).message(message_class), random.Random(seed)
        leaves = [leaf for _, leaf, _ in messages.tracked_fields(message)]
        recorded = values.source_values(leaves)
        changes = {
            source: same_type(value, chance)
            for source, value in recorded.items()
            if len(recorded) == 1 or seed % 3 or chance.random() < 0.5
        }
        back = {source: recorded[source] for source in changes}
        for data, sent_class in (
            (in_band(message), message_class),
            (in_tracked_type(message), messages.tracked_type(message_class)),
        ):
            found = messages.Patcher(changes).patched(data, sent_class)
            wanted = evaluated(data, sent_class, changes)
            if wanted is None:
                assert found is None
            elif found is not None:
                patched_count += 1
                assert_alike(decoded(found.data, sent_class), wanted, back)
    assert patched_count > 10


@st.composite
def expressed(draw):
    """A message whose fields are made of the same few sources, and other values of some of them."""
    x, y, z = (float(draw(ordinary)) for _ in range(3))
    pool = draw(pools())
    position = [leaf if isinstance(leaf, (int, float)) and abs(leaf) < 1e300 else x for leaf in (pool * 3)[-3:]]
    frame = next((leaf for leaf in pool if isinstance(leaf, str)), 'map')
    message = PoseStamped(
        pose=Pose(position=Point(*position), orientation=Quaternion(x, y, z, draw(expressions(ordinary))))
    )
    message.header.frame_id = frame
    recorded = values.source_values([leaf for _, leaf, _ in messages.tracked_fields(message)])
    changes = {}
    for source, value in recorded.items():
        kind = {bool: st.booleans(), str: texts, int: st.integers(-100, 100)}.get(type(value), ordinary)
        if draw(st.booleans()) or not changes:
            changes[source] = draw(kind)
    return message, changes, {source: recorded[source] for source in changes}


@given(expressed())
@settings(max_examples=300, deadline=None)
def test_random_expressions_are_what_evaluating_gives(drawn):
    message, changes, back = drawn
    data = in_band(message)
    found = messages.Patcher(changes).patched(data, PoseStamped)
    event('patched' if found is not None else 'decoded')
    if found is not None:
        wanted = evaluated(data, PoseStamped, changes)
        assert wanted is not None
        assert_alike(decoded(found.data, PoseStamped), wanted, back)


def ordinary_messages():
    """What nodes send: sums, products, functions, whole numbers, texts and bools."""
    speed, turn, number, frame, lit = TRACKED
    odometry = Odometry(child_frame_id=frame + '/odometry')
    odometry.header.frame_id = frame
    odometry.pose.pose.position = Point(speed * math.cos(turn * 3), speed * math.sin(turn * 3) + 1, 2 * speed + turn)
    odometry.pose.covariance[7] = (speed / 3) ** 2
    marker = Marker(points=[Point(speed * each, turn, each) for each in range(5)], id=number, frame_locked=lit)
    marker.text, marker.ns, marker.color.r = 'at ' + frame, frame, speed / 3
    names = JointState(name=['one', frame, 'three'], position=[speed, turn * speed, number * speed])
    return [
        odometry,
        marker,
        names,
        Float32(math.sin(speed) / 3),
        Int32(2 * number + 1),
        Int64(math.floor(speed * 10) * number),
        Bool(lit),
        String(frame * number),
        PoseArray(poses=[Pose(position=Point(each * speed, speed, 0.0)) for each in range(3)]),
    ]


@pytest.mark.parametrize('message', ordinary_messages(), ids=lambda each: each._type)
@pytest.mark.parametrize('sent', [in_band, in_tracked_type])
def test_ordinary_messages_are_not_decoded(message, sent):
    changes = {**CHANGES, NUMBER: 5} if isinstance(message, String) else CHANGES
    data, sent_class = sent(message), type(message)
    if sent is in_tracked_type:
        sent_class = messages.tracked_type(sent_class)
    found = messages.Patcher(changes).patched(data, sent_class)
    assert found is not None
    assert found.is_changed
    assert not found.is_linearized
    assert_alike(decoded(found.data, sent_class), evaluated(data, sent_class, changes), RECORDED)
    back = messages.Patcher(RECORDED).patched(found.data, sent_class)
    assert back is not None
    recorded, returned = messages.tracked_fields(message), messages.tracked_fields(decoded(back.data, sent_class))
    for (_, leaf, kind), (_, other, _) in zip(recorded, returned):
        assert_equal(values.untracked(other), values.untracked(leaf), kind, 1e-12)


def test_what_depends_on_nothing_that_changes_keeps_its_bytes():
    speed, turn = TRACKED[:2]
    data = in_band(Pose(position=Point(speed, turn, 1.0)))
    for changes in ({Source('/other', 1): 1.0}, {Source('/planner', 77): 1.0}):
        assert messages.Patcher(changes).patched(data, Pose) == (data, False, False)
    assert messages.Patcher(CHANGES).patched(in_band(Pose()), Pose) == (in_band(Pose()), False, False)
    assert messages.Patcher({SPEED: 0.5}).patched(data, Pose) == (data, False, False)


def test_messages_of_many_outlines_in_turn_have_each_its_own_values():
    patcher, speed, turn = messages.Patcher(CHANGES), *TRACKED[:2]
    for step in range(200):
        x = speed * (step % 13) + turn if step % 3 else speed * turn * (step % 13 + 0.5)
        message = Path(poses=[PoseStamped(pose=Pose(position=Point(x, 0.1 * step, 0.0)))] * (1 + step % 4))
        message.header.frame_id = 'f' * (step % 5)
        found = patcher.patched(in_band(message), Path)
        assert found is not None
        assert_alike(decoded(found.data, Path), evaluated(in_band(message), Path, CHANGES), RECORDED)


def test_a_field_of_32_bits_is_what_a_real_run_would_have_sent():
    speed, found = TRACKED[0], []
    for step in range(1, 200):
        data = in_band(Float32(math.sin(speed * step) * 1000))
        patched = messages.Patcher({SPEED: 1e-5}).patched(data, Float32)
        assert patched is not None
        found.append(patched.data[:4] == struct.pack('<f', math.sin(1e-5 * step) * 1000))
    assert all(found)


@pytest.mark.parametrize(
    ('message', 'changes'),
    [
        (Float64(math.sqrt(TRACKED[0])), {SPEED: -1.0}),  # has no value
        (UInt8(2 * TRACKED[2]), {NUMBER: 200}),  # is too large for its field
        (Float64(1 / TRACKED[0]), {SPEED: 0.0}),
        (Int32(math.floor(TRACKED[0] * 3)), {SPEED: 1e300}),
        (Float64(TRACKED[0] * TRACKED[1]), {SPEED: 3}),  # is of another type
    ],
)
def test_what_bytes_cannot_say_is_left_to_decoding(message, changes):
    assert messages.Patcher(changes).patched(in_band(message), type(message)) is None


def test_a_field_that_its_provenance_does_not_make_is_left_to_decoding():
    data = in_band(Float64(TRACKED[0] * TRACKED[1]))
    assert messages.Patcher(CHANGES).patched(data, Float64) is not None
    assert messages.Patcher(CHANGES).patched(struct.pack('<d', 7.0) + data[8:], Float64) is None


def test_a_provenance_that_is_not_right_is_left_to_decoding():
    data = in_band(Pose(position=Point(TRACKED[0] * TRACKED[1], 2 * TRACKED[0] + TRACKED[1], TRACKED[0])))
    patcher, refused = messages.Patcher(CHANGES), 0
    for at in range(56, len(data) - 8):
        for byte in (0, 1, 255, data[at] ^ 1):
            other = data[:at] + bytes([byte]) + data[at + 1 :]
            found = patcher.patched(other, Pose)
            _, error = messages.decode(other, Pose)
            if error is not None:
                refused += 1
                assert found is None or found.data == other
            elif found is not None:
                # What a field does not depend on stays as it was sent, also where its reader would refuse it.
                assert values.untracked(decoded(found.data, Pose)) == values.untracked(evaluated(other, Pose, CHANGES))
    assert refused > 50


def test_bytes_that_only_look_like_a_footer_are_part_of_the_message():
    inner = in_band(Float64(TRACKED[0]))
    message = Image(data=inner)
    assert messages.Patcher(CHANGES).patched(in_band(message), Image) == (in_band(message), False, False)


def test_a_bool_whose_kind_takes_more_bytes_than_it_needs_is_left_to_the_decoder():
    message = Float64(TRACKED[0] * TRACKED[4])
    provenance = messages.encode(message)
    at = provenance.index(b'\x01\x05')  # the kinds of the values: a float, True
    longer = provenance[:at] + b'\x01\x85\x00' + provenance[at + 2 :]
    buff = io.BytesIO()
    message.serialize(buff)
    data = buff.getvalue() + longer + struct.pack('<I4s', len(longer), b'rSLT')
    assert explained(data) == explained(in_band(message))
    assert messages.Patcher({LIT: False}).patched(data, Float64) is None
    assert messages.Patcher({SPEED: 0.8}).patched(data, Float64).is_changed


def explained(data):
    """What a number says of where it comes from."""
    found = messages.decode(data, Float64)
    assert found.error is None
    return values.explain(found.message.data)
