"""Parts of messages, and targets for them."""

import pytest
from geometry_msgs.msg import PointStamped
from std_msgs.msg import Bool, Duration, Float32, Float64, Int8, Int64, String, UInt8MultiArray, UInt64

from rosslt import Source, track
from rosslt.messages import check_range, part_at


def check(message, path, wanted):
    check_range(*part_at(message, path), wanted)


@pytest.mark.parametrize(
    ('message', 'least', 'most'), [(Int8(), -128, 127), (Int64(), -(2**63), 2**63 - 1), (UInt64(), 0, 2**64 - 1)]
)
def test_integers_are_held_up_to_the_limits_of_their_field(message, least, most):
    check(message, 'data', least)
    check(message, 'data', most)
    for beyond in (least - 1, most + 1):
        with pytest.raises(ValueError, match=f'holds {least} to {most}, found {beyond}'):
            check(message, 'data', beyond)


def test_times_are_unsigned_and_durations_are_not():
    check(PointStamped(), 'header/stamp/secs', 2**32 - 1)
    with pytest.raises(ValueError, match='uint32'):
        check(PointStamped(), 'header/stamp/secs', -1)
    check(Duration(), 'data/secs', -(2**31))
    with pytest.raises(ValueError, match='int32'):
        check(Duration(), 'data/secs', 2**31)


def test_numbers_of_32_bits_have_a_largest_one():
    check(Float32(), 'data', -3.4e38)
    check(Float64(), 'data', 1e308)
    with pytest.raises(ValueError, match='numbers of 32 bits'):
        check(Float32(), 'data', 1e39)


def test_elements_of_arrays_and_tracked_values_are_looked_at():
    message = UInt8MultiArray(data=[track(1, Source('/node', 1)), 2])
    check(message, '', UInt8MultiArray(data=[255, None]))
    with pytest.raises(ValueError, match='holds 0 to 255, found 256'):
        check(message, 'data', [0, 256])


@pytest.mark.parametrize(('message', 'wanted'), [(Bool(), True), (String(), 'long'), (Float64(), 10**300)])
def test_what_has_no_limits_is_let_through(message, wanted):
    check(message, 'data', wanted)
