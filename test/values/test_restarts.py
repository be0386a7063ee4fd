"""Searches that have failed near the present values begin again, anywhere within the bounds."""

import math as plain_math
import random

import pytest

from rosslt import NotInvertible, Source, evaluate, math, solve, track
from rosslt.values import continued
from rosslt.values.accelerator import CORE
from rosslt.values.solve.budget import FASTER, Budget
from rosslt.values.solve.system import System

JOINTS = [Source('/joints', number) for number in range(6)]
# Length, offset and twist of each link of an arm with six joints (Denavit and Hartenberg).
LINKS = [
    (0.0, 0.089159, plain_math.pi / 2),
    (-0.425, 0.0, 0.0),
    (-0.39225, 0.0, 0.0),
    (0.0, 0.10915, plain_math.pi / 2),
    (0.0, 0.09465, -plain_math.pi / 2),
    (0.0, 0.0823, 0.0),
]
BOUNDS = dict.fromkeys(JOINTS, (-3.0, 3.0))


def times(one, other):
    return [[sum(a * b for a, b in zip(row, column)) for column in zip(*other)] for row in one]


def pose(joints):
    """The position of the tip, and the elements of its rotation."""
    found = [[float(row == column) for column in range(4)] for row in range(4)]
    for joint, (length, offset, twist) in zip(joints, LINKS):
        sine, cosine, up, along = math.sin(joint), math.cos(joint), plain_math.sin(twist), plain_math.cos(twist)
        link = [
            [cosine, sine * -along, sine * up, cosine * length],
            [sine, cosine * along, cosine * -up, sine * length],
            [0.0, up, along, offset],
            [0.0, 0.0, 0.0, 1.0],
        ]
        found = times(found, link)
    return [row[column] for column in (3, 0, 1, 2) for row in found[:3]]


def arm(values=(0.0,) * 6):
    return pose([track(value, source) for value, source in zip(values, JOINTS)])


def poses(count, seed=1):
    chance = random.Random(seed)
    return [pose([chance.uniform(-3.0, 3.0) for _ in JOINTS]) for _ in range(count)]


def test_poses_within_reach_are_found_within_the_bounds():
    tip = arm()
    for wanted in poses(12):
        answer = solve(tip, wanted, bounds=BOUNDS)
        assert evaluate(tip, answer) == pytest.approx(wanted, rel=1e-9, abs=1e-9)
        assert all(-3.0 <= value <= 3.0 for value in answer.values())


@pytest.fixture(scope='module', autouse=True)
def as_much_work_as_with_the_core():
    with pytest.MonkeyPatch.context() as patch:
        if CORE is None:
            patch.setattr(Budget, 'of_restarts', lambda graph, of=Budget.of_restarts: Budget(FASTER * of(graph).left))
        yield


@pytest.fixture(scope='module')
def far():
    """Poses that are found only by starting again."""
    found = []
    for wanted in poses(10):
        try:
            solve(arm(), wanted, bounds=BOUNDS, restarts=False)
        except NotInvertible:
            found.append(wanted)
    assert found
    return found


def test_the_same_question_has_the_same_answer(far):
    tip = arm()
    first = [solve(tip, wanted, bounds=BOUNDS) for wanted in far]
    assert [solve(arm(), wanted, bounds=BOUNDS) for wanted in reversed(far)] == first[::-1]


def test_what_is_found_near_by_is_what_is_found_without_restarts(far):
    tip = arm()
    near = [wanted for wanted in poses(12) if wanted not in far]
    assert near
    for wanted in near:
        assert solve(tip, wanted, bounds=BOUNDS) == solve(tip, wanted, bounds=BOUNDS, restarts=False)


def test_an_answer_that_a_restart_found_is_kept(far):
    for wanted in far[:3]:
        answer = solve(arm(), wanted, bounds=BOUNDS)
        moved = arm([answer.get(source, 0.0) for source in JOINTS])
        assert solve(moved, [float(part) for part in moved], bounds=BOUNDS) == {}


def test_angles_without_bounds_are_found_too(far):
    tip = arm()
    for wanted in far:
        assert evaluate(tip, solve(tip, wanted)) == pytest.approx(wanted, rel=1e-9, abs=1e-9)


def test_a_pose_out_of_reach_is_refused_in_the_same_words():
    tip = arm()
    wanted = [2.0, *poses(1)[0][1:]]
    said = []
    for restarts in (True, False):
        with pytest.raises(NotInvertible) as refused:
            solve(tip, wanted, bounds=BOUNDS, restarts=restarts)
        said.append(str(refused.value))
    assert said[0] == said[1]


def test_what_whole_numbers_answer_takes_no_restarts(monkeypatch):
    begun = []
    monkeypatch.setattr(System, 'restarted', lambda system: begun.append(system))
    count, x, y = track(1, Source('/n', 0)), track(0.5, Source('/n', 1)), track(0.25, Source('/n', 2))
    answer = solve([count * 2, x + count, x * y], [4, 3.0, 2.0])
    assert evaluate([count * 2, x + count, x * y], answer) == [4, 3.0, 2.0]
    assert begun == []


def test_a_path_takes_no_restarts_after_its_first_step(far, monkeypatch):
    tip = arm()
    last = continued(tip, far[0], {}, bounds=BOUNDS)
    assert evaluate(tip, last) == pytest.approx(far[0], rel=1e-9, abs=1e-9)
    begun = []
    monkeypatch.setattr(System, 'restarted', lambda system: begun.append(system))
    with pytest.raises(NotInvertible):
        continued(tip, [5.0, *far[0][1:]], last, bounds=BOUNDS)
    assert begun == []
