"""The paper's header, as the C++ library writes and reads it."""

import operator

import pytest
from geometry_msgs.msg import Point, Pose, PoseStamped
from std_msgs.msg import Float64, Int32, Int64, String
from visualization_msgs.msg import Marker

from rosslt import Source, evaluate, is_tracked, math, solve, sources, track
from rosslt.messages import BadHeader, LocationHeader, PaperIds, fault_log, from_paper_header, to_paper_header
from rosslt.messages.location_header import Location

NODE = '/interactive_script'
X = track(0.3, Source(NODE, 1))
Y = track(2.0, Source(NODE, 2))


def cpp_apply(value, expression):
    """What the C++ library makes of a source's value: a stack, one token after the other."""
    stack = [value]
    for token in expression.split(';')[:-1]:
        if token in '+-*/':
            last = stack.pop()
            if isinstance(last, str):
                stack[-1] = stack[-1] + last if token == '+' else stack[-1][: -len(last)]
            else:
                stack[-1] = {'+': operator.add, '-': operator.sub, '*': operator.mul, '/': operator.truediv}[token](
                    stack[-1], last
                )
        elif token == 'swap':
            stack[-2:] = reversed(stack[-2:])
        elif token in ('sin', 'cos', 'asin', 'acos'):
            stack[-1] = getattr(math, token)(stack[-1])
        else:
            stack.append(token[1:-1] if token[0] == '"' else type(value)(token))
    return stack[-1]


def converted(leaf, cls=Float64):
    header = to_paper_header(cls(leaf), PaperIds())
    assert header.paths == ['.']
    return header.locations[0]


def read(value, expression, cls=Float64):
    message = cls(value)
    from_paper_header(message, LocationHeader(['.'], [Location('/cpp', 7, expression)]), PaperIds())
    return message.data


def test_fields_are_named_by_paths():
    marker = Marker(points=[Point(0, 0, 0), Point(X, 0, 0)])
    marker.pose.position.z = X
    marker.header.stamp.secs = track(3, Source(NODE, 3))
    header = to_paper_header(marker, PaperIds())
    assert header.paths == ['header/stamp/sec', 'pose/position/z', 'points/1/x']
    assert {location.source_node for location in header.locations} == {NODE}


@pytest.mark.parametrize(
    ('leaf', 'expression'),
    [
        (X, ''),
        (2 * X, '2;*;'),
        (X * 0.1 + 3.5, '0.1;*;3.5;+;'),
        (X + 0.0, ''),
        (math.sin(X), 'sin;'),
        (2.0 / X, '2.0;swap;/;'),
        (-math.cos(2 * X), '2;swap;*;cos;-1;*;'),
        (math.acos(X) - 1, 'acos;1;-;'),
    ],
)
def test_one_source_is_written_as_it_is(leaf, expression):
    location = converted(leaf)
    assert location.expression == expression
    for value in (0.1, 0.9):
        assert cpp_apply(value, location.expression) == pytest.approx(evaluate(leaf, {Source(NODE, 1): value}))


@pytest.mark.parametrize('leaf', [X + Y, 3 * X - Y * 2, X * Y, Y * 0.5 + X, math.sin(X) * math.exp(Y), (X + 1) / Y])
def test_of_several_sources_the_left_most_is_written(leaf):
    location = converted(leaf)
    source = sources(leaf)[0]
    assert location.location_id == source.location_id
    assert cpp_apply({X: 0.3, Y: 2.0}[X if source.location_id == 1 else Y], location.expression) == pytest.approx(
        float(leaf)
    )
    assert cpp_apply(0.7, location.expression) == pytest.approx(evaluate(leaf, {source: 0.7}))


def test_what_the_cpp_library_has_no_operation_for_is_written_as_its_slope():
    leaf = math.exp(X)
    assert cpp_apply(0.3, converted(leaf).expression) == pytest.approx(float(leaf))
    assert cpp_apply(0.3001, converted(leaf).expression) == pytest.approx(math.exp(0.3001), rel=1e-6)


def test_what_cannot_be_written_is_left_out():
    message = Point(0 * X, X // 1, X)
    assert to_paper_header(message, PaperIds()).paths == ['z']


def test_numbers_are_written_with_all_their_digits():
    leaf = X * (1 / 3) + 1e-9
    assert cpp_apply(0.3, converted(leaf).expression) == float(leaf)
    assert '0.333333;' not in converted(leaf).expression


def test_texts_are_written_in_quotes():
    name = track('base', Source(NODE, 5))
    location = converted('robot/' + name + '_link', String)
    assert location.expression == '"robot/";swap;+;"_link";+;'
    assert cpp_apply('arm', location.expression) == 'robot/arm_link'


def test_a_text_that_would_be_misread_is_left_out():
    name = track('base', Source(NODE, 5))
    assert to_paper_header(String(name + '";'), PaperIds()).paths == []


@pytest.mark.parametrize(
    ('value', 'expression', 'source_value'),
    [
        (0.6, '2.000000;*;', 0.3),
        (1.1, '0.333333;*;1.000000;+;', 0.1 / 0.333333),
        (5.0, '3.000000;swap;-;', -2.0),
        (0.5, '4.000000;swap;/;', 8.0),
        (0.0, 'sin;', 0.0),
        (0.25, 'cos;', 1.318116071652818),
        (2.5, '1.000000;2.000000;+;*;', 2.5 / 3),
        (7.0, '', 7.0),
    ],
)
def test_what_the_cpp_library_writes_is_read(value, expression, source_value):
    leaf = read(value, expression)
    assert leaf == value
    assert sources(leaf) == [Source('/cpp', 7)]
    assert evaluate(leaf, {Source('/cpp', 7): source_value}) == pytest.approx(value)
    assert cpp_apply(1.5, expression) == pytest.approx(evaluate(leaf, {Source('/cpp', 7): 1.5}))


def test_a_field_that_was_read_can_be_forced():
    assert solve(read(0.6, '2.000000;*;'), 1.0)[Source('/cpp', 7)] == pytest.approx(0.5)


def test_integers_are_divided_as_cpp_does():
    leaf = read(3, '2;/;', Int32)
    assert evaluate(leaf, {Source('/cpp', 7): 7}) == 3
    assert evaluate(leaf, {Source('/cpp', 7): -7}) == -3


def test_integers_stay_exact():
    location = converted(track(2**62, Source(NODE, 6)) + 1, Int64)
    assert cpp_apply(2**62, location.expression) == 2**62 + 1


def test_texts_are_read_with_semicolons():
    leaf = read('base; link', '"; link";+;', String)
    assert evaluate(leaf, {Source('/cpp', 7): 'arm'}) == 'arm; link'


def test_paths_are_read():
    pose = PoseStamped()
    header = LocationHeader(
        ['pose/position/x', 'header/stamp/nanosec'], [Location('/cpp', 1, ''), Location('/cpp', 2, '')]
    )
    from_paper_header(pose, header, PaperIds())
    assert sources(pose.pose.position.x) == [Source('/cpp', 1)]
    assert sources(pose.header.stamp.nsecs) == [Source('/cpp', 2)]


def test_what_was_written_is_read_again():
    ids = PaperIds()
    pose = Pose(position=Point(X, 2 * X + 1, math.sin(X)))
    received = Pose(position=Point(*(float(each) for each in (X, 2 * X + 1, math.sin(X)))))
    from_paper_header(received, to_paper_header(pose, ids), ids)
    for sent, arrived in (
        (pose.position.x, received.position.x),
        (pose.position.y, received.position.y),
        (pose.position.z, received.position.z),
    ):
        assert sources(arrived) == sources(sent)
        assert evaluate(arrived, {Source(NODE, 1): 0.5}) == pytest.approx(evaluate(sent, {Source(NODE, 1): 0.5}))


def test_ids_of_48_bits_get_ids_of_31_and_are_known_again():
    ids = PaperIds()
    large = [Source(NODE, 5), Source(NODE, 5 + 2**40), Source(NODE, 5 + 2**41), Source('/other', 5)]
    numbers = [ids.number(source) for source in large]
    assert max(numbers) < 2**31
    assert [ids.number(source) for source in large] == numbers
    assert [ids.source(source.node, number) for source, number in zip(large, numbers)] == large
    assert ids.source('/cpp', 3) == Source('/cpp', 3)
    assert ids.number(Source('/cpp', 3)) == 3


@pytest.mark.parametrize(
    ('path', 'expression', 'reason'),
    [
        ('position/w', '', "no field 'w'"),
        ('position', '', 'to a Point'),
        ('position/x/real', '', "no field 'real'"),
        ('position/x', '+;', "found '\\+'"),
        ('position/x', 'swap;', "found 'swap'"),
        ('position/x', 'sinh;', "'sinh'"),
        ('position/x', '__import__;', "'__import__'"),
        ('position/x', '2;', 'leaves the source out'),
        ('position/x', '1;+;' * 10001, '20002 tokens'),
    ],
)
def test_what_is_wrong_is_said_and_the_message_is_as_it_was(path, expression, reason):
    pose = Pose()
    header = LocationHeader(['position/y', path], [Location('/cpp', 1, ''), Location('/cpp', 2, expression)])
    with pytest.raises(BadHeader, match=reason):
        from_paper_header(pose, header, PaperIds())
    assert not is_tracked(pose)


@pytest.mark.parametrize('number', [-1, 2**31])
def test_an_id_that_is_none_is_said(number):
    with pytest.raises(BadHeader, match='location id'):
        from_paper_header(Pose(), LocationHeader(['position/x'], [Location('/cpp', number, '')]), PaperIds())


def test_paths_and_locations_belong_together():
    with pytest.raises(BadHeader, match='1 paths and 0 locations'):
        from_paper_header(Pose(), LocationHeader(['position/x'], []), PaperIds())


def test_a_value_that_its_expression_cannot_make_is_untracked(caplog, monkeypatch):
    monkeypatch.setattr(fault_log, '_said', {})
    assert not is_tracked(read(2.0, 'sin;'))
    assert 'cannot make' in caplog.text
