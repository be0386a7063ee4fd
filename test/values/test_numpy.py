"""Tracked values in NumPy's arithmetic."""

import math as plain_math
import operator as op

import pytest

from rosslt import Source, evaluate, explain, is_tracked, math, solve, sources, track, untracked
from rosslt.values import leaves, numpy_functions

np = pytest.importorskip('numpy')

A, B = Source('/node', 1), Source('/node', 2)


@pytest.fixture
def x():
    return track(0.5, A)


@pytest.fixture
def y():
    return track(2.0, B)


SCALARS = [np.float64(2), np.float32(2), np.int64(2), np.uint8(2), np.bool_(True), np.array(2.0)]


@pytest.mark.parametrize('other', SCALARS, ids=lambda other: type(other).__name__)
def test_numpy_scalars_on_either_side(x, other):
    results = [
        (x * other, 0.5 * float(other)),
        (x - other, 0.5 - float(other)),
        (x / other, 0.5 / float(other)),
        (x**other, 0.5 ** float(other)),
    ]
    if type(other) is not np.float64:
        results += [
            (other * x, 0.5 * float(other)),
            (other - x, float(other) - 0.5),
            (other / x, float(other) / 0.5),
            (other ** (x + 0.25), float(other) ** 0.75),
        ]
    for result, expected in results:
        assert result == expected
        assert sources(result) == [A]
        assert solve(result, expected) == {A: 0.5}


@pytest.mark.parametrize('other', SCALARS[2:5], ids=lambda other: type(other).__name__)
@pytest.mark.parametrize('operator', [op.lshift, op.rshift, op.and_, op.or_, op.xor, op.eq, op.lt])
def test_operators_on_bits_and_comparisons_give_what_numpy_gives(operator, other):
    n = track(4, A)
    for result, wanted in ((operator(other, n), operator(other, 4)), (operator(n, other), operator(4, other))):
        assert untracked(result) == wanted


def test_operators_on_bits_of_floats_are_refused_as_numpy_does(x):
    for other in (*SCALARS[:3], np.array([1.0, 2.0])):
        with pytest.raises(TypeError, match='not supported'):
            other << x


@pytest.mark.parametrize(
    'number', [np.complex64(2j), np.complex128(2j), np.array([2j]), np.array([1, 2j], dtype=object)]
)
@pytest.mark.parametrize('operator', [op.add, op.sub, op.mul, op.truediv])
def test_complex_numbers_and_arrays_give_what_numpy_gives(operator, number, x):
    for result, wanted in ((operator(number, x), operator(number, 0.5)), (operator(x, number), operator(0.5, number))):
        assert np.all(untracked(result) == wanted)


def test_what_numpy_computes_without_asking_is_plain_and_right(x):
    for result, expected in (
        (np.float64(2) * x, 1.0),
        (np.float64(2) - x, 1.5),
        (sum([np.float64(1), x]), 1.5),
        (np.array([4.0]) ** x, [2.0]),  # NumPy takes the square root
    ):
        assert result == expected
    assert sources(float(np.float64(2)) * x) == [A]
    assert sources(x * np.float64(2)) == [A]
    assert sources(np.multiply(np.float64(2), x)) == [A]


def test_comparisons_with_numpy_scalars_are_plain(x):
    assert np.float64(0.4) < x
    assert not x > np.float64(0.6)
    assert x == np.float64(0.5)
    assert list(np.array([0.4, 0.6]) < x) == [True, False]


def test_a_numpy_scalar_can_be_tracked():
    assert repr(track(np.float64(0.5), A)) == '0.5'
    assert repr(track(np.int32(5), A)) == '5'
    assert repr(track(np.bool_(True), A)) == 'True'


@pytest.mark.parametrize('array', [np.array([1.0, 2.0]), np.array([1, 2], dtype=object), np.array([[1.0], [2.0]])])
def test_arrays_on_either_side_keep_provenance(x, array):
    for result, expected in (
        (x * array, 0.5 * array),
        (array * x, array * 0.5),
        (array - x, array - 0.5),
        (x / array, 0.5 / array),
        (x**array, 0.5**array),
        (array // x, array // 0.5),
    ):
        assert result.dtype == array.dtype
        assert result.shape == array.shape
        assert (result == expected).all()
        assert all(sources(element) == [A] for element in result.ravel().tolist())


UFUNCS = """
    sin cos tan arcsin arccos arctan sinh cosh tanh arcsinh arctanh exp exp2 expm1 log log2 log10 log1p sqrt
    cbrt fabs absolute negative degrees radians rad2deg deg2rad floor ceil trunc rint square reciprocal
    positive
"""
OF_TWO = """
    add subtract multiply divide power arctan2 hypot fmod copysign remainder floor_divide maximum minimum
"""


@pytest.mark.parametrize('name', UFUNCS.split())
def test_ufuncs_of_scalars_and_of_object_arrays(name, x):
    function = getattr(np, name)
    result = function(x)
    assert result == pytest.approx(function(0.5), rel=1e-14)
    assert sources(result) == [A]
    both = function(np.array([x, x * 1.5], dtype=object))
    assert list(both) == pytest.approx(list(function(np.array([0.5, 0.75]))), rel=1e-14)
    assert all(sources(element) == [A] for element in both)


@pytest.mark.parametrize('name', OF_TWO.split())
def test_ufuncs_of_two(name, x, y):
    function = getattr(np, name)
    assert function(x, y) == pytest.approx(function(0.5, 2.0))
    assert is_tracked(function(x, y))
    assert is_tracked(function(y, 3.0)) or name == 'maximum'
    assert list(function(np.array([x, y], dtype=object), y)) == pytest.approx(list(function(np.array([0.5, 2.0]), 2.0)))


def test_questions_about_numbers_are_answered_plainly(x):
    assert np.isfinite(x)
    assert not np.isnan(x)
    assert np.less(x, 1)
    assert type(np.less(x, 1)) is np.bool_


def test_products_of_object_arrays(x, y):
    v, m = np.array([x, y], dtype=object), np.array([[x, 0.0], [1.0, y]], dtype=object)
    for result, expected in (
        (v @ v, 4.25),
        (np.dot(v, v), 4.25),
        (np.sum(v), 2.5),
        (v.sum(), 2.5),
        (np.prod(v), 1.0),
        (np.mean(v), 1.25),
        (np.linalg.norm(v), plain_math.sqrt(4.25)),
        (np.trace(m), 2.5),
        (np.inner(v, [1, 2]), 4.5),
    ):
        assert result == pytest.approx(expected)
        assert sources(result) == [A, B]
        assert evaluate(result, solve(result, expected * 1.1)) == pytest.approx(expected * 1.1)
    assert list(m @ v) == [0.25, 4.5]
    assert list(np.linalg.norm(m, axis=0)) == pytest.approx([plain_math.hypot(0.5, 1), 2.0])
    assert (m.T @ np.array([1.0, 2.0])).tolist() == [2.5, 4.0]


def test_an_array_made_without_a_type_is_plain(x):
    assert np.array([x]).dtype == float
    assert is_tracked(np.array([x], dtype=object))


def test_a_plain_array_that_is_added_to_in_place_stays_plain(x):
    array = np.ones(2)
    array += x
    assert array.dtype == float
    assert array.tolist() == [1.5, 1.5]


def test_the_functions_of_rosslt_math_take_arrays(x):
    result = math.sin(np.array([x, 1.0], dtype=object))
    assert list(result) == [plain_math.sin(0.5), plain_math.sin(1.0)]
    assert explain(result[0]) == 'sin(0.5 [/node#1])'


def test_object_arrays_are_solved_together(x, y):
    v = np.array([x + y, x - y], dtype=object)
    assert solve(v, np.array([5.0, 2.0])) == {A: pytest.approx(3.5), B: pytest.approx(1.5)}
    assert evaluate(v, {A: 3.0}).tolist() == [5.0, 1.0]
    assert untracked(v).tolist() == [2.5, -1.5]
    assert type(untracked(v)[0]) is float
    assert [path for path, _ in leaves(v)] == ['[0]', '[1]']


def test_a_six_joint_arm_reaches_a_point_nobody_wrote_the_inverse_for():
    joints = [track(angle, Source('/arm', number)) for number, angle in enumerate((0.1, 0.4, 0.5, 0.2, 0.3, 0.1))]
    pose = np.identity(4).astype(object)
    for angle, axis, length in zip(joints, 'zyyzyz', (0.3, 0.4, 0.35, 0.2, 0.1, 0.08)):
        c, s = np.cos(angle), np.sin(angle)
        about_z, about_y = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]
        turn = about_z if axis == 'z' else about_y
        step = np.identity(4).astype(object)
        step[:3, :3] = turn
        step[:3, 3] = np.array(turn, dtype=object)[:, 2] * length
        pose = pose @ step
    tip = pose[:3, 3]
    target = untracked(tip) + [0.05, 0.1, -0.08]
    answer = solve(tip, target)
    assert evaluate(tip, answer).tolist() == pytest.approx(list(target), rel=1e-9)
    assert len(answer) >= 4
    assert sum((value - joints[source.location_id]) ** 2 for source, value in answer.items()) < 0.2


@pytest.mark.parametrize('kind', [np.float64, np.float32, np.int32, np.uint8])
@pytest.mark.parametrize('operator', [op.add, op.sub, op.mul, op.truediv, op.floordiv, op.mod, op.pow, divmod])
def test_a_number_of_numpy_makes_its_own_results_of_a_tracked_one(x, kind, operator):
    made, of_plain = operator(x, kind(2)), operator(0.5, kind(2))
    assert isinstance(made, type(of_plain))
    assert made == of_plain
    if operator is divmod:
        made, of_plain = made[1], of_plain[1]
    assert isinstance(made, np.float64)
    expected = operator(0.75, 2.0)
    assert evaluate(made, {A: 0.75}) == pytest.approx(expected[1] if operator is divmod else expected)


def test_a_zero_of_numpy_divides_as_numpy_says(x):
    with np.errstate(all='ignore'):
        assert x / np.float64(0) == plain_math.inf
        assert plain_math.isnan(x % np.float64(0))


class Recorder:
    """An operand that computes ufuncs in a way of its own."""

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        return ufunc, method, inputs, options


def test_a_class_that_computes_ufuncs_itself_is_asked(x):
    other = Recorder()
    assert np.multiply(x, other) == (np.multiply, '__call__', (x, other), {})
    assert np.add(x, 1.0, out=other) == (np.add, '__call__', (x, 1.0), {'out': (other,)})
    assert numpy_functions()['multiply'](x, other, 'out') == (np.multiply, '__call__', (x, other), {'out': ('out',)})
    array = numpy_functions()['array']([x, 1.0])
    assert np.add(array, other)[2][1] is other


class OfArrays(np.ndarray):
    """An array that hands ufuncs on to NumPy's arrays, as NumPy's pages have it."""

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        plain = [one.view(np.ndarray) if type(one) is OfArrays else one for one in inputs]
        return super().__array_ufunc__(ufunc, method, *plain, **options)


def test_a_class_of_arrays_that_hands_ufuncs_on_gets_numpys_own_arrays(x):
    array = numpy_functions()['array']([x, 1.0])
    assert np.add(np.ones(2).view(OfArrays), array).tolist() == [1.5, 2.0]
    assert np.add(array, np.ones(2).view(OfArrays)).tolist() == [1.5, 2.0]


def test_a_result_without_an_array_to_write_to_is_returned(x):
    mantissa = np.empty(1)
    of_mantissa, exponent = np.frexp(numpy_functions()['array']([x]), mantissa)
    assert of_mantissa is mantissa
    assert exponent.tolist() == [0]


def test_a_tracked_number_that_does_not_fit_the_objects_is_refused_as_by_numpy(x):
    texts = np.array(['a', 1], dtype=object)
    with pytest.raises(TypeError):
        np.add.at(texts, [0, 1], x)
    numbers = np.array([1, 2], dtype=object)
    np.add.at(numbers, [0, 0], x)
    assert numbers.tolist() == [2.0, 2]
