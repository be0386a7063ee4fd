"""NumPy's functions on tracked values: the numbers are NumPy's, and provenance is kept."""

import pickle
import resource
from pathlib import Path

import pytest

from rosslt import Source, evaluate, explain, is_tracked, solve, sources, track, untracked
from rosslt.values import OtherShape, keeping_shapes, reapply
from support.numpy_calls import CALLS, MATRIX, PLAIN, VECTOR

np = pytest.importorskip('numpy')
tracked_np = pytest.importorskip('rosslt.numpy')

A, B = Source('/node', 1), Source('/node', 2)
X, Y = track(1.25, A), track(7.0, B)
RANDOM = np.random.RandomState(7)
WIDE = RANDOM.uniform(-2, 2, (2, 4))
STACK = RANDOM.uniform(-2, 2, (4, 3, 3))


def tracked_array(numbers):
    """An array of as many sources as there are numbers."""
    flat = [track(float(number), Source('/node', place)) for place, number in enumerate(np.ravel(numbers))]
    return tracked_np.array(np.array(flat, dtype=object).reshape(np.shape(numbers)))


@pytest.mark.parametrize('name', CALLS)
def test_functions_give_what_numpy_gives_and_keep_provenance(name):
    call, plain = CALLS[name], PLAIN
    expected = call(np, *plain)
    result = call(tracked_np, *map(tracked_array, plain))
    assert np.shape(result) == np.shape(expected)
    np.testing.assert_allclose(np.array(untracked(result), dtype=float), expected, rtol=1e-9, atol=1e-12)
    assert is_tracked(result)
    assert np.array_equal(np.asarray(call(tracked_np, *plain), dtype=float), np.asarray(expected, dtype=float))


@pytest.mark.parametrize('name', ['asarray', 'asanyarray'])
def test_an_order_is_taken_as_the_third_argument(name):
    x = track(2.0, A)
    for thing in ([[x, 1.0], [0.5, 3.0]], tracked_np.array([[x, 1.0], [0.5, 3.0]])):
        made = getattr(tracked_np, name)(thing, float, 'F')
        assert made.flags.f_contiguous
        assert sources(made) == [A]


WITHOUT_ARRAYS = {
    'asarray',
    'full',
    'linspace',
    'linspace open',
    'arange',
    'hypot',
    'array',
    'interp scalar',
    'interp at a point',
}
WITHOUT_ARRAYS |= {'max of a list', 'min of a list', 'abs of a list', 'one of two numbers'}
"""These take scalars and lists, for which NumPy asks nobody."""


@pytest.mark.parametrize('name', sorted(set(CALLS) - WITHOUT_ARRAYS))
def test_numpys_own_functions_work_on_arrays_that_hold_tracked_values(name):
    call, plain = CALLS[name], PLAIN
    result = call(np, *map(tracked_array, plain))
    np.testing.assert_allclose(np.array(untracked(result), dtype=float), call(np, *plain), rtol=1e-9, atol=1e-12)
    assert is_tracked(result)


@pytest.mark.parametrize('function', ['inv', 'det', 'solve'])
def test_linear_algebra_takes_stacks_of_matrices(function):
    arguments = (STACK, STACK[::-1]) if function == 'solve' else (STACK,)
    result = getattr(tracked_np.linalg, function)(*map(tracked_array, arguments))
    expected = getattr(np.linalg, function)(*arguments)
    np.testing.assert_allclose(np.array(untracked(result), dtype=float), expected, rtol=1e-9)
    assert is_tracked(result)


def test_a_result_of_linear_algebra_is_solved_back():
    x, y = track(2.0, A), track(0.5, B)
    matrix = tracked_np.array([[x, 1.0], [y, 3.0]])
    determinant = np.linalg.det(matrix)
    assert evaluate(determinant, solve(determinant, 7.0)) == pytest.approx(7.0)
    answer = solve(np.linalg.solve(matrix, [1.0, 2.0])[0], 0.4, A)
    assert np.linalg.solve([[answer[A], 1.0], [0.5, 3.0]], [1.0, 2.0])[0] == pytest.approx(0.4)


def test_a_zero_that_is_tracked_counts_as_a_number_that_may_change():
    x = track(0.0, A)
    inverse = tracked_np.linalg.inv([[2.0, x], [0.0, 1.0]])
    assert evaluate(inverse[0, 1], {A: 4.0}) == -2.0


INFINITE = {
    'interp at NaN': lambda np, v: np.interp(v[0] + np.nan, [0, 1, 2], [5.0, 6, 7], left=-1.0),
    'interp at a point': lambda np, v: np.interp(v[0] * 0, [0, 1], [2.0, np.inf]),
    'interp at another point': lambda np, v: np.interp(v[0] * 0 + 1, [0, 1, 2], [np.inf, 4.0, 5.0]),
    'interp beside infinity': lambda np, v: np.interp(v[0] * 0 + 0.5, [0, 1, 2], [2.0, np.inf, 3.0]),
    'interp from infinity': lambda np, v: np.interp(v[0] * 0 + 0.5, [0, 1, 2], [-np.inf, 1.0, 3.0]),
    'interp period below 0': lambda np, v: np.interp(v[0] * 9, [10.0, 90, 300], [1.0, 2, 3], period=-360),
    'median of a NaN': lambda np, v: np.median(np.array([np.nan, v[0], v[1]])),
    'median of a NaN at the end': lambda np, v: np.median(np.array([v[0], v[1], 1.0, np.nan])),
    'median of rows': lambda np, v: np.median(np.array([[v[0], v[1], np.nan], [1.0, 3.0, v[2]]]), axis=1),
    'median of columns': lambda np, v: np.median(np.array([[v[0], v[1], np.nan], [1.0, 3.0, v[2]]]), axis=0),
    'norm 3': lambda np, v: np.linalg.norm(v, 3),
    'norm -1': lambda np, v: np.linalg.norm(v, -1),
    'norm -1 of a zero': lambda np, v: np.linalg.norm(np.array([v[0], v[1] * 0]), -1),
    'norm 0.5 of rows': lambda np, v: np.linalg.norm(np.array([v, v * 2]), 0.5, axis=1),
    'norm 2 of a matrix': lambda np, v: np.linalg.norm(np.outer(v, v) + 1, 2),
    'norm -2 of a matrix': lambda np, v: np.linalg.norm(np.array([[v[0], 1.0], [2.0, v[1]]]), -2),
    'nuclear norm': lambda np, v: np.linalg.norm(np.outer(v, v) + 1, 'nuc', keepdims=True),
}


@pytest.mark.parametrize('name', INFINITE)
def test_what_is_no_finite_number_and_all_norms_are_as_in_numpy(name):
    call = INFINITE[name]
    with np.errstate(divide='ignore'):
        expected, result = call(np, VECTOR), call(tracked_np, tracked_array(VECTOR))
    assert np.shape(result) == np.shape(expected)
    np.testing.assert_allclose(np.array(untracked(result), dtype=float), expected, rtol=1e-9, atol=1e-12)


def test_norms_keep_provenance():
    norm = tracked_np.linalg.norm(tracked_array(VECTOR), 3)
    assert evaluate(norm, dict.fromkeys(sources(norm), 1.0)) == pytest.approx(3 ** (1 / 3))
    norm = tracked_np.linalg.norm(tracked_array(MATRIX), 2)
    assert evaluate(norm, dict.fromkeys(sources(norm), 1.0)) == pytest.approx(3.0)


def test_a_singular_matrix_is_refused_as_by_numpy():
    with pytest.raises(np.linalg.LinAlgError, match='Singular'):
        tracked_np.linalg.inv([[track(1.0, A), 2.0], [2.0, 4.0]])
    with pytest.raises(np.linalg.LinAlgError, match='square'):
        tracked_np.linalg.det(tracked_array(WIDE))
    assert tracked_np.linalg.det([[track(1.0, A), 2.0], [2.0, 4.0]]) == 0


def test_what_gives_no_numbers_that_can_be_tracked_is_plain():
    array = tracked_array(VECTOR)
    for result, expected in (
        (np.isfinite(array), np.isfinite(VECTOR)),
        (np.isnan(array), np.isnan(VECTOR)),
        (tracked_np.isnan([track(float('nan'), A), 1.0]), [True, False]),
        (np.isclose(array, VECTOR), [True] * 3),
        (np.fft.fft(array), np.fft.fft(VECTOR)),
        (np.argsort(array), np.argsort(VECTOR)),
        (array > 0, VECTOR > 0),
    ):
        np.testing.assert_allclose(result, expected)
        assert not is_tracked(result)


@pytest.mark.parametrize(
    'made', [tracked_np.zeros(3), tracked_np.ones((2, 3)), tracked_np.identity(3), tracked_np.eye(2)]
)
def test_new_arrays_take_tracked_values(made):
    made[(0,) * made.ndim] = track(0.3, A)
    assert sources(made + 1) == [A]
    made += 1
    made[...] *= 2
    assert sources(made) == [A]
    assert sources(made.astype(np.float32)) == [A]
    assert type(tracked_np.zeros(3) + 1) is np.ndarray


def test_what_another_class_makes_of_tracked_numbers_is_left_to_it():
    class Graph:
        def __array_function__(self, function, types, arguments, options):
            return function.__name__, arguments

    assert tracked_np.array([X, 2.0], like=Graph()) == ('array', ([1.25, 2.0],))


def test_what_holds_nothing_tracked_is_numpys():
    assert tracked_np.zeros((480, 640)).dtype == float
    assert tracked_np.zeros(3, dtype=int).dtype == int
    assert tracked_np.array([track(1.0, A)], dtype='float32').dtype == np.float32
    assert type(tracked_np.array([1.0, 2.0])) is np.ndarray
    assert tracked_np.pi == np.pi
    assert tracked_np.float32 is np.float32
    assert tracked_np.fft is np.fft


def test_slices_share_their_elements():
    array = tracked_np.zeros((2, 2))
    row = array[0]
    row[1] = track(0.3, A)
    assert sources(array[0, 1]) == [A]


def test_an_array_of_floats_that_is_added_to_in_place_stays_plain():
    array = np.ones(3)
    array += tracked_array(VECTOR)
    np.testing.assert_allclose(array, VECTOR + 1)
    assert array.dtype == float


def test_arrays_are_copied_and_pickled_with_provenance():
    array = tracked_np.array([[track(0.3, A), 1.0]])
    for other in (pickle.loads(pickle.dumps(array)), array.copy()):
        assert type(other) is type(array)
        assert other.shape == (1, 2)
        assert explain(other[0, 0]) == explain(array[0, 0])


CALLED = {
    'svd': lambda np, m: np.linalg.svd(m)[1],
    'svd of a symmetric matrix': lambda np, m: np.linalg.svd(m + m.T)[0],
    'eigh': lambda np, m: np.linalg.eigh(m @ m.T)[0],
    'eigenvectors': lambda np, m: np.linalg.eigh(m @ m.T)[1][:, 0],
    'cholesky': lambda np, m: np.linalg.cholesky(m @ m.T + np.eye(3)),
    'qr': lambda np, m: np.linalg.qr(m)[1],
    'lstsq': lambda np, m: np.linalg.lstsq(m[:, :2], m[:, 2], rcond=None)[0],
    'pinv': lambda np, m: np.linalg.pinv(m[:, :2]),
    'stacked inverses': lambda np, m: np.linalg.inv(np.stack([m, m + np.eye(3)])),
    'percentile': lambda np, m: np.percentile(m, 30),
    'gradient': lambda np, m: np.gradient(m[0]),
    'unwrapped': lambda np, m: np.unwrap(m[0] * 9),
}


@pytest.mark.parametrize('name', CALLED)
def test_a_function_that_takes_no_objects_is_called_again_with_other_numbers(name):
    call, matrix = CALLED[name], tracked_array(MATRIX)
    result = call(np, matrix)
    assert np.array_equal(untracked(result), call(np, MATRIX))
    moved = {Source('/node', place): number for place, number in enumerate(np.ravel(MATRIX * 1.01 + 0.001))}
    np.testing.assert_allclose(
        np.array(evaluate(result, moved)), call(np, MATRIX * 1.01 + 0.001), rtol=1e-9, atol=1e-12
    )


def test_what_svd_gives_is_solved_exactly():
    largest = np.linalg.svd(tracked_np.array([[track(2.0, A), 1.0], [0.5, 1.0]]))[1][0]
    assert np.linalg.svd([[solve(largest, 3.0)[A], 1.0], [0.5, 1.0]])[1][0] == pytest.approx(3.0, rel=1e-9)


def riccati(np, q, rounds):
    a, b = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[0.0], [0.1]])
    x = q
    for _ in range(rounds):
        gain = np.linalg.inv(np.eye(1) + b.T @ x @ b) @ (b.T @ x @ a)
        x = q + a.T @ x @ (a - b @ gain)
    return gain


def test_a_long_computation_is_evaluated_by_computing_it_again():
    gain = riccati(np, tracked_np.array([[track(1.0, A), 0.0], [0.0, track(2.0, B)]]), 150)
    expected = riccati(np, np.diag([3.0, 0.5]), 150)
    assert evaluate(gain, {A: 3.0, B: 0.5}) == pytest.approx(expected, rel=1e-9)
    assert 'numerically' in explain(gain[0, 0])
    assert evaluate(gain[0, 0], solve(gain[0, 0], 1.1, A)) == pytest.approx(1.1, rel=1e-9)


def test_an_element_that_an_array_would_not_have_is_undefined():
    count, step = track(4, A), track(0.5, B)
    xs = tracked_np.arange(count) * step
    assert evaluate(xs[1], {A: 2, B: 2.0}) == 2.0
    for other in (0, 1, 3):
        with pytest.raises(ArithmeticError, match='its array would not have that element'):
            evaluate(xs[3], {A: other})
    rising = tracked_np.arange(0.0, 10.0, step)
    assert solve(rising[3], 1.8)[B] == pytest.approx(0.6)
    total = tracked_np.sort(tracked_np.arange(count * 2000) * step).sum()
    assert evaluate(total, {B: 1.0}) == 2 * untracked(total)
    with pytest.raises(ArithmeticError, match='shape'):
        evaluate(total, {A: 3})
    with pytest.raises(ArithmeticError, match='shape'):
        evaluate(tracked_np.linspace(tracked_np.ones(2) * step, 2.0, count)[0, 1], {A: 5})


def test_who_keeps_shapes_gets_no_element_of_another():
    third = tracked_np.arange(track(4, A))[2]
    with keeping_shapes():
        assert reapply(third, {A: 4}) == 2
        with pytest.raises(OtherShape):
            reapply(third, {A: 5})
    assert reapply(third, {A: 5}) == 2


def test_large_arrays_are_one_value():
    height, times = track(2.0, A), np.linspace(0, 10, 100_000)
    curve = height * np.sin(times) + times[::-1]
    assert evaluate(curve[77_777], {A: 3.0}) == 3.0 * np.sin(times[77_777]) + times[-77_778]


def test_elements_of_an_array_are_read_without_a_map_of_its_memory():
    array = tracked_np.array([X, 2.0, Y])
    assert sources(array[0]) == sources(X)
    assert sources(array[-1]) == sources(Y)
    assert not array._memory._codes
    array[2] = 3.0
    assert not sources(array[-1])


def test_an_array_that_feeds_on_itself_is_plain_in_the_end():
    state, step = tracked_np.zeros(2), track(0.5, A)
    for _ in range(9000):
        state = state + step
        assert getattr(state, '_memory', None) is None or next(reversed(state._memory.entries.values())).size <= 8192
    assert state.tolist() == [4500.0, 4500.0]


def test_an_array_that_is_cut_off_is_plain_in_all_its_views():
    array = tracked_array(VECTOR)
    part = array[1:]
    array.forget()
    assert not is_tracked(part)
    assert part.tolist() == VECTOR[1:].tolist()


RAGGED = [[track(1.0, A)], 2.0]


@pytest.mark.parametrize(
    'run',
    [
        lambda np: np.block(RAGGED),
        lambda np: np.histogram2d([0.1, 0.6], [0.1, 0.6], ([track(0.0, A), 0.5, 1.0], 4))[0].tolist(),
        lambda np: np.broadcast_to([track(1, A)], (1 << 32, 2)).strides,
    ],
    ids=['block', 'histogram2d', 'broadcast_to'],
)
def test_what_cannot_be_recorded_gives_what_numpy_gives(run):
    class PlainNumpy:
        def __getattr__(self, name):
            return lambda *arguments: getattr(np, name)(*map(untracked, arguments))

    def outcome(module):
        try:
            return run(module)
        except ValueError as error:
            return str(error)

    assert outcome(tracked_np) == outcome(PlainNumpy())


def test_a_masked_array_of_tracked_elements_is_masked():
    squares = tracked_np.array([0, track(1, A), 4, 9])
    masked = np.ma.array(squares, mask=[False, False, True, False])
    assert np.trapz(masked, [0, 1, 2, 3]) == 0.5
    assert masked.tolist() == [0, 1, None, 9]


def test_an_array_that_numpy_made_keeps_the_order_of_its_elements():
    plain = np.arange(24.0).reshape(2, 3, 4).swapaxes(0, 1) + 0
    array = np.add(plain, track(1.0, A))
    assert array.strides == plain.strides
    assert evaluate(array[1, 0, 2], {A: 2.0}) == plain[1, 0, 2] + 2
    array.flags.writeable = False
    with pytest.raises(ValueError, match='read-only'):
        array[0] = 1.0


def test_a_function_that_returns_its_list_returns_that_list():
    numbers = [track(1.0, A), 2.0]
    assert tracked_np.diff(numbers, n=0) is numbers


def test_views_of_the_same_bytes_as_other_numbers_are_as_those_of_numpy():
    array = tracked_np.array([X, 2.5, 3.0])
    whole = np.array([1.25, 2.5, 3.0])
    assert array.view(np.float32)[1] == whole.view(np.float32)[1]
    assert array.view(np.uint8).sum() == whole.view(np.uint8).sum()
    assert array.view('f8,f8,f8')['f0'][0] == 1.25
    array.view(np.int64)[0] = 0
    assert array[0] == 0.0
    assert not sources(array[0])
    array.dtype = np.float32
    assert array[1] == 0.0


def test_an_array_that_is_converted_without_a_copy_is_itself():
    array = tracked_np.array([X, 2.0])
    same = array.astype(float, copy=False)
    same[0] = Y
    assert sources(array[0]) == sources(Y)


def test_ufuncs_keep_their_methods_and_take_results_wherever_numpy_does():
    array = tracked_np.array([X, 2.0])
    assert tracked_np.maximum.accumulate([1.0, 3.0, 2.0]).tolist() == [1.0, 3.0, 3.0]
    tracked_np.add.at(array, [1], 1.0)
    assert array.tolist() == [1.25, 3.0]
    for subtracted in (tracked_np.subtract(array, X, out=array), tracked_np.subtract(array, 0.0, array)):
        assert subtracted is array
        assert evaluate(array[1], {sources(X)[0]: 2.0}) == 1.0


def test_a_number_in_a_large_array_takes_no_memory_for_the_others():
    def resident():
        pages = int(Path('/proc/self/statm').read_text(encoding='ascii').split()[1])
        return pages * resource.getpagesize()

    before = resident()
    array = tracked_np.zeros(1 << 26)  # half a GiB, of which the machine provides what is written
    array[7] = X
    assert sources(array[7]) == [A]
    assert sources(array[8]) == []
    assert resident() - before < 1 << 26


@pytest.mark.parametrize('again', [evaluate, reapply])
def test_an_element_that_turns_out_to_be_plain_shifts_no_other(again):
    found = tracked_np.array([X, Y, 3 * X]) * 2
    found.view(np.ndarray)[1] = 100.0  # past the array, which finds out when the element is looked up
    assert untracked(again(found, {A: 1.0, B: 5.0})).tolist() == [2.0, 100.0, 6.0]


def test_what_cancels_out_but_for_rounding_keeps_its_sources():
    # a product of matrices may be rounded in another order than its expression
    angle = track(0.3, A)
    turn = tracked_np.array([[tracked_np.cos(angle), -tracked_np.sin(angle)], [tracked_np.sin(angle), np.cos(0.3)]])
    product = turn @ turn.T
    assert abs(product[0, 1]) < 1e-15
    assert sources(product[0, 1]) == [A]
    assert evaluate(product[0, 1], {A: 0.4}) == pytest.approx(np.sin(0.4) * (np.cos(0.4) - np.cos(0.3)))


def test_a_small_number_beside_a_large_one_is_another_one_if_it_was_written_over():
    found = tracked_np.array([X * 1e9, Y]) * 2
    found.view(np.ndarray)[1] += 0.5
    assert sources(found[0]) == [A]
    assert not is_tracked(found[1])
