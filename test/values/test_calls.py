"""Users' own operations keep provenance, with their inverse and slope or without."""

import math as plain_math
from typing import NamedTuple

import numpy
import pytest

import rosslt
from rosslt import Source, evaluate, explain, is_tracked, math, solve, sources, track, untracked
from rosslt.values import affine, assemble, disassemble, reapply
from rosslt.values.operations.row import BY_NAME

A, B = Source('/node', 1), Source('/node', 2)


def polynomial(x, y=1.0):
    return x * x * x + 2 * x + y


exact = rosslt.operation(
    polynomial,
    inverse=(None, lambda wanted, x, y=1.0: wanted - x**3 - 2 * x),
    slope=(lambda x, y=1.0: 3 * x * x + 2, lambda x, y=1.0: 1.0),
)
numeric = rosslt.operation(polynomial)


@pytest.mark.parametrize('function', [exact, numeric])
def test_a_call_is_recorded_evaluated_and_solved(function):
    x, y = track(0.5, A), track(2.0, B)
    result = function(x, y)
    assert result == polynomial(0.5, 2.0)
    assert sources(result) == [A, B]
    assert evaluate(result, {A: 1.0}) == 5.0
    for source in (A, B):
        answer = solve(result * 2 + 1, 9.0, source)
        assert evaluate(result * 2 + 1, answer) == pytest.approx(9.0, rel=1e-9)
    assert solve(result, result) == {A: 0.5}
    assert function(0.5) == polynomial(0.5)
    assert not is_tracked(function(0.5))
    assert sources(function(0.5, y=y)) == [B]
    assert evaluate(function(0.5, y=y), {B: 7.0}) == polynomial(0.5, 7.0)


product = rosslt.operation(
    lambda x, y: x * y,
    inverse=(lambda wanted, x, y: wanted / y, lambda wanted, x, y: wanted / x),
    slope=(lambda x, y: y, lambda x, y: x),
)
curve = rosslt.operation(lambda x: x**3, inverse=lambda wanted, x: wanted ** (1 / 3), slope=lambda x: 3 * x * x)


@pytest.mark.parametrize(
    ('result', 'target', 'answer', 'text'),
    [
        (curve(track(2.0, A)), 27.0, {A: 3.0}, '<lambda>(2.0 [/node#1])'),
        (product(track(2.0, A), 3.0), 12.0, {A: 4.0}, '<lambda>(2.0 [/node#1], 3.0)'),
        (product(3.0, track(2.0, A)), 12.0, {A: 4.0}, '<lambda>(3.0, 2.0 [/node#1])'),
        (product(track(2.0, A), track(3.0, B)), 12.0, {A: 4.0}, '<lambda>(2.0 [/node#1], 3.0 [/node#2])'),
    ],
)
def test_what_has_inverse_and_slope_is_recorded_as_a_row_of_the_table_is(result, target, answer, text):
    form = result._record[0]
    assert form.operation.name == '<lambda>'
    assert form.operation.code is None
    assert form.operation.name not in BY_NAME
    assert explain(result) == text
    assert solve(result, target) == {source: pytest.approx(value) for source, value in answer.items()}
    assert solve(2 * result - 1, 2 * target - 1) == {source: pytest.approx(value) for source, value in answer.items()}
    assert evaluate(result, answer) == pytest.approx(target)
    assert explain(reapply(result, {})) == text
    twice = result + track(2.0, A)
    assert evaluate(twice, solve(twice, target)) == pytest.approx(target)
    instructions, (root,) = disassemble([result])
    assert all(instruction[0] in ('source', 'affine') for instruction in instructions)
    assert 'linearized' in explain(assemble(instructions)[root])
    assert affine(result) is None


@pytest.mark.parametrize('wanted', [[2.0, 3.0], 5])
def test_several_results_and_whole_numbers_are_solved_through_a_form_of_two_operands(wanted):
    x, y = track(2.0, A), track(3.0, B)
    results = [product(x, y), x + y] if isinstance(wanted, list) else product(x, y)
    wanted = [10.0, 7.0] if isinstance(wanted, list) else wanted
    assert evaluate(results, solve(results, wanted)) == pytest.approx(wanted, rel=1e-9)


def test_a_wrong_inverse_only_costs_a_search():
    wrong = rosslt.operation(lambda x: x**3, inverse=lambda wanted, x: wanted, slope=lambda x: 3 * x * x)
    result = wrong(track(2.0, A)) + 1.0
    assert evaluate(result, solve(result, 28.0)) == pytest.approx(28.0, rel=1e-9)


@pytest.mark.parametrize(
    ('options', 'message'),
    [
        ({'inverse': 3}, r'polynomial: the inverse for argument 1 is 3, and no function'),
        ({'inverse': (None, 2.0)}, r'polynomial: the inverse for argument 2 is 2.0, and no function'),
        ({'slope': (polynomial, 'x')}, r"polynomial: the slope for argument 2 is 'x', and no function"),
    ],
)
def test_what_is_no_function_is_refused_when_the_operation_is_made(options, message):
    with pytest.raises(TypeError, match=message):
        rosslt.operation(polynomial, **options)


def test_numbers_of_numpy_become_python_numbers():
    square = rosslt.operation(numpy.square, inverse=lambda wanted, x: numpy.sqrt(wanted), slope=lambda x: 2 * x)
    result = square(track(3.0, A)) + 1.0
    assert type(evaluate(result, {A: 4.0})) is float
    assert solve(result, 26.0) == {A: 5.0}
    assert type(solve(result, 26.0)[A]) is float


def test_a_source_that_is_met_twice_is_solved_for():
    x = track(0.5, A)
    result = exact(x, x * 2) + math.sin(x)
    assert evaluate(result, solve(result, 6.0)) == pytest.approx(6.0, rel=1e-9)


def test_several_results_are_solved_together():
    @rosslt.operation
    def polar(x, y):
        return plain_math.hypot(x, y), plain_math.atan2(y, x)

    radius, angle = polar(track(3.0, A), track(4.0, B))
    assert (radius, angle) == (5.0, plain_math.atan2(4, 3))
    answer = solve([radius, angle], [10.0, 0.5])
    assert evaluate([radius, angle], answer) == pytest.approx([10.0, 0.5], rel=1e-9)


@pytest.mark.parametrize('make', [list, tuple, lambda items: numpy.array(items, dtype=object)])
def test_arguments_and_results_may_be_lists_and_arrays(make):
    chain = rosslt.operation(lambda joints, length=1.0: numpy.array([length * sum(joints), joints[0] * joints[1]]))
    sums = chain(make([track(1.0, A), 2.0, track(3.0, B)]), length=2.0)
    assert sums.tolist() == [12.0, 2.0]
    assert sources(sums[0]) == [A, B]
    assert explain(sums[1]) == 'numerically <lambda>([1.0 [/node#1], 2.0, 3.0 [/node#2]], length=2.0)[1]'
    assert evaluate(sums, {A: 2.0}).tolist() == [14.0, 4.0]
    assert solve(list(sums), [20.0, 5.0]) == {A: pytest.approx(2.5), B: pytest.approx(5.5)}


def test_functions_of_libraries_are_operations():
    norm = rosslt.operation(numpy.linalg.norm)
    x, y = track(3.0, A), track(4.0, B)
    length = norm(numpy.array([x, y]))
    assert not is_tracked(length)  # NumPy's own array is one of plain numbers
    length = norm([x, y])
    assert (length, sources(length)) == (5.0, [A, B])
    assert evaluate(length, solve(length, 13.0)) == pytest.approx(13.0)
    halves = rosslt.operation(lambda x: [x / 2, None, x * 2])(x)
    assert [is_tracked(part) for part in halves] == [True, False, True]


def test_the_slope_of_an_argument_that_holds_several_numbers_is_a_sequence():
    calls = []

    def slope(numbers):
        calls.append(numbers)
        return [numbers[1], numbers[0]]

    product = rosslt.operation(lambda numbers: numbers[0] * numbers[1], slope=slope)([track(3.0, A), track(4.0, B)])
    assert explain(product) == '<lambda>([3.0 [/node#1], 4.0 [/node#2]])'
    assert rosslt.values.slopes([product]) == {A: (4.0,), B: (3.0,)}
    assert calls == [[3.0, 4.0]] * 2


class Point(NamedTuple):
    x: float
    label: str


class Robot:
    arm = 2.0

    @rosslt.operation
    def reach(self, angle):
        return self.arm * plain_math.sin(angle)

    @rosslt.operation(slope=(lambda self, x: (1.0,)))
    def point(self, x):
        return Point(x, 'here')


def test_methods_and_named_results():
    reached = Robot().reach(track(0.3, A))
    assert solve(reached, 1.0) == {A: pytest.approx(plain_math.asin(0.5))}
    point = Robot().point(track(1.0, A))
    assert type(point) is Point
    assert point.label == 'here'
    assert sources(point.x) == [A]


def test_explain_names_the_function_and_what_is_numerical():
    x = track(0.5, A)
    assert explain(exact(x, 2.0) * 2) == 'polynomial(0.5 [/node#1], 2.0) * 2'
    assert explain(numeric(x, y=2.0)) == 'numerically polynomial(0.5 [/node#1], y=2.0)'


def test_the_linearization_travels_and_says_so():
    x = track(0.5, A)
    result = exact(math.sin(x), 2.0) + 1
    instructions, (root,) = disassemble([result])
    assert [instruction[0] for instruction in instructions[:2]] == ['source', 'affine']
    again = assemble(instructions)[root]
    assert again == result
    assert 'linearized' in explain(again)
    slope = (3 * plain_math.sin(0.5) ** 2 + 2) * plain_math.cos(0.5)
    assert evaluate(again, {A: 0.6}) == pytest.approx(result + 0.1 * slope)
    assert affine(result) is None


def test_it_is_reapplied_and_folded_like_all_others():
    x = track(0.5, A)
    again = reapply([exact(x, 2.0)], {A: 1.0})[0]
    assert (again, explain(again)) == (5.0, 'polynomial(1.0 [/node#1], 2.0)')
    value = exact(x, 0.0)
    for _ in range(20_000):
        value = value + exact(x * 1e-3, 0.0) * 1e-3
    assert len(disassemble([value])[0]) < 10_000
    assert evaluate(value, {}) == value


class Sample:
    """As a message."""

    __slots__, _slot_types = ['x', 'more'], ['float64', 'float64[]']

    def __init__(self, x, more):
        self.x, self.more = x, more


def test_a_call_keeps_what_its_plain_arguments_were():
    totals = {
        'list': lambda numbers: sum(numbers),
        'array': lambda numbers: float(numbers.sum()),
        'dict': lambda numbers: sum(numbers['all']),
        'message': lambda numbers: numbers.x + sum(numbers.more),
        'tuple': lambda numbers: sum(numbers[0]),
    }
    arguments = {
        'list': [1.0, 2.0],
        'array': numpy.array([1.0, 2.0]),
        'dict': {'all': [1.0, 2.0]},
        'message': Sample(1.0, [2.0]),
        'tuple': ([1.0, 2.0],),
    }
    changed = {'dict': arguments['dict']['all'], 'message': arguments['message'].more, 'tuple': arguments['tuple'][0]}
    for kind, total in totals.items():
        numbers = arguments[kind]
        weighted = rosslt.operation(lambda numbers, gain, total=total: gain * total(numbers))
        exactly_weighted = rosslt.operation(
            lambda numbers, gain, total=total: gain * total(numbers),
            inverse=(None, lambda wanted, numbers, gain, total=total: wanted / total(numbers)),
            slope=(None, lambda numbers, gain, total=total: total(numbers)),
        )
        results = [weighted(numbers, track(2.0, A)), exactly_weighted(numbers, track(2.0, A))]
        changed.get(kind, numbers)[-1] = 100.0
        for result in results:
            assert evaluate(result, {A: 3.0}) == 9.0
            assert solve(result, 9.0) == {A: pytest.approx(3.0)}


def test_a_call_gets_the_arguments_themselves_and_keeps_other_objects():
    class Filter:
        gain = 2.0

        @rosslt.operation
        def step(self, x, log):
            log.append(self)
            return self.gain * x

    lowpass, log = Filter(), []
    result = lowpass.step(track(1.0, A), log)
    assert log == [lowpass]
    lowpass.gain = 3.0
    assert evaluate(result, {A: 2.0}) == 6.0


def test_a_result_that_is_no_number_stays_what_it_is():
    @rosslt.operation
    def table(x):
        return {'x': x}

    assert table(track(1.0, A)) == {'x': 1.0}
    assert untracked(table(track(1.0, A))) == {'x': 1.0}


def test_what_cannot_be_reached_is_refused():
    with pytest.raises(rosslt.NotInvertible, match=r'numerically sine\(0.3 \[/node#1\]\) become 2.0'):
        solve(sine(track(0.3, A)), 2.0)


@rosslt.operation
def sine(x):
    return plain_math.sin(x)
