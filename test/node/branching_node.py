#!/usr/bin/env python3
"""A node whose fields are computed in other ways for other source values, and the forces that it is to be put to.

Each case publishes a topic of its name. Run as a program, it is the node; imported, it is the table.
"""

import itertools
import random
import time

import rospy
from std_msgs.msg import Float32, Float64, Float64MultiArray, Int32

import rosslt

#: What a force must come to: the field has the value; the force says that it cannot, and what it changed is taken back;
#: or one of both.
REACHED, CANNOT, AT_LAST = 'reached', 'cannot', 'reached or cannot'

RATE = 50
CASES = {}


class Case:
    def __init__(self, function, message_class, targets):
        self.function, self.message_class, self.targets = function, message_class, targets
        self.name = function.__name__

    def literal(self, name, value, **limits):
        return rosslt.location(value, name='{}/{}'.format(self.name, name), **limits)


def case(*targets, message_class=Float64):
    """Decorates `function(literal, state)`: what a node publishes, and [(target, what it comes to)], in this order."""

    def add(function):
        CASES[function.__name__] = Case(function, message_class, targets)
        return function

    return add


@case((3.0, REACHED), (7.0, CANNOT), (2.0, REACHED), (20.0, CANNOT), (-1.0, REACHED))
def one_or_the_other(literal, _):
    a = literal('a', 1.0)
    return a if a < 5 else literal('b', 10.0)


@case((8.0, REACHED), (18.0, REACHED), (9.0, REACHED), (12.0, CANNOT), (15.0, REACHED))
def steeper_above_five(literal, _):
    a = literal('a', 1.0)
    return 2 * a if a < 5 else 3 * a


@case((2.0, REACHED), (7.0, CANNOT), (-7.0, REACHED))
def limited_by_a_number(literal, _):
    return min(literal('a', 1.0), 4.0)


@case((0.5, REACHED), (3.0, CANNOT), (-3.0, CANNOT))
def between_two_literals(literal, _):
    return max(literal('low', -1.0), min(literal('high', 1.0), literal('a', 0.0)))


@case((2.0, CANNOT), (1.5, CANNOT))
def one_of_two_numbers(literal, _):
    return 1.0 if literal('a', 1.0) < 5 else 2.0


@case((3.0, REACHED), (2.34, CANNOT), (-7.0, REACHED))
def rounded_where_nobody_sees_it(literal, _):
    a = literal('a', 1.0)
    return a + (round(float(a)) - float(a))


@case((7, REACHED), (-2, REACHED), message_class=Int32)
def made_whole(literal, _):
    return rosslt.to_int(literal('a', 1.5))


@case((4.0, REACHED), (4.5, CANNOT))
def whole_part(literal, _):
    return literal('a', 1.5) // 1.0


@case((4.5, REACHED), (3.5, REACHED), (-6.5, REACHED))
def turned_over_in_every_second_cell(literal, _):
    a = literal('a', 0.5)
    return a if int(a) % 2 == 0 else -a


@case((4.0, REACHED), (8.0, REACHED), (2.0, REACHED), (16.0, REACHED))
def hysteresis(literal, state):
    a = literal('a', 1.0)
    state['on'] = a > 3 if state.get('on') else a > 5
    return 2 * a if state['on'] else a


@case((0.0, CANNOT), (1e6, CANNOT))
def counter(literal, state):
    state['n'] = state.get('n', 0) + 1
    return literal('a', 1.0) + state['n']


@case((3.0, CANNOT), (5e3, CANNOT))
def branch_and_time(literal, _):
    a = literal('a', 1.0)
    return (a if a < 50 else 2 * a) + 0.1 * (time.monotonic() % 100)


# It comes to its value in many messages: whether all of them are waited for depends on how they come.
@case((2.0, AT_LAST), (-1.0, AT_LAST))
def low_pass_with_provenance(literal, state):
    a = literal('a', 1.0)
    state['y'] = state.get('y', a) + 0.6 * (a - state.get('y', a))
    return state['y']


@case((-50.0, CANNOT))
def integral(literal, state):
    state['x'] = float(state.get('x', 0.0)) + 0.02 * literal('speed', 1.0) * 0.5
    return state['x']


@case((0.5, REACHED), (12.0, REACHED), (40.0, REACHED))
def three_branches(literal, _):
    a = literal('a', 0.25)
    return a if a < 1 else 2 * a if a < 10 else a / 2


@case((5.0, REACHED), (-3.0, REACHED))
def looked_up_in_a_list(literal, _):
    return [literal('first', 1.0), literal('second', 2.0)][int(literal('which', 1.0))]


@case((2.5, REACHED), (2.3, CANNOT))
def setter_that_rounds(literal, state):
    if 'held' not in state:
        state['held'] = 1.0
        state['place'] = lambda: rosslt.location(
            getter=lambda: state['held'],
            setter=lambda value: state.update(held=round(2 * value) / 2),
            name='setter_that_rounds/a',
        )
    return 1.0 * state['place']()


@case((0.1, REACHED), (1e30, REACHED), message_class=Float32)
def of_32_bits(literal, _):
    return 2 * literal('a', 1.0)


@case((1.0, CANNOT), (500.0, CANNOT))
def noisy(literal, _):
    return literal('a', 1.0) + random.gauss(0.0, 0.1)


@case((2.0, REACHED), (9.0, CANNOT), message_class=Float64MultiArray)
def gone_above_five(literal, _):
    a = literal('a', 1.0)
    return [a] if a < 5 else []


@case((2.0, REACHED), (9.0, CANNOT))
def silent_above_five(literal, _):
    a = literal('a', 1.0)
    return a if a < 5 else None


@case((3.0, REACHED), (0.5, REACHED))
def read_once(literal, state):
    state.setdefault('gain', literal('gain', 2.0))
    return state['gain'] * 0.5


def field_of(one):
    return 'data[0]' if one.message_class is Float64MultiArray else 'data'


def message_of(one, value):
    return Float64MultiArray(data=value) if one.message_class is Float64MultiArray else one.message_class(value)


def main():
    rosslt.init_node('branching')
    publishers = {name: rosslt.Publisher(name, one.message_class, queue_size=10) for name, one in CASES.items()}
    states = {name: {} for name in CASES}
    rate = rospy.Rate(RATE)
    for _ in itertools.count():
        for name, one in CASES.items():
            value = one.function(one.literal, states[name])
            if value is not None:
                publishers[name].publish(message_of(one, value))
        if rospy.is_shutdown():
            return
        rate.sleep()


if __name__ == '__main__':
    main()
