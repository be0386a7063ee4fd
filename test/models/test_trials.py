"""Which outputs depend on which inputs, found by trying: functions whose dependencies are known."""

import json

import numpy as np
import pytest

from rosslt.models import learn


class Counted:
    """A function of rows that counts the rows."""

    def __init__(self, function, noise=0.0):
        self.function, self.noise, self.count = function, noise, 0
        self.random = np.random.RandomState(7)
        self.rows = []

    def __call__(self, rows):
        self.count += len(rows)
        self.rows.extend(rows)
        result = np.asarray(self.function(rows), dtype=float)
        return result + self.noise * self.random.randn(*result.shape)


def of_one(function, start, size=1.0, **options):
    """The dependency of a function of one number."""
    learned = learn(Counted(lambda rows: function(rows)), [start], [size], **options)
    assert [(found.output, found.input) for found in learned.dependencies] == [(0, 0)]
    return learned.dependencies[0]


def pairs(learned):
    return {(found.output, found.input) for found in learned.dependencies}


def sparse(random, inputs=200, mattering=10, outputs=5, share=0.5):
    """A random Jacobian in which few inputs matter, each for at least one output."""
    jacobian = np.zeros((outputs, inputs))
    chosen = random.choice(inputs, mattering, replace=False)
    matters = random.rand(outputs, mattering) < share
    matters[random.randint(outputs, size=mattering), np.arange(mattering)] = True
    jacobian[:, chosen] = np.where(
        matters, random.choice([-1, 1], matters.shape) * random.uniform(0.2, 2, matters.shape), 0
    )
    return jacobian


def found_in_random_runs(runs, most, bend=0.0, noise=0.0, share=0.5):
    """Learns random functions: dependencies that there are, are found, are false; relative errors."""
    there, found, false, errors = 0, 0, 0, []
    for seed in range(runs):
        random = np.random.RandomState(seed)
        jacobian = sparse(random, share=share)
        start = random.randn(200)
        bends = bend * random.randn(*jacobian.shape) * (jacobian != 0)

        def function(rows, jacobian=jacobian, start=start, bends=bends):
            linear = (rows - start) @ jacobian.T
            return 1 + linear + ((rows - start) ** 2) @ bends.T + bend * np.sin(linear) ** 2

        ask = Counted(function, noise)
        learned = learn(ask, start, np.ones(200), most=most, seed=seed)
        assert learned.trials == ask.count <= most
        truth = set(zip(*np.nonzero(jacobian)))
        there += len(truth)
        found += len(truth & pairs(learned))
        false += len(pairs(learned) - truth)
        errors += [
            (abs(each.slope / jacobian[each.output, each.input] - 1), each.uncertainty / abs(each.slope))
            for each in learned.dependencies
            if np.isfinite(each.slope) and (each.output, each.input) in truth and each.slope
        ]
    return there, found, false, np.array(errors)


@pytest.mark.parametrize('bend', [pytest.param(0.0, marks=pytest.mark.slow), 0.1])
@pytest.mark.parametrize('share', [0.4, pytest.param(1.0, marks=pytest.mark.slow)])
def test_ten_of_200_inputs_are_found_in_60_trials(bend, share):
    there, found, false, errors = found_in_random_runs(100, 60, bend=bend, share=share)
    assert false == 0
    assert found >= 0.95 * there
    assert len(errors) >= 0.9 * there
    assert np.max(errors[:, 0]) <= 1e-3


@pytest.mark.parametrize('noise', [1e-6, 1e-4, 1e-2])
def test_noise_makes_no_dependency_and_its_error_is_told(noise):
    there, found, false, errors = found_in_random_runs(30, 120, noise=noise)
    assert false == 0
    assert found >= 0.95 * there
    assert np.mean(errors[:, 0] <= 4 * errors[:, 1]) > 0.99
    assert np.median(errors[:, 0]) <= 3 * np.sqrt(noise)


def test_an_arm_in_which_all_joints_matter():
    axes = np.random.RandomState(3).randn(7, 3)

    def tip(angles):
        place, turn = np.zeros(3), np.eye(3)
        for angle, axis in zip(angles, axes):
            x, y, z = axis / np.linalg.norm(axis)
            cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            turn = turn @ (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
            place = place + turn @ [0.1, 0.05, 0.3]
        return [*place, turn[2, 1], turn[0, 2], turn[1, 0]]

    start = np.linspace(-0.7, 0.9, 7)
    ask = Counted(lambda rows: [tip(row) for row in rows])
    learned = learn(ask, start, np.full(7, 0.2))
    steps = 1e-6 * np.eye(7)
    truth = np.array([(np.array(tip(start + step)) - tip(start - step)) / 2e-6 for step in steps]).T
    assert np.allclose(learned.slopes(7), truth, rtol=1e-3, atol=1e-6)
    assert ask.count <= 110


def test_nothing_is_found_where_nothing_depends():
    learned = learn(Counted(lambda rows: np.ones((len(rows), 3))), np.zeros(200), np.ones(200))
    assert learned.dependencies == learned.untried == learned.unrepeatable == ()
    assert learned.trials == 6


def test_pure_noise_is_unrepeatable():
    for seed in range(30):
        ask = Counted(lambda rows: rows[:, [0, 0]] * [1, 0], noise=1e-3)
        ask.random = np.random.RandomState(seed)
        learned = learn(ask, np.zeros(50), np.ones(50))
        assert pairs(learned) == {(0, 0)}
        assert learned.unrepeatable == (1,)


def test_an_output_that_drifts_has_shown_nothing():
    ask = Counted(lambda rows: np.stack([rows[:, 0], 50.0 * ask.count + np.arange(len(rows))], 1))
    learned = learn(ask, [0.1, 0.2], [1, 1])
    assert 1 in learned.unrepeatable
    assert pairs(learned) == {(0, 0)}


def test_inputs_that_cancel_each_other_are_found():
    learned = learn(Counted(lambda rows: rows[:, :1] - rows[:, 1:2]), [0.3, 2, 5], [1, 1, 1])
    assert np.allclose(learned.slopes(3), [[1, -1, 0]], atol=1e-6)


def test_one_of_two_inputs_matters():
    learned = learn(Counted(lambda rows: np.sin(rows[:, 1:])), [0.3, 0.3], [1, 1])
    assert pairs(learned) == {(0, 1)}
    assert learned.dependencies[0].slope == pytest.approx(np.cos(0.3), rel=1e-6)


@pytest.mark.parametrize('start', [(0, 2), (0, 0)])
def test_a_factor_of_zero_hides_no_dependency(start):
    learned = learn(Counted(lambda rows: rows[:, :1] * rows[:, 1:]), start, [1, 1])
    assert pairs(learned) == {(0, 0), (0, 1)}
    assert np.allclose(learned.slopes(2), [[start[1], start[0]]], atol=1e-6)
    assert learned.dependencies[1].kind == 'coupled'


def test_a_switch_hides_no_dependency():
    ask = Counted(lambda rows: np.where(rows[:, :1] > 0.5, rows[:, 1:], 0))
    options = {'bounds': [[0, 1], [-9, 9]], 'whole': [True, False]}
    assert pairs(learn(ask, [1, 2], [1, 1], **options)) == {(0, 0), (0, 1)}
    assert pairs(learn(ask, [0, 2], [1, 1], **options)) == {(0, 0), (0, 1)}


def test_whole_inputs_change_by_whole_steps_within_bounds():
    ask = Counted(lambda rows: rows @ np.array([[2.0], [1.0]]))
    learned = learn(ask, [3, 1], [2.5, 5], bounds=[[0, 4], [1, 7]], whole=[True, False])
    rows = np.array(ask.rows)
    assert np.all(rows[:, 0] == np.round(rows[:, 0]))
    assert np.all((rows >= [0, 1]) & (rows <= [4, 7]))
    assert np.allclose(learned.slopes(2), [[2, 1]], rtol=1e-3)


@pytest.mark.parametrize(
    ('function', 'start', 'slope'),
    [
        (lambda x: 3 * x, 0.3, 3),
        (np.sin, 0.3, np.cos(0.3)),
        (lambda x: np.exp(3 * x), 0.3, 3 * np.exp(0.9)),
        (lambda x: x**3 - x, 0.5, -0.25),
        (lambda x: x**2, 0.0, 0),
        (lambda x: np.clip(x, -0.5, 0.5), 0.1, 1),
        (lambda x: x + (x > 0.3), 0.0, 1),
    ],
)
def test_first_order_holds_in_the_range_that_is_told(function, start, slope):
    found = of_one(function, start)
    assert found.kind == 'smooth'
    assert found.slope == pytest.approx(slope, rel=1e-3, abs=1e-6)
    assert found.low <= 0 <= found.high
    for step in (found.low, found.high):
        moved = function(np.array(start + step)) - function(np.array(start))
        assert abs(moved - slope * step) <= 0.051 * abs(slope * step) + 1e-9


@pytest.mark.parametrize(
    ('kind', 'function', 'start', 'sides'),
    [
        ('saturated', lambda x: np.clip(x, -0.5, 0.5), 0.5, (1, 0)),
        ('saturated', lambda x: np.clip(x, -0.5, 0.5), 0.8, (0, 0)),
        ('saturated', lambda x: np.sign(x) * np.maximum(np.abs(x) - 0.3, 0), 0.1, (0, 0)),
        ('kinked', np.abs, 0.0, (-1, 1)),
        ('discontinuous', np.sign, 0.0, None),
        ('discontinuous', np.sign, 0.4, None),
        ('discontinuous', lambda x: x + (x > 0), 0.0, None),
        ('stepped', lambda x: np.round(x, 1), 0.123, None),
        ('stepped', lambda x: np.round(x, 1), 0.05, None),
        ('stepped', lambda x: np.round(x, 2), 0.12345, None),
        ('stepped', lambda x: np.round(x, 3), 0.12345, None),
        ('stepped', lambda x: np.round(x, 4), 0.123456, None),
    ],
)
def test_what_has_no_slope_is_told_by_its_kind(kind, function, start, sides):
    found = of_one(function, start)
    assert found.kind == kind
    assert np.isnan(found.slope)
    if sides is None:
        assert np.isnan([found.left, found.right]).all()
    else:
        assert (found.left, found.right) == pytest.approx(sides, rel=1e-3)


def test_quantization_finer_than_the_steps_is_in_the_uncertainty():
    found = of_one(lambda x: np.round(x, 5), 0.12345678)
    assert abs(found.slope - 1) <= 2 * found.uncertainty


def test_numbers_of_32_bits_are_no_steps():
    found = of_one(lambda x: np.float32(3.3 * x), 0.1)
    assert found.kind == 'smooth'
    assert found.slope == pytest.approx(3.3, rel=1e-3)


def test_answers_that_get_lost_are_asked_for_again():
    lost = iter([0, 0, 0] + [1, 0, 0, 0, 0] * 40)
    ask = Counted(lambda rows: [[np.nan if next(lost) else 2 * row[0]] for row in rows])
    learned = learn(ask, [0.1, 0.2], [1, 1])
    assert learned.unanswered == ()
    assert np.allclose(learned.slopes(2), [[2, 0]], rtol=1e-3)


def test_an_input_that_takes_the_answer_away_is_told():
    def function(rows):
        result = np.stack([rows[:, 7] * 3.3, np.sin(rows[:, 31]) + rows[:, 2]], 1)
        result[(rows[:, 20] > 0.3) | (rows[:, 11] < -0.2)] = np.nan
        return result

    learned = learn(Counted(function), np.zeros(40), np.ones(40))
    assert learned.unanswered == (11, 20)
    assert pairs(learned) == {(0, 7), (1, 31), (1, 2)}


def test_no_answer_at_all():
    learned = learn(Counted(lambda rows: np.full((len(rows), 2), np.nan)), [0.1], [1])
    assert learned.unrepeatable == (0, 1)
    assert np.all(np.isnan(learned.slopes(1)))


def test_what_was_not_tried_is_told():
    ask = Counted(lambda rows: rows)
    learned = learn(ask, np.zeros(100), np.ones(100), most=30)
    assert ask.count <= 30
    assert {found.input for found in learned.dependencies} | set(learned.untried) == set(range(100))


@pytest.mark.parametrize('kind', ['hysteresis', 'set and reset', 'toggle'])
def test_a_memory_of_inputs_makes_no_dependency(kind):
    for seed in range(60):
        random = np.random.RandomState(seed)
        slopes = np.where(np.arange(20) < 3, random.uniform(1, 2, 20), 0)
        on, off = random.uniform(0.05, 0.95, 2)
        memory = {'state': 0.0, 'was_high': False}

        def function(row, slopes=slopes, on=on, off=off, memory=memory):
            is_high = row[5] > on
            if kind == 'toggle':
                memory['state'] = abs(memory['state'] - (is_high and not memory['was_high']))
            elif is_high:
                memory['state'] = 1.0
            if (kind == 'hysteresis' and row[5] < -off) or (kind == 'set and reset' and row[6] > off):
                memory['state'] = 0.0
            memory['was_high'] = is_high
            return [row @ slopes + memory['state'], row @ slopes]

        ask = Counted(lambda rows, function=function: [function(row) for row in rows])
        learned = learn(ask, np.zeros(20), np.ones(20), seed=seed, confirms=True)
        truth = {(output, index) for output in (0, 1) for index in range(3)} | {(0, 5)}
        truth |= {(0, 6)} if kind == 'set and reset' else set()
        assert pairs(learned) <= truth
        assert {(1, 0), (1, 1), (1, 2)} <= pairs(learned)
        assert learned.trials == ask.count <= 200


def test_the_result_becomes_json():
    learned = learn(Counted(lambda rows: np.abs(rows)), [0.0], [1])
    document = json.loads(json.dumps(learned.as_json(), allow_nan=False))
    assert document['dependencies'][0]['kind'] == 'kinked'
    assert document['dependencies'][0]['slope'] is None
    assert document['trials'] == learned.trials


def test_a_start_out_of_bounds_is_refused():
    with pytest.raises(ValueError, match='out of bounds'):
        learn(Counted(lambda rows: rows), [2.0], [1], bounds=[[0, 1]])
    with pytest.raises(ValueError, match='shape'):
        learn(Counted(lambda rows: rows), [2.0], [1, 1])
