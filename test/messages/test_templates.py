"""Provenance that is written and read with a template of an earlier one is the same as without it."""

import math
import struct

import pytest
from geometry_msgs.msg import Point, Pose, Twist, Vector3
from hypothesis import given
from hypothesis import strategies as st

from rosslt import Source, is_tracked, sources, track
from rosslt.messages import BadHeader, attach, encode
from rosslt.messages.codec import decoder, encoder
from rosslt.messages.codec.bounded_cache import BoundedCache
from rosslt.messages.codec.templates import Template
from rosslt.values import affine, from_affine
from support.filling import serialized

SOURCES = [Source('/node', 1), Source('/node', 2), Source('/other', 3)]
#: Written as floats or as whole numbers, some equal and not the same; one is not to be sent at all.
numbers = st.sampled_from([0.0, -0.0, 1.0, 1, 0.5, 0.25, -0.5, math.inf]) | st.floats(-10, 10)
#: Of each coordinate the sources that it is made of, in their order.
shapes = st.lists(
    st.permutations(SOURCES).flatmap(lambda order: st.integers(1, 3).map(lambda size: order[:size])),
    min_size=3,
    max_size=3,
)


@pytest.fixture(autouse=True)
def nothing_met():
    forget()


def forget():
    encoder._known_templates.clear()
    decoder._known_headers.clear()


def pose(shape, draw):
    """A pose whose coordinates are made of such sources, those of a single one mostly of that itself."""
    coordinates = []
    for made_of in shape:
        if len(made_of) == 1 and draw(st.booleans()):
            coordinates.append(track(draw(st.floats(-10, 10)), made_of[0]))
        else:
            coordinates.append(
                from_affine(draw(st.floats(-10, 10)), [(source, draw(numbers), draw(numbers)) for source in made_of])
            )
    return Pose(position=Point(*coordinates))


def arrived(message, data):
    result = Pose().deserialize(serialized(message))
    attach(result, data)
    return result


def provenances(message):
    """Of each coordinate the terms; none where they are not finite."""
    terms = [repr(affine(getattr(message.position, axis))) for axis in 'xyz']
    return ['()' if 'inf' in each else each for each in terms]


@given(shapes, st.data())
def test_other_numbers_in_an_outline_are_written_and_read_as_without_it(shape, data):
    alone, together = both_ways(*[pose(shape, data.draw) for _ in range(4)])
    assert together == alone


def both_ways(*messages):
    """Each message's bytes and what arrives of it, alone and after the others."""

    def outcome(message):
        data = encode(message)
        result = provenances(arrived(message, data))
        assert result == provenances(message)
        return data, result

    alone = []
    for message in messages:
        forget()
        alone.append(outcome(message))
    forget()
    return alone, [outcome(message) for message in messages]


A, B = SOURCES[:2]


@pytest.mark.parametrize(
    'coordinates',
    [
        ([(A, 0.0, 0.5)], [(A, -0.0, 0.5)]),
        ([(A, 0.5, 1.0)], [(A, 0.5, 1)]),
        ([(A, 0.5, 0.0)], [(A, 0.5, -0.0)]),
        ([(A, 1, 0.5)], [(A, 1.0, 0.5)]),
    ],
    ids=repr,
)
def test_numbers_that_are_equal_and_not_the_same_have_outlines_of_their_own(coordinates):
    one, other = (from_affine(2.0, terms) for terms in coordinates)
    alone, together = both_ways(*[Pose(position=Point(x, y, 0.0)) for x in (one, other) for y in (one, other)])
    assert together == alone
    assert len({repr(outcome) for outcome in alone}) == 4


def test_values_are_put_where_their_sources_are():
    """A comes first, as what a field is, and gets its value last."""
    alone, together = both_ways(
        *[
            Pose(position=Point(track(5.0, A), from_affine(3.0, [(B, number, 0.5), (A, number + 1, 0.25)]), 0.0))
            for number in (1.5, 2.5)
        ]
    )
    assert together == alone


def moved(angle, at=1.5, node='/node'):
    x, y, radius = (track(value, Source(node, place)) for place, value in enumerate((at, 2.5, 0.75)))
    return Pose(position=Point(x + radius * math.cos(angle), y + radius * math.sin(angle), radius))


def test_what_moves_is_checked_and_written_once(monkeypatch):
    counts = {'written': 0, 'checked': 0}

    def counted(kind, function):
        def call(*arguments):
            counts[kind] += 1
            return function(*arguments)

        return call

    monkeypatch.setattr(encoder._Encoder, '__init__', counted('written', encoder._Encoder.__init__))
    monkeypatch.setattr(decoder, 'read_header', counted('checked', decoder.read_header))
    for step in range(1, 50):
        message = moved(0.01 * step, at=0.1 * step)
        result = arrived(message, encode(message))
        assert provenances(result) == provenances(message)
    assert counts == {'written': 1, 'checked': 1}


def test_publishers_with_outlines_of_the_same_length_do_not_mix():
    for step in range(1, 5):
        for node in ('/node', '/edon', '/nope'):
            message = moved(0.1 * step, node=node)
            assert sources(arrived(message, encode(message)).position.x)[0].node == node


def test_many_publishers_are_told_apart_too():
    for _ in range(2):
        for number in range(100, 150):
            message = moved(0.1, node='/node_%d' % number)
            assert sources(arrived(message, encode(message)).position.y)[0].node == '/node_%d' % number


def test_a_float_that_is_not_finite_is_refused_in_a_known_outline():
    data = encode(moved(0.1))
    arrived(moved(0.1), data)
    spoilt = data.replace(b'\0\0\0\0\0\0\xf8\x3f', b'\0\0\0\0\0\0\xf8\x7f')
    assert len(spoilt) == len(data) != 0
    with pytest.raises(BadHeader, match='not finite'):
        arrived(moved(0.1), spoilt)


def test_what_cannot_be_sent_is_left_out_of_a_known_outline(caplog):
    encode(moved(0.1))
    message = moved(0.1, at=-math.inf)
    result = arrived(message, encode(message))
    assert not is_tracked(result.position.x)
    assert provenances(result)[1:] == provenances(message)[1:]
    assert '-inf, which is not finite' in caplog.text


def test_an_outline_is_of_its_message_class():
    message = moved(0.1)
    data = encode(message)
    arrived(message, data)
    twist = Twist(linear=Vector3(0.5, 1.0, 2.0))
    attach(twist, data)
    assert affine(twist.linear.x) == affine(message.position.x)
    assert not is_tracked(message.orientation)


def test_a_template_is_cut_only_where_the_floats_are():
    data = bytes(range(60))
    template = Template.cut(data, 3, 2, 25, 1)
    values, slopes = struct.unpack('<2d', data[3:19]), struct.unpack('<d', data[25:33])
    assert template.match(data) == (values, slopes)
    assert template.fill(values, slopes) == data
    for blocks in [(-1, 2, 25, 1), (3, 3, 25, 1), (3, 2, 18, 1), (3, 2, 25, 5), (25, 1, 3, 2)]:
        with pytest.raises(ValueError, match='floats at bytes'):
            Template.cut(data, *blocks)


@pytest.mark.parametrize('change', [lambda data: data[:-1], lambda data: data + b'\0', lambda data: b'x' + data[1:]])
def test_data_of_another_size_or_with_other_bytes_around_the_floats_match_no_template(change):
    data = bytes(range(60))
    assert Template.cut(data, 3, 2, 25, 1).match(change(data)) is None


def test_a_bounded_cache_forgets_what_came_first():
    cache = BoundedCache(3)
    for number in range(5):
        cache.put(number, str(number))
    assert [cache.get(number) for number in range(5)] == [None, None, '2', '3', '4']
    cache.put(3, 'other')
    assert cache.get(3) == 'other'
    cache.clear()
    assert cache.get(3) is None
