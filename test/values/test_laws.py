"""The laws of well-behaved lenses, over random expressions."""

import os
import pickle
import random

import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from rosslt import NotInvertible, evaluate, is_tracked, solve, sources, track, untracked
from rosslt.values import affine, assemble, disassemble, lazy, reapply
from support.expressions import ROWS, SOURCES, applied, expressions, linear_expressions, numbers, pools, scalars, usable

# Without a database and without its search for extremes, Hypothesis spends its time on examples. Which examples these
# are, and that none has a deadline, the profile says (test/conftest.py).
many = settings(
    max_examples=2000 if os.environ.get('ROSSLT_MANY_EXAMPLES') else 100,
    suppress_health_check=list(HealthCheck),
    database=None,
    phases=(Phase.explicit, Phase.generate, Phase.shrink),
)


BITWISE = ('and', 'or', 'xor', 'ldexp')
"""Rows for whole numbers alone."""


def is_met(found, target, present):
    """The relative 1e-9 of the law; next to 0 a picometre, for a value that was of ordinary size."""
    if not isinstance(found, float):
        return found == target
    return abs(found - target) <= max(1e-9 * abs(target), 1e-12 * min(1.0, abs(present)))


def check_answer(value, target, answer):
    for source, new in answer.items():
        assert source in sources(value)
        assert type(new) in (float, int, bool, str)
        assert isinstance(new, str) or new - new == 0
    assert is_met(evaluate(value, answer), target, untracked(value))


@many
@given(expressions(), scalars)
def test_put_get_what_is_solved_for_is_what_one_gets(value, target):
    try:
        answer = solve(value, target)
    except NotInvertible:
        return
    check_answer(value, target, answer)
    if len(answer) != 1:
        # Several sources move only where none of them alone can.
        for source in answer:
            with pytest.raises(NotInvertible):
                solve(value, target, source)


@many
@given(expressions(), st.sampled_from(SOURCES), scalars)
def test_put_get_holds_for_targets_that_some_source_value_gives(value, source, new):
    assume(source in sources(value))
    try:
        target = evaluate(value, {source: new})
    except (ArithmeticError, ValueError, TypeError):
        return
    assume(usable(target))
    try:
        answer = solve(value, target, source)
    except NotInvertible:
        return
    assert list(answer) == [source]
    check_answer(value, target, answer)


def is_ordinary(value):
    """Whether a number is neither so large nor so small that rounding decides what can be reached."""
    return isinstance(value, float) and (value == 0 or 1e-4 <= abs(value) <= 1e4)


def random_expression(chance):
    """A random expression over floats, its sources and their values; all its parts are of ordinary size."""
    numbers = [round(chance.uniform(-3, 3), 3) for _ in SOURCES]
    pool = [track(number, source) for number, source in zip(numbers, SOURCES)]
    while len(pool) < len(SOURCES) + 5:
        row = chance.choice(REACHABLE)
        operands = [pool[-1 - int(chance.random() ** 2 * len(pool))] for _ in range(row.arity)]
        if row.arity == 2 and chance.random() < 0.5:
            operands[chance.randrange(2)] = round(chance.uniform(-3, 3), 3)
        made = applied(row, *operands)
        if made is not None and is_ordinary(untracked(made)):
            pool.append(made)
    return pool[-1]


UNREACHABLE = {
    'floordiv',
    'mod',
    'fmod',
    'remainder',
    'round',
    'round_to',
    'trunc',
    'floor',
    'ceil',
    'copysign',
    'bool',
}
"""Rows with jumps, where what is reached may be a single point."""

REACHABLE = [row for row in ROWS if row.name not in UNREACHABLE and not row.on_text and row.name not in BITWISE]


def test_a_target_that_a_source_value_gives_is_reached():
    """A solver that refuses what it should find breaks no other law; this one counts."""
    chance = random.Random(11)
    asked = refused = 0
    while asked < 2000:
        value = random_expression(chance)
        source = chance.choice(sources(value))
        try:
            target = evaluate(value, {source: round(chance.uniform(-3, 3), 3)})
        except (ArithmeticError, ValueError, TypeError):
            continue
        if not is_ordinary(target):
            continue
        asked += 1
        try:
            answer = solve(value, target, source)
        except NotInvertible:
            refused += 1
            continue
        check_answer(value, target, answer)
    assert refused <= 0.001 * asked


@pytest.mark.parametrize('name', ['add', 'sub', 'mul', 'neg', 'float'])
def test_a_target_of_a_chain_without_branches_is_always_reached(name):
    """Where an operation has one inverse, there is no reason to refuse what it gave."""
    (row,) = [row for row in ROWS if row.name == name]
    chance = random.Random(name)
    for _ in range(500):
        value = track(chance.uniform(-3, 3), SOURCES[0])
        for _ in range(4):
            value = applied(row, value) if row.arity == 1 else applied(row, value, chance.uniform(0.5, 3))
        target = evaluate(value, {SOURCES[0]: chance.uniform(-3, 3)})
        check_answer(value, target, solve(value, target))


@many
@given(expressions())
def test_get_put_solving_for_the_present_value_changes_nothing(value):
    ((source, new),) = solve(value, untracked(value)).items()
    assert evaluate(value, {source: new}) == untracked(value)
    assert sources(value)
    assert new == present_values(value)[source]


def present_values(value):
    instructions, _ = disassemble([value])
    return {instruction[1]: instruction[2] for instruction in instructions if instruction[0] == 'source'}


@many
@given(pools(numbers, 6), st.tuples(numbers, numbers, numbers), st.integers(1, 3))
def test_put_get_holds_for_several_results_together(pool, targets, count):
    values = pool[-count:]
    targets = list(targets[: len(values)])
    try:
        answer = solve(values, targets)
    except NotInvertible:
        return
    size = max(abs(number) for number in untracked(values) + targets)
    for target, found in zip(targets, evaluate(values, answer)):
        assert is_met(found, target, size)


@many
@given(pools(most=6))
def test_get_put_holds_for_several_results_together(pool):
    assert solve(pool, untracked(pool)) == {}


@many
@given(expressions())
def test_evaluating_without_changes_gives_the_present_value(value):
    assert evaluate(value, {}) == untracked(value)
    assert reapply(value, {}) == untracked(value)


@many
@given(expressions(), st.sampled_from(SOURCES), scalars)
def test_evaluating_is_the_same_however_an_expression_travelled(value, source, new):
    def outcome(expression):
        try:
            return repr(evaluate(expression, {source: new}))
        except (ArithmeticError, ValueError, TypeError) as error:
            return type(error)

    instructions, (root,) = disassemble([value])
    expected = outcome(value)
    assert outcome(assemble(instructions)[root]) == expected
    assert outcome(pickle.loads(pickle.dumps(value))) == expected
    assert outcome(lazy([untracked(value)], [lambda _: value])[0]) == expected
    again = assemble(instructions)[root]
    assert sources(again) == sources(value)
    assert type(again) is type(value)


@many
@given(linear_expressions(), st.floats(-50, 50))
def test_the_terms_of_an_affine_value_foretell_it(value, new):
    terms = affine(value)
    assume(terms)
    assert [term[0] for term in terms] == sources(value)
    size = max(abs(number) for step in disassemble([value])[0] for number in step[1:] if isinstance(number, float))
    for source, at, slope in terms:
        size = max(size, abs(slope) * (abs(at) + 50), abs(untracked(value)))
        assume(size < 1e6)
        foretold = untracked(value) + slope * (new - at)
        assert abs(evaluate(value, {source: new}) - foretold) <= 1e-6 * max(1.0, size)


def test_an_untracked_value_stays_one():
    assert not is_tracked(untracked(track(1.0, SOURCES[0])))
