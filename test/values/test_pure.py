"""Functions and classes of other libraries that compute from their arguments alone keep provenance."""

import copy
import math
import pickle

import pytest
from scipy import interpolate, linalg
from scipy.spatial import transform

from rosslt import Source, evaluate, explain, is_tracked, solve, sources, track
from rosslt.values import allow, numpy_arrays, reapply, slopes

arrays = numpy_arrays()
Rotation, Slerp = arrays.pure_class(transform.Rotation), arrays.pure_class(transform.Slerp)
YAW, REACH = Source('/node', 1), Source('/node', 2)


@pytest.fixture
def turned():
    return Rotation.from_euler('z', track(0.3, YAW))


def test_a_call_is_evaluated_by_calling_it_again(turned):
    point = (turned * Rotation.from_euler('x', 0.5)).inv().inv().apply([track(2.0, REACH), 0.0, 0.0])
    assert sources(point[1]) == [YAW, REACH]
    assert evaluate(point[1], {YAW: 1.1, REACH: 3.0}) == pytest.approx(3.0 * math.sin(1.1), rel=1e-14)
    assert solve(point[1], 1.0) == {YAW: pytest.approx(math.asin(0.5))}
    assert slopes([point[0]])[YAW] == (pytest.approx(-2.0 * math.sin(0.3), rel=1e-8),)
    assert explain(turned.magnitude()).startswith('numerically Rotation.magnitude([numerically Rotation.from_euler(0.3')


def test_results_are_those_of_the_library(turned):
    plain = transform.Rotation.from_euler('z', 0.3)
    assert (turned * turned).as_quat().tolist() == (plain * plain).as_quat().tolist()
    assert type(turned.magnitude()).__name__ == 'TrackedFloat'
    assert turned.magnitude() == plain.magnitude()
    assert isinstance(turned, transform.Rotation)
    assert isinstance(plain, Rotation)
    assert type(turned) is Rotation
    assert repr(type(turned)) == repr(transform.Rotation)
    assert type(pickle.loads(pickle.dumps(turned))) is transform.Rotation


def test_plain_objects_keep_what_is_computed_of_them():
    for plain in (Rotation.from_euler('z', 0.5), Rotation([0.0, 0.0, 1.0, 0.0])):
        assert type(plain) is Rotation
        assert not is_tracked(plain.as_quat())
        assert sources(plain.apply([track(2.0, REACH), 0.0, 0.0])) == [REACH]


def test_objects_of_the_library_take_part(turned):
    there = transform.Rotation.from_euler('x', 0.5)
    for made in (turned * there, there * turned, Rotation.concatenate([there, turned])):
        assert YAW in sources(made.as_quat())


def test_several_results_and_objects_in_lists_keep_provenance(turned):
    found, error = Rotation.align_vectors([[track(2.0, REACH), 0.5, 0.0], [0.0, 1.0, 0.0]], [[0, 1, 0], [-1, 0, 0]])
    assert sources(found.as_quat()) == sources(error) == [REACH]
    between = Slerp([0.0, 2.0], Rotation.concatenate([Rotation.identity(), turned]))(0.5)
    assert slopes([between.as_quat()[2]])[YAW] == (pytest.approx(math.cos(0.3 / 8) / 8, rel=1e-8),)


def test_lists_in_results_keep_their_places():
    curve = [arrays.of_list([track(2.0, REACH), 1.0, 2.0, 3.0, 4.5], float), [0.0, 1.0, 0.0, 1.0, 0.0]]
    (_, (xs, ys), _), _ = arrays.pure(interpolate.splprep)(curve, s=0)
    assert evaluate(xs[0], {REACH: 7.0}) == pytest.approx(7.0)
    assert [float(y) for y in ys] == interpolate.splprep([[2.0, 1.0, 2.0, 3.0, 4.5], curve[1]], s=0)[0][1][1].tolist()


def test_copies_keep_provenance(turned):
    for other in (copy.copy(turned), copy.deepcopy(turned)):
        assert sources(other.as_quat()) == [YAW]
    assert not is_tracked(arrays.unkept(turned).as_quat())
    assert sources(turned.as_quat()) == [YAW]


def test_an_object_follows_its_numbers_when_recording_is_stopped(turned):
    numbers = turned.numbers_with_provenance
    other = reapply(numbers[2], {YAW: 1.1}), reapply(numbers[3], {YAW: 1.1})
    before = allow(0)
    try:
        numbers.follow([((2,), other[0]), ((3,), other[1])])
    finally:
        allow(before)
    assert turned.magnitude() == pytest.approx(1.1)
    assert evaluate(turned.magnitude(), {YAW: 0.7}) == pytest.approx(0.7)


def test_an_object_that_is_changed_is_plain_from_then_on():
    both = Rotation.from_euler('z', [track(0.3, YAW), 1.0])
    assert sources(both[0].as_quat()) == [YAW]
    both[1] = Rotation.identity()
    assert not is_tracked(both.as_quat())
    assert both[1].magnitude() == 0.0


class Counter:
    """An object of a library whose method changes it."""

    def __init__(self, count):
        self.count = count

    def step(self, by):
        self.count += by
        return self.count


def test_a_method_that_changes_its_object_does_so_once():
    counter = arrays.pure_class(Counter)(track(1.0, YAW))
    assert counter.step(2.0) == 3.0
    assert counter.count == 3.0
    assert not is_tracked(counter.step(1.0))
    assert counter.count == 4.0


class Holder:
    """An object of a library that holds more than numbers."""

    def __init__(self, number):
        self.number, self.function = number, math.sin

    def value(self):
        return self.function(self.number)


def test_an_object_of_more_than_numbers_is_plain_and_works():
    kind = arrays.pure_class(Holder)
    assert kind(track(1.0, YAW)).value() == math.sin(1.0)
    assert kind(1.0).value() == math.sin(1.0)


def test_a_subclass_of_a_program_is_its_own():
    class Mine(Rotation):
        pass

    made = Mine.from_euler('z', track(0.3, YAW))
    assert type(made) is type(made.inv()) is Mine
    assert not isinstance(Rotation.identity(), Mine)


def test_functions_take_arrays():
    made = arrays.pure(linalg.expm)(arrays.of_list([[0.0, track(-0.3, YAW)], [0.3, 0.0]], float))
    assert evaluate(made[0, 1], {YAW: 0.0}) == 0.0
    assert made.tolist() == linalg.expm([[0.0, -0.3], [0.3, 0.0]]).tolist()


def test_errors_are_those_of_the_library(turned):
    for wrong in (lambda: turned.apply([1.0, track(2.0, REACH)]), lambda: Rotation.from_euler('q', track(0.3, YAW))):
        with pytest.raises(ValueError, match=r'Expected|axis'):
            wrong()
