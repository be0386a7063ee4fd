"""Arrays with provenance hold NumPy's own numbers, and tf's functions give what they gave."""

import copy
import importlib
import math
import sys

import numpy
import pytest
from std_msgs.msg import Float32MultiArray

import rosslt
from rosslt import values
from rosslt.instrument import functions, routing
from rosslt.values import recording
from support.numpy_calls import CALLS, PARTLY_PLAIN, PLAIN

np = routing.route(numpy)
plain_tf = importlib.import_module('tf.transformations')
tf = routing.route(plain_tf)
count = iter(range(1, 1 << 30))


def tracked(x):
    """Numbers at any depth of lists, each with a source of its own."""
    if isinstance(x, (list, tuple, numpy.ndarray)):
        return [tracked(part) for part in x]
    return rosslt.track(float(x), rosslt.Source('/node', next(count))) if isinstance(x, float) else x


def flat(x):
    if isinstance(x, numpy.ndarray):
        x = x.tolist()
    if isinstance(x, (list, tuple)):
        return [leaf for part in x for leaf in flat(part)]
    return [] if x is None else [x]


def same(ours, theirs):
    """Whether two results are made of the same numbers, to the last bit."""
    return len(ours) == len(theirs) and all(
        a == b or (a != a and b != b) for a, b in zip(map(values.untracked, ours), theirs)
    )


def with_source(number):
    return rosslt.track(number, rosslt.Source('/node', next(count)))


VECTOR = [0.3, -1.5, 2.0]
MATRIX = [[2.0, 0.5, 0.0], [0.25, 3.0, 1.0], [1.0, -1.0, 4.0]]


@pytest.mark.parametrize('name', CALLS)
def test_what_arrays_give_is_what_numpy_gives_and_tracked(name):
    call = CALLS[name]
    ours, theirs = call(np, *(np.array(tracked(x)) for x in PLAIN)), call(numpy, *PLAIN)
    assert same(flat(ours), flat(theirs))
    assert all(map(values.is_tracked, flat(ours))) == (name not in PARTLY_PLAIN)
    assert repr(ours) == repr(theirs)
    assert not values.is_tracked(flat(call(np, *map(np.array, PLAIN))))


def test_what_is_written_to_an_array_keeps_its_provenance():
    a, b, c = np.zeros(3), np.eye(3), np.empty((2, 2))
    x = tracked(2.5)
    a[1] = x
    b[0:2, 1] = [x, x]
    c[0][1] = x
    assert all(values.origins([one]) == values.origins([x]) for one in (a[1], b[1, 1], c[0, 1]))
    a[1] = 3.0
    assert not values.is_tracked(a[1])


def test_what_is_computed_in_place_is_seen_by_all_views():
    a = np.array(tracked([1.0, 2.0, 3.0]))
    view = a[1:]
    view *= 2
    assert a.tolist() == [1.0, 4.0, 6.0]
    assert rosslt.evaluate(a[2], {rosslt.sources(a[2])[0]: 5.0}) == 10.0


def test_what_is_written_past_the_array_has_no_provenance():
    a = np.array(tracked([1.0, 2.0]))
    numpy.asarray(a).view(numpy.ndarray)[0] = 7.0
    assert a[0] == 7.0
    assert not values.is_tracked(a[0])
    assert values.is_tracked(a[1])


def test_arrays_stay_arrays_of_floats():
    a = np.array(tracked(VECTOR))
    x = tracked(2.0)
    assert {
        one.dtype.name for one in (a, a * x, x * a, x * numpy.array(VECTOR), numpy.array(VECTOR) - x, np.sin(a))
    } == {'float64'}
    assert isinstance(a, numpy.ndarray)
    assert repr(a) == repr(numpy.array(VECTOR))
    assert numpy.linalg.eigvals(np.array(tracked(MATRIX))).shape == (3,)


def test_a_function_of_numpy_gives_its_own_number_for_a_scalar():
    for x in (0.1, 0.7, 1.3, 5.9):
        assert np.sin(tracked(x)) == float(numpy.sin(x))
        assert rosslt.solve(np.sin(tracked(x)), 0.5)


def test_an_element_is_of_the_kind_of_its_array():
    whole = rosslt.track(2, rosslt.Source('/node', next(count)))
    elements = np.array([whole, 0.5]).tolist()
    assert [type(values.untracked(one)) for one in elements] == [float, float]
    assert values.is_tracked(elements[0])
    a = np.zeros(2, dtype=int)
    a[0] = tracked(3.0)
    assert type(values.untracked(a.tolist()[0])) is int


def test_arrays_of_32_bits_keep_provenance_in_messages():
    x = tracked(0.1)
    made = np.array([x, 2.5], dtype=np.float32) * 3
    theirs = numpy.array([0.1, 2.5], dtype=numpy.float32) * 3
    assert made.dtype == numpy.float32
    assert made.tobytes() == theirs.tobytes()
    assert made.tolist() == theirs.tolist()
    assert isinstance(made[0], numpy.float32)  # computes in 32 bits
    assert rosslt.solve(made.tolist()[0], 1.5) == {rosslt.sources(x)[0]: pytest.approx(0.5)}
    assert rosslt.sources(np.array([x, 1.0]).astype(np.float32).tolist()) == rosslt.sources(x)
    filled = np.zeros(2, dtype='f4')
    filled[1] = x
    assert rosslt.sources(filled.tolist()) == rosslt.sources(x)


def test_an_element_of_32_bits_computes_in_as_many_and_keeps_its_provenance():
    x, y = tracked(0.1), tracked(2.5)
    a, theirs = np.array([x, y], dtype=np.float32), numpy.array([0.1, 2.5], dtype=numpy.float32)
    for compute in (
        lambda a: a[0] + a[1],
        lambda a: a[0] * a[1] - a[0] / a[1],
        lambda a: -(a[0] ** 2),
        lambda a: 3 * a[0] + 1,
        lambda a: numpy.float32(3) * a[0],
        lambda a: abs(a[0] - numpy.float32(1)),
        lambda a: max(a[0], a[1]),
        lambda a: numpy.sqrt(a[0]),
        lambda a: a[0].astype(numpy.float64) * 2,
        lambda a: a[0].item() + 1,
        lambda a: next(iter(a[1:])) % a[0],
        lambda a: sum(list(a)),
    ):
        ours, wanted = compute(a), compute(theirs)
        assert (float(ours), str(ours)) == (float(wanted), str(wanted))
        assert isinstance(ours, numpy.float32) == isinstance(wanted, numpy.float32)
        message = Float32MultiArray(data=[ours])
        assert values.is_tracked(message.data[0])
        assert message.data[0] == float(wanted)
    assert rosslt.solve((a[0] * a[1]).tracked, 1.0) == {rosslt.sources(x)[0]: pytest.approx(0.4)}


def test_a_number_of_32_bits_is_numpys_own_but_for_its_provenance():
    one = np.array([tracked(0.1)], dtype=np.float32)[0]
    plain = numpy.float32(0.1)
    assert (repr(one), str(one), hash(one), one == plain, one > 0) == ('0.1', '0.1', hash(plain), True, True)
    assert type(one.__class__(one)) is numpy.float32
    assert copy.deepcopy([one])[0] is one
    assert numpy.array([one, plain]).dtype == numpy.float32


def test_the_cells_of_a_map_keep_provenance_in_messages():
    cell = rosslt.track(100, rosslt.Source('/node', next(count)))
    grid = np.zeros((3, 4), dtype=numpy.int8)
    grid[1:, 2] = cell
    assert grid.dtype == numpy.int8
    assert type(grid[1, 2]) is numpy.int8
    flat_cells = grid.ravel().tolist()
    assert [values.is_tracked(one) for one in flat_cells] == [one == 100 for one in flat_cells]
    assert type(values.untracked(flat_cells[6])) is int


def test_ranges_keep_their_ends():
    ends = np.linspace(tracked(0.0), tracked(1.0), 5)
    assert ends.tolist() == numpy.linspace(0.0, 1.0, 5).tolist()
    start, end, step = with_source(0), with_source(10), tracked(0.5)
    between = np.linspace(start, end, with_source(5))[2]
    assert rosslt.evaluate(between, {rosslt.sources(end)[0]: 20}) == 10.0
    third = np.arange(start, end, step)[3]
    assert rosslt.evaluate(third, {rosslt.sources(start)[0]: 1, rosslt.sources(step)[0]: 2.0}) == 7.0
    filled = np.full(with_source(3), tracked(1.5), dtype=numpy.float32)
    assert rosslt.solve(filled[1], 2.5) == {rosslt.sources(filled[1])[0]: 2.5}


def test_arrays_of_objects_stay_what_a_node_made_them():
    x = tracked(0.5)
    for made in (rosslt.math.sin(numpy.array([x, 1.0], dtype=object)), numpy.array([x, 1.0], dtype=object) * x):
        assert made.dtype == object
        assert rosslt.is_tracked(made[0])


def test_large_arrays_keep_provenance():
    x = tracked(1.5)
    a = np.zeros(5000)
    a[7] = x
    moved = np.roll(a * 2.0, 3)
    assert rosslt.evaluate(moved.tolist()[10], {rosslt.sources(x)[0]: 4.0}) == 8.0
    image = np.ones((300, 400)) * x + numpy.arange(400)
    assert rosslt.evaluate(image[299, 5], {rosslt.sources(x)[0]: 4.0}) == 9.0


generator = numpy.random.RandomState(1)


def number():
    return float(generator.uniform(-1.0, 1.0))


def vector():
    return [number() for _ in range(3)]


def quaternion():
    return plain_tf.random_quaternion(generator.uniform(size=3)).tolist()


def rotation():
    return plain_tf.random_rotation_matrix(generator.uniform(size=3))


def shear():
    return 0.3, [1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]


TRANSFORMATIONS = {
    'arcball_constrain_to_axis': lambda: (vector(), [0.0, 0.0, 1.0]),
    'arcball_map_to_sphere': lambda: ([0.3, 0.4], [0.1, 0.1], 1.0),
    'arcball_nearest_axis': lambda: (vector(), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    'clip_matrix': lambda: (-0.5, 0.5, -0.2, 0.7, 0.1, 3.0),
    'compose_matrix': lambda: ([1.0, 2.0, 3.0], vector(), vector(), vector()),
    'concatenate_matrices': lambda: (rotation(), rotation()),
    'decompose_matrix': lambda: (plain_tf.compose_matrix([1.0, 2.0, 3.0], vector(), vector(), vector()),),
    'euler_from_matrix': lambda: (rotation(), 'syxz'),
    'euler_from_quaternion': lambda: (quaternion(),),
    'euler_matrix': lambda: (number(), number(), number(), 'rzyx'),
    'identity_matrix': lambda: (),
    'inverse_matrix': lambda: (rotation(),),
    'is_same_transform': lambda: (rotation(), rotation()),
    'orthogonalization_matrix': lambda: ([10.0, 10.0, 10.0], [90.0, 80.0, 70.0]),
    'projection_from_matrix': lambda: (plain_tf.projection_matrix(vector(), vector()),),
    'projection_matrix': lambda: (vector(), vector(), vector()),
    'quaternion_about_axis': lambda: (number(), vector()),
    'quaternion_conjugate': lambda: (quaternion(),),
    'quaternion_from_euler': lambda: (number(), number(), number(), 'ryxz'),
    'quaternion_from_matrix': lambda: (rotation(),),
    'quaternion_inverse': lambda: (quaternion(),),
    'quaternion_matrix': lambda: (quaternion(),),
    'quaternion_multiply': lambda: (quaternion(), quaternion()),
    'quaternion_slerp': lambda: (quaternion(), quaternion(), 0.3),
    'reflection_from_matrix': lambda: (plain_tf.reflection_matrix(vector(), vector()),),
    'reflection_matrix': lambda: (vector(), vector()),
    'rotation_from_matrix': lambda: (plain_tf.rotation_matrix(number(), vector(), vector()),),
    'rotation_matrix': lambda: (number(), vector(), vector()),
    'scale_from_matrix': lambda: (plain_tf.scale_matrix(-0.3, vector()),),
    'scale_matrix': lambda: (number(), vector(), vector()),
    'shear_from_matrix': lambda: (plain_tf.shear_matrix(*shear()),),
    'shear_matrix': shear,
    'superimposition_matrix': lambda: (generator.uniform(size=(3, 5)), generator.uniform(size=(3, 5))),
    'translation_from_matrix': lambda: (plain_tf.translation_matrix(vector()),),
    'translation_matrix': lambda: (vector(),),
    'unit_vector': lambda: (vector(),),
    'vector_norm': lambda: (vector(),),
}

#: Made of truth values, or of nothing: they give the plain numbers.
UNTRACKED = {'identity_matrix', 'is_same_transform'}


def test_every_function_of_tf_is_compared():
    functions = {name for name, thing in vars(plain_tf).items() if callable(thing) and not name.startswith('_')}
    assert {
        name for name in functions if not isinstance(getattr(plain_tf, name), type) and 'random' not in name
    } == set(TRANSFORMATIONS)


@pytest.mark.parametrize('name', TRANSFORMATIONS)
def test_a_function_of_tf_gives_what_it_gave(name):
    generator.seed(1)
    for _ in range(20):
        arguments = TRANSFORMATIONS[name]()
        theirs = flat(getattr(plain_tf, name)(*arguments))
        ours = flat(
            getattr(tf, name)(
                *(np.array(tracked(x)) if isinstance(x, numpy.ndarray) else tracked(x) for x in arguments)
            )
        )
        assert same(ours, theirs)
        assert not ours or any(map(values.is_tracked, ours)) == (name not in UNTRACKED)


def test_a_quaternion_is_solved_for_its_angles():
    roll, pitch, yaw = tracked([0.1, 0.2, 0.3])
    x, y, z, w = tf.quaternion_from_euler(roll, pitch, yaw)
    wanted = plain_tf.quaternion_from_euler(0.5, -0.4, 1.0)
    changes = rosslt.solve([x, y, z, w], list(wanted))
    assert [changes[rosslt.sources(angle)[0]] for angle in (roll, pitch, yaw)] == pytest.approx([0.5, -0.4, 1.0])


@pytest.mark.parametrize('axes', ['sxyz', 'rzyx', 'sxyx', 'ryxz'])
@pytest.mark.parametrize('turning', range(3))
def test_a_turn_about_one_axis_leaves_what_it_cannot_move_plain(turning, axes):
    angles = [tracked(0.3) if number == turning else 0.0 for number in range(3)]
    parts = tf.quaternion_from_euler(*angles, axes)
    assert flat(parts) == flat(plain_tf.quaternion_from_euler(*map(float, angles), axes))
    assert [values.is_tracked(part) for part in parts] == [float(part) != 0.0 for part in parts]


def test_plain_numbers_take_the_original():
    assert math.isclose(tf.quaternion_from_euler(0.1, 0.0, 0.0)[0], math.sin(0.05))
    assert type(tf.quaternion_from_euler(0.1, 0.0, 0.0)) is numpy.ndarray


def test_the_original_is_taken_while_nothing_is_recorded(monkeypatch):
    monkeypatch.setattr(functions, 'MATH', {})
    angles, pair = tracked([0.1, 0.2, 0.3]), np.array(tracked([0.0, 0.0, 0.0, 1.0]))
    before = values.allow(0)
    try:
        made = tf.quaternion_from_euler(*angles), tf.quaternion_multiply(pair, quaternion0=pair)
    finally:
        values.allow(before)
    assert list(map(type, made)) == [numpy.ndarray] * 2
    assert flat(made[0]) == flat(plain_tf.quaternion_from_euler(0.1, 0.2, 0.3))


def test_the_time_of_a_transformation_is_taken_from_the_allowance(monkeypatch):
    used = iter((1.0, 1.25))
    monkeypatch.setattr(recording.time, 'thread_time', lambda: next(used))
    before = values.allow(sys.maxsize)
    tf.quaternion_from_euler(*tracked([0.1, 0.2, 0.3]))
    assert sys.maxsize - values.allow(before) > 0.25 / values.OPERATION


def test_what_is_multiplied_by_a_plain_0_has_no_provenance():
    made = np.eye(2) * tracked(0.5)
    assert [len(rosslt.sources(part)) for part in made.ravel()] == [1, 0, 0, 1]


@pytest.mark.parametrize(
    'ask',
    [
        lambda x: x.item(),
        lambda x: x.tolist(),
        lambda x: x.copy(),
        lambda x: x.round(1),
        lambda x: x.astype(int),
        lambda x: x.astype(float),
        lambda x: x.sum(),
        lambda x: x.T,
    ],
)
def test_a_tracked_number_has_what_a_number_of_numpy_has(ask):
    ours, theirs = ask(np.array(tracked([2.53]))[0]), ask(numpy.array([2.53])[0])
    assert values.untracked(ours) == theirs
    assert values.is_tracked(ours)


def test_a_tracked_number_has_the_shape_of_a_number_of_numpy():
    x, y = np.sqrt(tracked(2.0)), numpy.sqrt(2.0)
    assert (x.shape, x.size, x.ndim, x.clip(0, 1), x.any()) == (y.shape, y.size, y.ndim, y.clip(0, 1), y.any())
    assert x.astype(numpy.float32).dtype == numpy.float32


def test_a_reduction_knows_what_it_leaves_out_or_begins_with():
    a = np.array(tracked([0.0, 2.0]))
    (left_out,), (kept,) = map(rosslt.sources, a)
    mask = numpy.array([False, True])
    for made in (a.sum(where=mask), np.sum(a, where=mask), a.max(initial=1.5), np.max([a[0], a[1]], initial=1.5)):
        assert made == 2.0
        assert rosslt.evaluate(made, {left_out: 1.0, kept: 7.0}) == 7.0
    assert values.is_tracked(a.sum(axis=0, keepdims=True)[0])


WRITES = {
    'copyto': lambda n, a, x: n.copyto(a, n.array([x, x])),
    'copyto by name': lambda n, a, x: n.copyto(dst=a, src=n.array([x, x])),
    'put': lambda n, a, x: n.put(a, [0, 1], [x, x]),
    'place': lambda n, a, x: n.place(a, numpy.array([True, True]), [x]),
    'putmask': lambda n, a, x: n.putmask(a, numpy.array([True, True]), x),
    'put_along_axis': lambda n, a, x: n.put_along_axis(a, numpy.array([0, 1]), x, 0),
    'the method put': lambda n, a, x: a.put([0, 1], [x, x]),
    'the method sort': lambda n, a, x: a.sort(),
    'the method partition': lambda n, a, x: a.partition(1),
    'the method itemset': lambda n, a, x: [a.itemset(i, x) for i in (0, 1)],
    'flat': lambda n, a, x: setattr(a, 'flat', [x, x]),
}


@pytest.mark.parametrize('write', WRITES.values(), ids=WRITES)
def test_what_is_written_in_other_ways_has_not_the_provenance_of_what_was_there(write):
    a, theirs = np.array(tracked([1.0, 1.0])), numpy.array([1.0, 1.0])
    view, there, x = a[:1], set(rosslt.sources(a)), tracked(1.0)
    write(np, a, x)
    write(numpy, theirs, 1.0)
    assert same(flat(a), flat(theirs))
    is_ordered = write in (WRITES['the method sort'], WRITES['the method partition'])
    assert set(rosslt.sources([*flat(a), *flat(view)])) <= (there if is_ordered else set(rosslt.sources(x)))


def test_a_diagonal_that_is_filled_has_not_the_provenance_of_what_was_there():
    a = np.array(tracked([[1.0, 2.0], [3.0, 1.0]]))
    np.fill_diagonal(a, 1.0)
    assert a.tolist() == [[1.0, 2.0], [3.0, 1.0]]
    assert not values.is_tracked(a[0, 0])


def test_what_is_read_by_flat_is_what_numpy_gives_and_takes_no_provenance_away():
    a, theirs = np.array(tracked(MATRIX)), numpy.array(MATRIX)
    assert list(a.flat) == list(theirs.flat)
    assert (a.flat[4], a.flat[2:4].tolist(), len(a.flat)) == (theirs.flat[4], theirs.flat[2:4].tolist(), 9)
    assert numpy.asarray(a.flat).tolist() == theirs.reshape(-1).tolist()
    assert (a.flat == 2.0).tolist() == (theirs.flat == 2.0).tolist()
    assert all(map(values.is_tracked, flat(a)))
    a.flat[1:3] = 2.0
    assert [values.is_tracked(one) for one in a[0]] == [True, False, False]


def resized(a):
    a.resize(5, refcheck=False)  # plain NumPy counts the references of whatever traces the test
    return a


def test_resize_takes_what_numpy_takes_alone():
    for a in (np.eye(3), np.array(tracked([1.0, 2.0]))):
        with pytest.raises(TypeError):
            a.resize(refcheck='hi')


def shaped(n, a, x):
    a.shape = (2, 2)
    a[1, 1] = x
    return [a[0, 1], a[1, 0], *a[1]]


TAKEN = {
    'clip below': lambda n, x: n.zeros(3).clip(min=x),
    'clip by place': lambda n, x: n.array([x, 0.5]).clip(1),
    'clip by name': lambda n, x: n.array([x, 0.5]).clip(min=0, max=1),
    'clip above': lambda n, x: n.array([x, 0.5]).clip(max=1),
    'full': lambda n, x: n.full((3,), fill_value=x),
    'full_like': lambda n, x: n.full_like(a=n.zeros(2), fill_value=x),
    'arange from': lambda n, x: n.arange(start=x, stop=5),
    'arange to': lambda n, x: n.arange(stop=4),
    'arange in steps': lambda n, x: [n.arange(4, step=2), n.arange(1, stop=4), n.arange(0, 9, step=x)],
    'array': lambda n, x: n.array(object=[x, 1.0]),
    'asarray': lambda n, x: n.asarray(a=[x, 1.0], dtype=float),
    'average': lambda n, x: n.average(n.array([x, 1.0]), weights=n.array([1.0, 3.0]), returned=True),
    'average by axis': lambda n, x: n.average(n.array([[x, 1.0], [2.0, x]]), 1, n.array([1.0, 3.0]), True),
    'resize': lambda n, x: resized(n.array([x, 1.0])),
    'resize of zeros': lambda n, x: [n.zeros(3).resize(8, refcheck=False), resized(n.zeros((2, 2)))],
    'shape': lambda n, x: shaped(n, n.array([1.0, x, 3.0, 4.0]), x),
    'shape of zeros': lambda n, x: shaped(n, n.zeros(4), x),
}


@pytest.mark.parametrize('call', TAKEN.values(), ids=TAKEN)
def test_what_numpy_takes_is_taken(call):
    ours, theirs = call(np, tracked(2.5)), call(numpy, 2.5)
    assert same(flat(ours), flat(theirs))
    assert repr(values.untracked(ours)) == repr(theirs)


def test_numbers_that_are_given_by_name_keep_their_provenance():
    x = tracked(2.5)
    made = [np.full(2, fill_value=x), np.arange(start=x, stop=4.0), np.array(object=[x]), np.array([x, x]).clip(min=0)]
    assert all(map(values.is_tracked, flat(made)))
    reshaped = np.array(tracked([1.0, 2.0, 3.0, 4.0]))
    reshaped.shape = (2, 2)
    assert rosslt.sources(reshaped[1, 0]) == rosslt.sources(reshaped.ravel()[2])
    assert values.is_tracked(reshaped[1, 0])


def test_an_array_is_resized_and_a_part_of_one_is_not():
    a = np.array(tracked([1.0, 2.0]))
    with pytest.raises(ValueError, match='cannot resize'):
        a[:1].resize(4)
    a.resize(3)
    assert a.tolist() == [1.0, 2.0, 0.0]
    for n in (np, numpy):
        with pytest.raises(TypeError):
            n.array()
        with pytest.raises(TypeError):
            n.full((2,))


#: What a number of NumPy answers: of floats read from arrays of 64 and 32 bits, and of an int.
ANSWERS = {
    'a list divided': lambda n, x, y, i: [0.2, 0.3, 0.5] / x,
    'lists around': lambda n, x, y, i: [[1.0, 2.0] - x, (1, 2) + y, x - [1.0], i / (1, 2), x < [1.0, 2.5], y > 2.0],
    'a list divided by a sum': lambda n, x, y, i: [0.2, 0.3] / n.sum([x, 0.3]) - n.linalg.norm([x, y]),
    'a list repeated': lambda n, x, y, i: [[1, 2] * i, [0.5] * n.max([1, i]), list(range(i))],
    'kinds': lambda n, x, y, i: [x.dtype, y.dtype, i.dtype, n.isscalar(x), n.ndim(x), x.shape, i.nbytes],
    'classes': lambda n, x, y, i: [
        isinstance(x, numpy.float64), isinstance(x, float), isinstance(y, numpy.float32), isinstance(i, numpy.integer),
        isinstance(i, int), x.__class__,
    ],
    'classes of results': lambda n, x, y, i: list(map(functions.type_of, [
        x, y, i, x * 2, 2.0 * x, i // 2, i * 0.5, y * y, round(x), round(x, 1), n.sqrt(x), 0.5 * numpy.float64(2) * x,
        x.item(), float(x), x > 1,
    ])),
    'division by zero': lambda n, x, y, i: [x / 0, -x / 0.0, x // 0, x % 0, i // 0, (x - 10) ** 0.5, 1.5 / (x - x)],
    'operators': lambda n, x, y, i: [divmod(x, 2), divmod(7, i), 2**x, x**2, -x, +y, abs(-i), 7 % x, i % 2, 5 // y],
    'texts': lambda n, x, y, i: ['%d %s %.2f' % (i, y, x), f'{x:.3f} {i}', repr(x), str(y), hash(x), {1.5: 'a'}[x]],
    'attributes': lambda n, x, y, i: [x.is_integer(), x.as_integer_ratio(), x.imag, x.T, i.max(), x.astype(int)],
    'truth': lambda n, x, y, i: [bool(x), not i, x == 1.5, x in [1.5], x is not None, min(x, 2.0), sorted([x, 1.0])],
    'zeros below 0': lambda n, x, y, i: [x * -0.0, n.array([-x, x]) * 0, -n.zeros(2), n.array([-0.0, x]), -x * 0],
}  # fmt: skip


@pytest.mark.filterwarnings('ignore::RuntimeWarning')
@pytest.mark.parametrize('ask', ANSWERS.values(), ids=ANSWERS)
def test_what_numpy_gives_answers_as_numpys_number(ask):
    def answers(n, number):
        first = n.array([number(1.5), 2.0])[0], n.array([number(0.5)], dtype=numpy.float32)[0]
        made = ask(n, *first, n.array([number(3), 4])[0])
        return repr([part.tolist() if isinstance(part, numpy.ndarray) else part for part in made])

    assert answers(np, with_source) == answers(numpy, lambda x: x)


@pytest.mark.filterwarnings('ignore::RuntimeWarning')
def test_a_number_of_numpy_keeps_its_provenance():
    x, i = np.array([tracked(1.5)])[0], np.array([with_source(3)])[0]
    plain_list = [0.2, 0.3] / x
    made = [x * 2, 2.0 / x, x - numpy.float64(2), numpy.float64(2) - x, np.sqrt(x), -x, round(x, 1), x**2, i * 2, 7 % i]
    made += [functions.to_float(x), functions.to_int(i), x.item(), functions.MATH['sin'](x), *plain_list, i * 0.5]
    made += [functions.convert(kind, x) for kind in (numpy.float64, numpy.int64, numpy.float32)]
    assert all(map(values.is_tracked, made))
    message = Float32MultiArray(data=[x, i, 2.0])
    assert rosslt.sources(message) == rosslt.sources([x, i])
    assert values.untracked(message).data == [1.5, 3, 2.0]
    assert rosslt.solve(x * 2 + 1, 6.0) == {rosslt.sources(x)[0]: 2.5}


def test_what_a_function_is_given_to_write_to_is_what_it_gives():
    out, a = np.zeros(2), np.array(tracked([[1.0, 2.0], [3.0, 5.0]]))
    assert np.mean(a, axis=0, out=out) is out
    assert np.concatenate(([1.0], [2.0]), out=out) is out
    assert out.tolist() == [1.0, 2.0]
    assert np.median(a, 0, out) is out
    assert np.percentile(a, 50, axis=0, out=out) is out
    assert out.tolist() == [2.0, 3.5]


def test_other_arrays_stay_what_they_are():
    x = tracked(2.0)
    records = np.array([(1, x), (2, 3.0)], dtype=[('count', int), ('x', float)])
    assert records['x'].tolist() == [2.0, 3.0]
    masked = numpy.ma.array([1.0, 2.0], mask=[True, False])
    assert type(np.array([x, x]) * masked) is type(np.diff(masked, n=with_source(1))) is numpy.ma.MaskedArray
    assert numpy.array([x, None], dtype=object)[0] is np.array([x, None], dtype=object)[0] is x


def test_a_function_of_c_is_no_method_of_a_class():
    class Makes:
        array, zeros, dot = np.array, np.zeros, np.dot

    assert Makes().array([1.0, tracked(2.0)]).tolist() == [1.0, 2.0]
    assert Makes().zeros(2).tolist() == [0.0, 0.0]


def test_a_large_array_is_not_taken_for_objects():
    large = numpy.broadcast_to(numpy.zeros(1), (1 << 34,))
    assert len(np.array_split(large, with_source(2))) == 2
