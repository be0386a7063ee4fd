"""Random programs: the numbers are NumPy's to the bit, and other source values give what the program gives of them."""

import itertools
import os

import pytest

from rosslt import Source, evaluate, track, untracked
from rosslt.values import disassemble, leaves
from support import numpy_programs

np = pytest.importorskip('numpy')
tracked_np = pytest.importorskip('rosslt.numpy')

FIRST = int(os.environ.get('ROSSLT_FIRST_PROGRAM', '0'))
COUNT = int(os.environ.get('ROSSLT_PROGRAMS', '20000' if os.environ.get('ROSSLT_MANY_EXAMPLES') else '400'))
PARTS = 8


def plain_run(numbers, shapes, seed, factor=1):
    """The results of a program, each off by a factor as later steps get it."""
    arrays = [np.reshape(np.multiply(part, factor), shape) for part, shape in zip(numbers, shapes)]
    return numpy_programs.run(np, arrays, seed, lambda result: result if factor == 1 else result * factor)


def is_as(ours, theirs):
    """Whether results of a step are the same to the bit, or the same error."""
    if isinstance(theirs, type):
        return ours is theirs
    return np.shape(ours) == np.shape(theirs) and np.array_equal(
        untracked(ours), theirs, equal_nan=theirs.dtype.kind == 'f'
    )


def faults_of(seed):
    """What is wrong with the program of a seed: the numbers of its steps, and what they give."""
    (numbers, moved), shapes = numpy_programs.begin(seed)
    flat, changes, arrays = iter(range(1000)), {}, []
    for part, other, shape in zip(numbers, moved, shapes):
        made = tracked_np.zeros(shape)
        for at, (number, changed) in enumerate(zip(part, other)):
            source = Source('/node', next(flat))
            changes[source] = changed
            made.itemset(at, track(number, source))
        arrays.append(made)
    ours, theirs = numpy_programs.run(tracked_np, arrays, seed), plain_run(numbers, shapes, seed)
    other = [(at, *pair) for at, pair in enumerate(itertools.zip_longest(ours, theirs)) if not is_as(*pair)]
    if other:
        yield other[0]
        return
    anew = plain_run(moved, shapes, seed)
    # How far rounding is carried: what lies between is a tie, or has no digits left.
    nearby = [plain_run(moved, shapes, seed, factor) for factor in (1 + 1e-11, 1 - 1e-11)]
    for at, made in enumerate(ours):
        if isinstance(made, type):
            continue
        disassemble([leaf for _, leaf in leaves(made)])
        if len(anew) != len(ours) or isinstance(anew[at], type) or np.shape(anew[at]) != np.shape(made):
            return
        if not np.isfinite(anew[at]).all() or not np.isfinite(untracked(made)).all():
            return
        try:
            found = np.array(evaluate(made, changes), float)
        except (ArithmeticError, ValueError):
            return  # a step between has no result
        # and the last digits of the present value, by which NumPy has rounded
        carried = np.nan_to_num(sum(np.abs(near[at] - anew[at]) for near in nearby), nan=0.0, posinf=np.inf)
        allowed = 1e-7 * (1 + np.abs(anew[at])) + 1e3 * carried + 1e-13 * np.abs(untracked(made))
        if not (np.abs(found - anew[at]) <= allowed).all():
            yield at, found, anew[at]
            return


@pytest.mark.filterwarnings('ignore')
@pytest.mark.parametrize('part', range(PARTS))
def test_program_holds_at_other_source_values(part):
    wrong = {}
    with np.errstate(all='ignore'):
        for seed in range(FIRST + part, FIRST + COUNT, PARTS):
            found = list(faults_of(seed))
            if found:
                wrong[seed] = found
    assert not wrong


@pytest.mark.filterwarnings('ignore')
@pytest.mark.parametrize('seed', [102370, 108948, 122259, 301281, 423112, 468046, 624010, 681194, 1100398])
def test_a_program_that_was_wrong_once_holds(seed):
    with np.errstate(all='ignore'):
        assert not list(faults_of(seed))


#: What reads and writes files, prints, sets options, or gives what was in the memory.
OTHER = {
    'empty',
    'empty_like',
    'fastCopyAndTranspose',
    'info',
    'source',
    'lookfor',
    'show_config',
    'test',
    'who',
    'disp',
}
OTHER |= {'byte_bounds', 'memmap', 'safe_eval', 'show_runtime', 'printoptions', 'deprecate', 'deprecate_with_doc'}
FILES = ('save', 'load', 'from', 'gen', 'rec', 'ndfrom', 'maf', 'set', 'get', 'add_', 'may_share', 'shares', 'compare')
NAMES = [
    prefix + name
    for prefix, module in (('', np), ('linalg.', np.linalg))
    for name, one in vars(module).items()
    if callable(one) and not isinstance(one, type) and name[0] != '_' and name not in OTHER
    if not name.startswith(FILES)
]
V, M, Z = [1.0, 2.0, 0.5], [[2.0, 0.5], [0.25, 3.0]], [[[1.0, 2.0], [3.0, 5.0]], [[4.0, 1.0], [0.0, 2.0]]]
ARGUMENTS = [(V,), (M,), (Z,), (1.5,), (V, V), (M, M), (M, V), (1.5, V), (V, 1.5), (V, V, V), (V, (1,)), (M, (0,))]
ARGUMENTS += [(Z, Z), (V, ([0],), 1.5), (M, (True,), 1.5)]


def outcome(module, name, arguments):
    """What a function gives, and its arguments after that; or the class of what it raises."""
    function = module
    for part in name.split('.'):
        function = getattr(function, part)
    try:
        return function(*arguments), arguments
    except Exception as error:
        return type(error)


def arrays_of(arguments, make):
    """Arrays for lists, an element of an array for a float, and what is in a tuple as it is."""
    for one in arguments:
        yield one[0] if type(one) is tuple else make(one) if type(one) is list else make([one])[0]


def sourced(numbers):
    flat = [track(number, Source('/node', at)) for at, number in enumerate(np.ravel(numbers).tolist())]
    return tracked_np.array(flat).reshape(np.shape(numbers))


def flat_of(x):
    if isinstance(x, (list, tuple)):
        return [number for part in x for number in flat_of(part)]
    return np.ravel(untracked(x)).tolist()


@pytest.mark.filterwarnings('ignore')
@pytest.mark.parametrize('module', [np, tracked_np])
def test_every_function_of_numpy_gives_what_it_gives_and_is_sent(module, capsys):
    wrong = []
    with np.errstate(all='ignore'):
        for name in NAMES:
            for arguments in ARGUMENTS:
                theirs = outcome(np, name, tuple(arrays_of(arguments, np.array)))
                ours = outcome(module, name, tuple(arrays_of(arguments, sourced)))
                if isinstance(theirs, type) or isinstance(ours, type):
                    if ours is not theirs:
                        wrong.append((name, arguments, str(ours)[:200], str(theirs)[:200]))
                elif repr(flat_of(ours)) != repr(flat_of(theirs)):
                    wrong.append((name, arguments, str(ours)[:200], str(theirs)[:200]))
                else:
                    disassemble([leaf for _, leaf in leaves(ours)])
    assert not wrong
