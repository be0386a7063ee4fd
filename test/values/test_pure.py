"""Functions and classes of other libraries that compute from their arguments alone keep provenance."""

import abc
import copy
import math
import pickle
import sys

import numpy
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


@pytest.fixture
def lost():
    results = []
    arrays.LOST.append(lambda result, _: results.append(result))
    yield results
    arrays.LOST.pop()


class Mine(Rotation):
    pass


def test_a_subclass_of_a_program_is_its_own():
    made = Mine.from_euler('z', track(0.3, YAW))
    assert type(made) is type(made.inv()) is Mine
    assert Mine.__mro__[1:] == (transform.Rotation, object)
    assert issubclass(Mine, Rotation)
    assert not isinstance(Rotation.identity(), Mine)

    class Abstract(Rotation, abc.ABC):
        pass

    assert type(Abstract.identity()) is Abstract


@pytest.mark.parametrize('copied', [copy.copy, copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))])
def test_a_subclass_of_a_program_is_copied(copied):
    made = copied(Mine.from_euler('z', 0.3))
    assert type(made) is Mine
    assert made.magnitude() == pytest.approx(0.3)


def test_a_class_and_its_methods_are_pickled_as_the_librarys(turned):
    assert pickle.loads(pickle.dumps(Rotation)) is transform.Rotation
    assert pickle.loads(pickle.dumps(Rotation.from_quat))([0, 0, 0, 1]).magnitude() == 0.0
    assert pickle.loads(pickle.dumps(turned.apply))([0, 0, 1]).tolist() == turned.apply([0, 0, 1]).tolist()


def test_classes_and_methods_look_like_the_librarys():
    assert issubclass(transform.Rotation, Rotation)
    for name in ('apply', 'from_quat'):
        mine, original = getattr(Rotation, name), getattr(transform.Rotation, name)
        assert (mine.__name__, mine.__doc__) == (original.__name__, original.__doc__)


def test_an_object_with_other_attributes_is_copied_as_usual(turned):
    slerp = Slerp([0.0, 2.0], Rotation.concatenate([Rotation.identity(), turned]))
    assert sources(copy.copy(slerp)(0.5).magnitude()) == [YAW]
    slerp.log, slerp.notes = sys.stdout, [1.0]
    for other in (copy.copy(slerp), arrays.unkept(slerp)):
        assert (other.log, other.notes) == (sys.stdout, slerp.notes)
        assert other.notes is slerp.notes
        assert other(0.5).magnitude() == pytest.approx(0.075)
    with pytest.raises(TypeError, match='cannot pickle'):
        pickle.dumps(slerp)


def test_a_plain_object_that_is_carried_on_is_the_same():
    plain = Rotation.identity(3)
    assert arrays.unkept(plain) is plain


def test_random_numbers_are_drawn_once():
    kind = arrays.pure_class(transform.Rotation, ['random'])
    drawn = []
    for of in (transform.Rotation, kind):
        generator = numpy.random.RandomState(1)
        made = of.random(track(2, REACH), generator)
        sources(made.as_quat()[0, 0])
        drawn.append((made.as_quat().tolist(), generator.rand()))
    assert drawn[0] == drawn[1]
    assert type(made) is kind


def test_a_function_is_called_once_if_its_result_is_not_numbers():
    calls = []

    def called(number):
        calls.append(number)
        return Rotation.identity(), Holder(number)

    arrays.pure(called)(track(1.0, YAW))
    assert calls == [1.0]


def test_a_result_is_plain_if_the_function_writes_to_arguments(lost):
    matrix, right = arrays.of_list([[track(2.0, YAW), 1.0], [0.5, 3.0]], float), numpy.array([1.0, 2.0])
    solve_there = arrays.pure(linalg.solve)
    assert is_tracked(solve_there(matrix, right))
    made = solve_there(matrix, right, overwrite_b=True)
    assert made.tolist() == right.tolist() == linalg.solve([[2.0, 1.0], [0.5, 3.0]], [1.0, 2.0]).tolist()
    assert not is_tracked(made)
    assert lost[0] is made
    unit = arrays.of_list([[track(1.0, YAW), 0.0], [0.0, 3.0]], float).copy('F')
    assert not is_tracked(arrays.pure(linalg.inv)(unit, True))


def test_what_a_function_may_write_to_is_its_own_in_each_call():
    matrix, right = arrays.of_list([[track(2.0, YAW), 1.0], [0.5, 3.0]], float), numpy.arange(4.0)[::2]
    made = arrays.pure(linalg.solve)(matrix, right, overwrite_b=True)
    for first in (4.0, 5.0, 4.0):
        assert evaluate(made[0], {YAW: first}) == pytest.approx(linalg.solve([[first, 1.0], [0.5, 3.0]], [0, 2])[0])


def test_functions_take_arrays():
    made = arrays.pure(linalg.expm)(arrays.of_list([[0.0, track(-0.3, YAW)], [0.3, 0.0]], float))
    assert evaluate(made[0, 1], {YAW: 0.0}) == 0.0
    assert made.tolist() == linalg.expm([[0.0, -0.3], [0.3, 0.0]]).tolist()


def test_a_range_among_the_arguments_keeps_provenance():
    _, made, _ = arrays.pure(interpolate.splrep)(range(4), [track(2.0, REACH), 1.0, 0.0, 1.0], s=0)
    assert evaluate(made[0], {REACH: 7.0}) == pytest.approx(7.0)


def test_errors_are_those_of_the_library(turned):
    for wrong in (lambda: turned.apply([1.0, track(2.0, REACH)]), lambda: Rotation.from_euler('q', track(0.3, YAW))):
        with pytest.raises(ValueError, match=r'Expected|axis'):
            wrong()
