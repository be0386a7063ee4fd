"""A fault in recording NumPy's calls never reaches the program; writers change the provenance of what they wrote."""

import pickle
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from rosslt import Source, evaluate, is_tracked, solve, sources, track, untracked
from rosslt.values import disassemble, leaves

np = pytest.importorskip('numpy')
tracked_np = pytest.importorskip('rosslt.numpy')


def sourced(numbers):
    """An array with a source for each of its numbers, whose id is the index of the number."""
    flat = [track(float(number), Source('/node', at)) for at, number in enumerate(np.ravel(numbers))]
    return tracked_np.array(flat).reshape(np.shape(numbers))


def ids(array):
    """The ids of the sources of each element."""
    return [{source.location_id for source in sources(one)} for one in np.ravel(array).tolist()]


def sent(x):
    """Encode the provenance of numbers, as `publish` does."""
    return disassemble([leaf for _, leaf in leaves(x)])


def into(shape, function, *arguments, **options):
    out = tracked_np.zeros(shape)
    function(*arguments, out=out, **options)
    return out


STACK = np.arange(8.0).reshape(2, 2, 2) + np.eye(2)
CRASHES = {
    'einsum of an ellipsis': lambda v: np.einsum('...i,...i->...', v, v),
    'einsum of an axis of 1': lambda v: np.einsum('ij,ij->j', v[:1], np.ones((2, 2))),
    'a larger array to write to': lambda v: into((3, 2), np.multiply, v[0], 2),
    'a larger array for a product': lambda v: into((3, 2, 2), np.matmul, v, v),
    'power of a stack': lambda v: np.linalg.matrix_power(STACK * v[0, 0], 2),
    'power of a stack of its own': lambda v: np.linalg.matrix_power(np.stack([v, v + 1]), 3),
    'sign of an array without axes': lambda v: np.sign(v[0, 0, ...]),
    'interp at an array without axes': lambda v: np.interp(v[0, 0, ...], [0, 5], [0.0, 10.0]),
    'solve': lambda v: np.linalg.solve(v, v[0]),
    'a Bessel function': lambda v: np.i0(v),
    'correlations': lambda v: np.corrcoef(v[:, 0], [1.0, 5.0])[1] + np.corrcoef(np.outer(v, v)[:3])[0, 2],
    'unwrapped': lambda v: np.unwrap(v[0] * 9),
    'a range': lambda v: tracked_np.arange(0.0, 4.0 + v[0, 0], v[0, 0])[:2],
    'whole numbers': lambda v: np.reciprocal(v) + np.floor_divide(v, 2.0),
}
MOVED = np.array([[1.25, 2.5], [2.75, 4.5]])


@pytest.mark.parametrize('name', CRASHES)
def test_call_gives_numpys_numbers_and_holds_at_other_source_values(name):
    plain, array = np.array([[1.0, 2.0], [3.0, 4.0]]), sourced([[1.0, 2.0], [3.0, 4.0]])
    result = CRASHES[name](array)
    assert np.array_equal(untracked(result), CRASHES[name](plain))
    assert is_tracked(result)
    assert sources(result)
    sent(result)
    changes = {Source('/node', at): number for at, number in enumerate(MOVED.ravel())}
    np.testing.assert_allclose(evaluate(result, changes), CRASHES[name](MOVED), rtol=1e-9)


def test_solved_system_takes_the_new_matrix():
    array = sourced([[4.0, 1.0], [1.0, 3.0]])
    array[0, 1] = 5.0
    answer = np.linalg.solve(array, [1.0, 2.0])[0]
    assert evaluate(answer, {Source('/node', 0): 25.0}) == pytest.approx(np.linalg.solve([[25, 5], [1, 3]], [1, 2])[0])
    np.fill_diagonal(array, 5.0)
    assert not sources(array[0, 0])
    assert sources(np.linalg.solve(array, [1.0, 2.0])[0]) == [Source('/node', 2)]


def copyto(a, x):
    np.copyto(a, 7.0, where=[True, False, True])


def assigned(a, x):
    a.flat = [7.0, x, 9.0]


OTHER = 9
WRITERS = {
    'copyto': (copyto, [set(), {1}, set()]),
    'copyto of an array': (lambda a, x: np.copyto(a, sourced([5.0, 6.0, 7.0])[::-1]), [{2}, {1}, {0}]),
    'copyto by name': (lambda a, x: np.copyto(src=8.0, dst=a, where=[False, False, True]), [{0}, {1}, set()]),
    'put': (lambda a, x: np.put(a, [1], 7.0), [{0}, set(), {2}]),
    'put of a source': (lambda a, x: np.put(a, [1, 2], [x, 7.0]), [{0}, {OTHER}, set()]),
    'put method': (lambda a, x: a.put([0], x), [{OTHER}, {1}, {2}]),
    'putmask': (lambda a, x: np.putmask(a, [False, True, False], 7.0), [{0}, set(), {2}]),
    'place': (lambda a, x: np.place(a, np.array([True, False, False]), [7.0]), [set(), {1}, {2}]),
    'place of the same number': (lambda a, x: np.place(a, np.array([True, False, False]), [3.0]), [set(), {1}, {2}]),
    'put_along_axis': (lambda a, x: np.put_along_axis(a, np.array([1]), 7.0, 0), [{0}, set(), {2}]),
    'itemset': (lambda a, x: a.itemset(2, 7.0), [{0}, {1}, set()]),
    'at': (lambda a, x: np.add.at(a, [1, 1], 7.0), [{0}, {1}, {2}]),
    'where': (lambda a, x: np.add(a, x, out=a, where=[True, False, False]), [{0, OTHER}, {1}, {2}]),
    'where of numbers': (lambda a, x: np.sqrt([4.0, 4, 4], out=a, where=[False, True, True]), [{0}, set(), set()]),
    'a view': (lambda a, x: np.put(a[1:], [0], 7.0), [{0}, set(), {2}]),
    'flat': (assigned, [set(), {OTHER}, set()]),
    'sort': (lambda a, x: a.sort(), [{0, 1, 2}] * 3),
}


@pytest.mark.parametrize('name', WRITERS)
def test_writer_changes_the_provenance_of_what_it_wrote(name):
    write, expected = WRITERS[name]
    array, plain = sourced([3.0, 1.0, 2.0]), np.array([3.0, 1.0, 2.0])
    write(array, track(7.0, Source('/node', OTHER)))
    write(plain, 7.0)
    assert np.array_equal(untracked(array), plain)
    assert ids(array) == expected
    sent(array)


def test_diagonal_that_is_filled_leaves_the_rest():
    array = sourced(np.eye(2))
    np.fill_diagonal(array, track(7.0, Source('/node', OTHER)))
    assert ids(array) == [{OTHER}, {1}, {2}, {OTHER}]


def test_sorted_array_is_sorted_for_other_source_values():
    array = sourced([3.0, 1.0, 2.0])
    array.sort()
    assert evaluate(array, {Source('/node', 0): 0.0}).tolist() == [0.0, 1.0, 2.0]


METHODS = {
    'sum': lambda x: [np.sum(x), x.sum(axis=None, dtype=None, out=None)],
    'max': lambda x: [x.max(axis=None), np.max(x), x.min(axis=None, out=None), np.min(x)],
    'round': lambda x: [x.round(decimals=1), np.round(x, 1), np.round(x), x.round(1, None)],
    'mean': lambda x: [x.mean(dtype=float), np.mean(x), np.prod(x), x.mean(axis=None)],
    'squeeze': lambda x: [x.squeeze(axis=None), np.squeeze(x), x.copy()],
}


@pytest.mark.parametrize('ask', METHODS.values(), ids=METHODS)
def test_number_takes_what_numpys_number_takes(ask):
    ours, theirs = ask(sourced([1.53])[0]), ask(np.array([1.53])[0])
    assert [untracked(one) for one in ours] == theirs
    assert all(sources(one) for one in ours)


def test_reduction_of_a_number_begins_where_it_is_told():
    number = sourced([1.5])[0]
    assert (number.sum(initial=2.0), number.max(initial=1.0), number.sum(where=False)) == (3.5, 1.5, 0.0)
    assert evaluate(number.max(initial=1.0), {Source('/node', 0): 0.5}) == 1.0
    assert evaluate(np.clip(number, 0.0, 2.0), {Source('/node', 0): 5.0}) == 2.0


def test_maximum_chooses_anew_for_other_source_values():
    a, b = sourced([1.0, 2.0])
    for made in (np.maximum(a, b), np.maximum(sourced([1.0, 2.0])[:1], b)[0], tracked_np.clip(a, b, 9.0)):
        assert evaluate(made, {Source('/node', 0): 5.0}) == 5.0
    assert evaluate(np.maximum(a, b), solve(np.maximum(a, b), 3.0)) == pytest.approx(3.0)


def test_what_is_too_large_to_be_called_again_is_not_tracked():
    array = np.linalg.inv(sourced(np.eye(17) + np.arange(289.0).reshape(17, 17) % 5))
    assert not is_tracked(array[0, 0])
    assert not is_tracked(array)
    assert not sources(array)


def test_threads_write_their_own_elements():
    array = tracked_np.zeros(4)

    def write(at):
        for number in range(3000):
            array[at] = track(float(number), Source('/node', at))

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(4) as pool:
            assert len([*pool.map(write, range(4))]) == 4
    finally:
        sys.setswitchinterval(interval)
    assert ids(array) == [{0}, {1}, {2}, {3}]


def test_array_keeps_its_shape_and_order():
    array = sourced([[1.0, 2.0], [3.0, 4.0]])
    assert pickle.loads(pickle.dumps(array[:0])).shape == (0, 2)
    ours, theirs = array.T, np.array([[1.0, 2.0], [3.0, 4.0]]).T
    ours.resize(4)
    theirs.resize(4)
    assert ours.tolist() == theirs.tolist()
    ours, theirs = np.asfortranarray(np.ones((2, 2))) + array.T, np.asfortranarray(np.ones((2, 2))) + untracked(array).T
    ours.resize(5, refcheck=False)
    theirs.resize(5, refcheck=False)
    assert ours.tolist() == theirs.tolist()


def test_fault_in_recording_is_told_and_costs_the_provenance_alone(monkeypatch):
    from rosslt.values.arrays import graph, memory, tracked_array

    array, told = sourced([1.0, 2.0]), []
    monkeypatch.setattr(graph, 'FAULTS', [lambda name, error: told.append((name, type(error)))])

    def fail(*_):
        raise SystemError

    monkeypatch.setattr(graph, '_traced', fail)
    assert not sources(array * 2)
    monkeypatch.setattr(tracked_array, 'node_of_list', fail)
    monkeypatch.setattr(memory.Memory, 'write', fail)
    array[:] = [array[0], 3.0]
    assert array.tolist() == [1.0, 3.0]
    monkeypatch.setattr(memory.Memory, 'node_of', fail)
    assert (sourced([1.0, 2.0]) + 1).tolist() == [2.0, 3.0]
    assert np.sort(sourced([1.0, 2.0])).tolist() == [1.0, 2.0]
    assert {error for _, error in told} == {SystemError}
    assert len(told) >= 4


def test_array_without_axes_takes_what_is_written_of_a_number():
    array, (number,) = sourced(0.1), sourced([0.3])
    result = tracked_np.clip(number, -0.5, 0.5, out=array)
    assert (float(result), float(array)) == (0.3, 0.3)
    for made in (result, array):
        assert evaluate(made, {Source('/node', 0): 0.7}) == 0.5


def test_array_whose_elements_became_plain_is_written_as_a_plain_one():
    array, plain = sourced([3.0, 1.0]), sourced([5.0, 6.0])
    plain[...] = 7.0
    np.place(array, np.array([True, False]), plain)
    assert ids(array) == [set(), {1}]
    assert untracked(sourced([1.0])[:0].reshape(0, 3)).shape == (0, 3)
