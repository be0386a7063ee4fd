"""What the rooms above rely on: leaves, terms, instructions, lazy values."""

import math as plain_math

import pytest

from rosslt import Source, evaluate, explain, is_tracked, math, solve, sources, track, untracked
from rosslt.values import (
    AFFINE,
    CONSTANT,
    OPERATIONS,
    SOURCE,
    affine,
    assemble,
    disassemble,
    lazy,
    lazy_of,
    leaves,
    reapply,
)

A, B = Source('/node', 1), Source('/node', 2)
ADD, MUL, SIN, POWER, REPEAT = (OPERATIONS[code] for code in (1, 3, 40, 7, 81))


class Time:
    __slots__ = ('secs', 'nsecs')

    def __init__(self, secs, nsecs):
        self.secs, self.nsecs = secs, nsecs


class Header:
    __slots__ = ('stamp', 'frame')
    _slot_types = ('time', 'string')

    def __init__(self, stamp, frame):
        self.stamp, self.frame = stamp, frame


class Image:
    __slots__ = ('header', 'data', 'sizes')
    _slot_types = ('std_msgs/Header', 'uint8[]', 'float64[]')

    def __init__(self, header, data, sizes):
        self.header, self.data, self.sizes = header, data, sizes


@pytest.fixture
def image():
    return Image(Header(Time(track(5, B), 7), 'map'), b'\x00\x01', [1.0, track(0.3, A)])


def test_leaves_have_paths(image):
    assert leaves(image) == [
        ('header.stamp.secs', 5),
        ('header.stamp.nsecs', 7),
        ('header.frame', 'map'),
        ('data', b'\x00\x01'),
        ('sizes[0]', 1.0),
        ('sizes[1]', 0.3),
    ]
    assert leaves({'a': [1, {'b': 2.0}], 3: ()}) == [("['a'][0]", 1), ("['a'][1]['b']", 2.0)]
    assert leaves(4.0) == [('', 4.0)]
    assert leaves([]) == []


def test_untracked_is_a_deep_copy_without_provenance(image):
    assert is_tracked(image)
    plain = untracked(image)
    assert not is_tracked(plain)
    assert leaves(plain) == leaves(image)
    assert plain.header is not image.header
    assert plain.header.stamp is not image.header.stamp
    assert type(plain.sizes[1]) is float
    assert is_tracked(image)
    assert untracked('a') == 'a'
    assert sources(image) == [B, A]
    assert evaluate(image, {A: 2.0}).sizes == [1.0, 2.0]
    assert solve(image, Image(Header(Time(6, 7), 'map'), b'\x00\x01', [1.0, 0.5])) == {B: 6, A: 0.5}


def test_affine_gives_the_terms_of_what_is_affine():
    x, y = track(0.3, A), track(2.0, B)
    assert affine(x) == ((A, 0.3, 1),)
    assert affine(2 * x - y / 4 + x) == ((A, 0.3, 3), (B, 2.0, -0.25))
    assert affine(x * y) is None
    assert affine(math.sin(x)) is None
    assert affine(track('a', A)) is None
    assert affine(track(True, A)) is None
    assert affine(3.0) == ()
    assert affine(math.degrees(x))[0][2] == pytest.approx(57.29577951308232)


def of_terms(value, *terms):
    """The tracked value that terms describe, as it is made of a received message."""
    return lazy([value], [lambda _: terms])[0]


def test_terms_come_back_as_the_value_they_describe():
    x, y = track(0.3, A), track(2.0, B)
    value = 2 * x - y / 4
    again = of_terms(untracked(value), *affine(value))
    assert affine(again) == affine(value)
    assert solve(again, 1.0) == {A: pytest.approx(solve(value, 1.0)[A])}
    assert explain(of_terms(0.3, *affine(x))) == explain(x)


def test_instructions_hold_shared_parts_once():
    x = track(0.3, A)
    part = math.sin(x)
    instructions, roots = disassemble([part * part, part + 1.5, x, 1.5])
    assert instructions == [(SOURCE, A, 0.3), (SIN, 0), (MUL, 1, 1), (CONSTANT, 1.5), (ADD, 1, 3)]
    assert roots == [2, 4, 0, 3]


def test_the_same_source_read_twice_is_one_instruction():
    instructions, roots = disassemble([track(0.3, A), track(0.3, A), track(0.4, A)])
    assert instructions == [(SOURCE, A, 0.3), (SOURCE, A, 0.4)]
    assert roots == [0, 0, 1]


def test_folded_parts_travel_as_such():
    value = of_terms(1.0, (A, 0.3, 2.0), (B, 1.0, -1.0))
    instructions, roots = disassemble([value * 2])
    assert instructions[2] == (AFFINE, 1.0, ((0, 2.0), (1, -1.0)), True)
    again = assemble(instructions)[roots[0]]
    assert affine(again) == ((A, 0.3, 4.0), (B, 1.0, -2.0))


@pytest.mark.parametrize(
    'instructions',
    [
        [(CONSTANT, 'a' * 100), (CONSTANT, 10**9), (REPEAT, 0, 1)],
        [(CONSTANT, 'a'), (CONSTANT, 10**12), (MUL, 0, 1)],
        [(CONSTANT, '%999999999d'), (CONSTANT, 1), (OPERATIONS[6], 0, 1)],
        [(CONSTANT, 10), (CONSTANT, 10**12), (POWER, 0, 1)],
        [(CONSTANT, 3), *[(MUL, number, number) for number in range(60)]],
        [(CONSTANT, 'a'), (SIN, 0)],
        [(CONSTANT, 1.0), (CONSTANT, 'a'), (ADD, 0, 1)],
        [(ADD, 0, 1)],
        [(CONSTANT, -1.0), (OPERATIONS[20], 0)],
    ],
)
def test_instructions_that_do_not_fit_or_fill_the_memory_are_refused(instructions):
    with pytest.raises((TypeError, ValueError, ArithmeticError, IndexError)):
        assemble(instructions)


@pytest.mark.parametrize('value', [plain_math.inf, plain_math.nan, 0.3])
def test_a_lazy_value_that_was_not_rounded_is_what_it_was_made_of(value):
    x = track(value, A)
    for made, text in ((x * 2, '%r [/node#1] * 2' % value), (x, '%r [/node#1]' % value)):
        (later,) = lazy([untracked(made)], [lambda _, made=made: made])
        assert explain(later) == text
        assert evaluate(later, {A: 0.25}) == evaluate(made, {A: 0.25})


def test_a_lazy_value_is_made_when_it_is_needed():
    x = track(0.3, A)
    made = []

    def load(_):
        made.append(1)
        return x * 2

    (value,) = lazy([0.6], [load])
    assert value == 0.6
    assert is_tracked(value)
    later = value + 1
    assert not made
    assert explain(later) == '0.3 [/node#1] * 2 + 1'
    assert solve(later, 3.0) == {A: 1.0}
    assert affine(value) == ((A, 0.3, 2),)
    assert made == [1]
    number, text = lazy([0.6, 'hi'], [lambda value: ((A, value / 2, 2.0),), lambda value: track(value, B)])
    assert affine(number) == ((A, 0.3, 2.0),)
    assert sources(text) == [B]


@pytest.mark.parametrize('sort', [list, tuple, iter])
def test_lazy_values_of_one_function_are_made_by_their_number(sort):
    plain = [0.6, 7, True, 'hi', 2**80, -0.0]
    asked = []

    def load(value, number):
        asked.append((number, value))
        return track(value, Source('/node', number))

    made = lazy_of(sort(plain), load)
    assert [untracked(value) for value in made] == plain
    assert all(untracked(value) is one for value, one in zip(made, plain))
    assert list(map(type, made)) == [type(track(one, A)) for one in plain]
    assert not asked
    assert [sources(value) for value in made] == [[Source('/node', number)] for number in range(len(plain))]
    assert sorted(set(asked), key=lambda one: one[0]) == list(enumerate(plain))
    assert lazy_of([], load) == []
    for wrong in ([None], [[1.0]], None, 5):
        with pytest.raises((KeyError, TypeError)):
            lazy_of(wrong, load)


def test_a_lazy_value_that_was_rounded_on_its_way_keeps_the_laws():
    x = track(0.3, A)
    for made in (x, math.sin(x), x * 2 + 1):
        rounded = untracked(made) + 1.19e-8
        (value,) = lazy([rounded], [lambda _, made=made: made])
        assert evaluate(value, {}) == rounded
        assert solve(value, rounded) == {A: 0.3}
        answer = solve(value, rounded * 1.1)
        assert evaluate(value, answer) == pytest.approx(rounded * 1.1, rel=1e-9)


def test_reapplying_keeps_provenance():
    x, y = track(0.3, A), track(2.0, B)
    folded = of_terms(1.0, (A, 0.3, 2.0))
    again = reapply({'a': math.sin(x) * y, 'b': [folded, 'plain']}, {A: 0.5})
    assert again['a'] == math.sin(0.5) * 2.0
    assert explain(again['a']) == 'sin(0.5 [/node#1]) * 2.0 [/node#2]'
    assert again['b'][0] == pytest.approx(1.4)
    assert affine(again['b'][0]) == ((A, 0.5, 2.0),)
    assert again['b'][1] == 'plain'
