"""A message that stands still is encoded once; one that differs in any leaf is not taken for it."""

from visualization_msgs.msg import Marker, MarkerArray

import rosslt
from rosslt import messages


def tracked(value, number):
    return rosslt.track(value, rosslt.Source('/node', number))


def array(*heights):
    return MarkerArray([Marker(scale=scale_of(height)) for height in heights])


def scale_of(height):
    scale = Marker().scale
    scale.z = height
    return scale


def test_a_message_that_stands_still_gives_the_same_bytes():
    one, other = tracked(1.0, 1), 2 * tracked(2.0, 2)
    message = array(one, other)
    assert messages.encode(message) == messages.encode(message) == messages.encode(array(one, other))


def test_other_values_places_and_sources_are_told_apart():
    one, other = tracked(1.0, 1), 2 * tracked(2.0, 2)
    first = messages.encode(array(one, other))
    assert messages.encode(array(other, one)) != first
    assert messages.encode(array(one, 2 * tracked(3.0, 2))) != first
    assert messages.encode(array(tracked(1.0, 3), other)) != first
    assert messages.encode(array(one, 0.0, other)) != first
    assert messages.encode(array(one, other), full_history=True) != messages.encode(array(one, 4.0))
    assert messages.encode(array(one, other)) == first
