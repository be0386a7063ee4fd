"""The checker of histories finds what is wrong in histories that are wrong on purpose, and nothing in right ones."""

import math
import random

import pytest

from support.history_checker import ELSEWHERE, LOST, ORDER, REFUSED, TWICE, Operation, check


def write(value, begin, end, seen=None, outcome='ok', register='r'):
    return Operation(register, begin, end, outcome, value, seen)


def read(value, begin, end, register='r'):
    return Operation(register, begin, end, 'ok', None, value)


RIGHT = {
    'nothing': [],
    'a change and readings before and after': [read(0.0, 0, 1), write(1.0, 2, 3, 0.0), read(1.0, 4, 5)],
    'a reading during a change sees either': [write(1.0, 0, 10), read(0.0, 1, 2), read(1.0, 3, 4)],
    'changes at the same time, in an order': [write(1.0, 0, 10, 2.0), write(2.0, 0, 10, 0.0), read(1.0, 11, 12)],
    'no answer, and it was never applied': [write(1.0, 0, math.inf, outcome='unknown'), read(0.0, 5, 6)],
    'no answer, and it was applied late': [
        write(1.0, 0, math.inf, outcome='unknown'),
        read(0.0, 5, 6),
        read(1.0, 7, 8),
    ],
    'refused, and never seen': [write(1.0, 0, 1, outcome='refused'), read(0.0, 5, 6)],
    'two registers': [write(1.0, 0, 1), write(2.0, 0, 1, register='s'), read(1.0, 2, 3), read(2.0, 2, 3, 's')],
}

WRONG = {
    'an acknowledged change is not seen afterwards': (LOST, [write(1.0, 2, 3), read(0.0, 4, 5)]),
    'an acknowledged change is lost between two readings': (
        LOST,
        [write(1.0, 0, 1), read(1.0, 2, 3), write(2.0, 4, 5), read(1.0, 6, 7)],
    ),
    'a restart forgets the last change': (LOST, [write(1.0, 0, 1, 0.0), write(2.0, 2, 3, 1.0), read(1.0, 4, 5)]),
    'two changes have replaced the same value': (TWICE, [write(1.0, 0, 9, 0.0), write(2.0, 0, 9, 0.0)]),
    'a change is applied again after another one': (
        TWICE,
        [write(1.0, 0, 1, 0.0), write(2.0, 2, 3, 1.0), write(3.0, 4, 5, 1.0)],
    ),
    'a change is seen in another register': (ELSEWHERE, [write(1.0, 0, 1), read(1.0, 2, 3, 's')]),
    'a value that nobody has written': (ELSEWHERE, [read(7.0, 2, 3)]),
    'a refused change is seen': (REFUSED, [write(1.0, 0, 1, outcome='refused'), read(1.0, 2, 3)]),
    'a change is seen before it was asked for': (ORDER, [read(1.0, 0, 1), write(1.0, 2, 3)]),
    'two readers see two changes in contradictory orders': (
        ORDER,
        [write(1.0, 0, 100), write(2.0, 0, 100), read(1.0, 1, 2), read(2.0, 3, 4), read(1.0, 5, 6), read(2.0, 7, 8)],
    ),
    'a change without an answer is seen, gone, and seen again': (
        ORDER,
        [
            write(1.0, 0, math.inf, outcome='unknown'),
            read(1.0, 1, 2),
            write(2.0, 3, 4),
            read(2.0, 5, 6),
            read(1.0, 7, 8),
        ],
    ),
}


@pytest.mark.parametrize('name', RIGHT)
def test_a_right_history_has_no_fault(name):
    assert check(RIGHT[name]) == []


@pytest.mark.parametrize('name', WRONG)
def test_a_wrong_history_is_found_out(name):
    kind, history = WRONG[name]
    assert kind in {fault.kind for fault in check(history)}


def simulated(seed, count=300):
    """A history of a register that works: every operation takes effect at one moment between its begin and its end."""
    chance = random.Random(seed)
    moments = sorted(chance.uniform(0, 100) for _ in range(count))
    value, history = 0.0, []
    for number, moment in enumerate(moments):
        begin, end = moment - chance.expovariate(1), moment + chance.expovariate(1)
        if chance.random() < 0.5:
            history.append(read(value, begin, end))
        else:
            is_known = chance.random() < 0.9
            old, value = value, float(number + 1)
            history.append(
                write(value, begin, end, old) if is_known else write(value, begin, math.inf, None, 'unknown')
            )
    return history


@pytest.mark.parametrize('seed', range(20))
def test_what_a_register_that_works_does_has_no_fault(seed):
    assert check(simulated(seed)) == []


@pytest.mark.parametrize('seed', range(20))
def test_one_reading_of_an_old_value_is_found_out(seed):
    history = simulated(seed)
    last = max(one.begin for one in history)
    old = next(one.written for one in history if one.written is not None and one.outcome == 'ok')
    assert check([*history, read(old, last + 100, last + 101)]) != []


def test_a_history_in_which_two_changes_write_the_same_is_none():
    with pytest.raises(ValueError, match='written twice'):
        check([write(1.0, 0, 1), write(1.0, 2, 3)])
