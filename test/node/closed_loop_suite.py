#!/usr/bin/env python3
"""What holds for `force_field`: what it reports as reached is what messages say, and what is not is taken back."""

import unittest

import rospy
from branching_node import CANNOT, CASES, REACHED, field_of

import rosslt
from support.processes import wait_until

#: By how much a field differs from message to message though nothing is changed.
UNREST = {
    'noisy': 1.0,
    'low_pass_with_provenance': 1e-9,
    'integral': float('inf'),
    'counter': float('inf'),
    'branch_and_time': float('inf'),
}


class Latest:
    """The latest message of a topic, heard by a plain subscriber, which knows nothing of provenance."""

    def __init__(self, one):
        self.values = []
        self._subscriber = rospy.Subscriber(one.name, one.message_class, self._take)

    def _take(self, message):
        self.values.append(
            message.data[0] if isinstance(message.data, (list, tuple)) and message.data else message.data
        )

    def after_two_more(self):
        """The value of a message that was sent after this call."""
        count = len(self.values)
        wait_until(lambda: len(self.values) >= count + 3, 'two more messages')
        return self.values[-1]

    def close(self):
        self._subscriber.unregister()


class Branches(unittest.TestCase):
    """Every force ends at the target, on whichever branch, or says that it cannot."""


class Misuse(unittest.TestCase):
    def test_a_target_of_another_shape_is_refused(self):
        for target in ([1.0], {'data': 1.0}):
            with self.assertRaisesRegex(
                ValueError, 'the target of a message of type std_msgs/Float64 must be one, too'
            ):
                rosslt.force_field('three_branches', '', target)
        with self.assertRaisesRegex(ValueError, 'the target of an array must be a list'):
            rosslt.force_field('gone_above_five', 'data', 1.0)

    def test_what_is_not_there_is_said(self):
        with self.assertRaisesRegex(rospy.ROSException, 'nobody publishes /nothing'):
            rosslt.force_field('nothing', 'data', 1.0)
        with self.assertRaisesRegex(ValueError, 'have no field position'):
            rosslt.force_field('three_branches', 'position', 1.0)


def _test_of(one):
    def test(self):
        latest = Latest(one)
        try:
            for target, expected in one.targets:
                _force(self, one, latest, target, expected)
        finally:
            latest.close()

    return test


def _force(self, one, latest, target, expected):
    before = latest.after_two_more()
    try:
        outcome = rosslt.force_field(one.name, field_of(one), target)
    except rosslt.NotReached as error:
        outcome = error.outcome
        print('{} {}: {}'.format(one.name, target, error))
        self.assertTrue(outcome.is_taken_back, error)
        self.assertFalse(outcome.is_reached)
        self.assertTrue(outcome.reason)
        self.assertIn(CANNOT, expected, error)
        wait_until(lambda: _is_as_before(one, latest, before), 'what it was before')
        return
    except rosslt.Error as error:
        print('{} {}: {}'.format(one.name, target, error))
        self.assertIn(CANNOT, expected, error)
        self.assertTrue(_is_as_before(one, latest, before))
        return
    print('{} {}: {}'.format(one.name, target, outcome))
    self.assertTrue(outcome.is_reached)
    self.assertIn(REACHED, expected, outcome)
    now = latest.after_two_more()
    self.assertLessEqual(abs(now - target), (1e-7 if '32' in one.name else 1e-9) * abs(target), outcome)
    self.assertLessEqual(abs(outcome.seen - target), 1e-7 * abs(target))


def _is_as_before(one, latest, before):
    now = latest.after_two_more()
    return now == before or (one.name in UNREST and abs(now - before) <= UNREST[one.name])


for _one in CASES.values():
    setattr(Branches, 'test_' + _one.name, _test_of(_one))


if __name__ == '__main__':
    import rostest

    rosslt.init_node('closed_loop')
    rostest.rosrun('rosslt', 'closed_loop', '__main__')
