#!/usr/bin/env python3
"""What was dropped is shown where it was dropped, also where its node takes another branch then."""

import json
import time
import unittest

import rospy
import rostest
from rosslt.msg import AppliedChange
from std_msgs.msg import Int32
from visualization_msgs.msg import MarkerArray

import rosslt
from support.hand import Hand, wait_until

NOISE = 1e-5  # RViz reports in 32 bits
HELD = 60  # in how many steps a thing is dragged that is to be seen moving meanwhile
A_WHILE = 1.5  # longer than a check looks at a second message, in seconds


class Dropping(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.hand, cls.live = Hand(), Hand('/live')
        cls.changes = []
        rospy.Subscriber('/branching_stage/rosslt/changes', AppliedChange, cls.changes.append)
        for name in ('steeper', 'limited', 'gap', 'moving', 'ticking', 'setting_off', 'patrol', 'gone_on'):
            cls.hand.marker(handle(name))
        for name in ('patrol', 'spaced'):
            cls.live.marker(handle(name))

    def is_at(self, name, x):
        return lambda: abs(self.hand.position(handle(name))[0] - x) < NOISE * max(1.0, abs(x))

    def drop(self, name, x):
        """Drag a marker to some x in one go, and let go."""
        start = self.hand.position(handle(name))[0]
        self.hand.drag(handle(name), dx=x - start, steps=1)

    def test_another_branch_is_solved_in_turn(self):
        self.drop('steeper', 18.0)
        wait_until(lambda: abs(parameter('a') - 6.0) < NOISE, lambda: 'a to become 6; it is {}'.format(parameter('a')))
        wait_until(self.is_at('steeper', 18.0), 'the cube to be where it was dropped')
        self.drop('steeper', 8.0)
        wait_until(lambda: abs(parameter('a') - 4.0) < NOISE, lambda: 'a to become 4; it is {}'.format(parameter('a')))
        self.hand.choose(handle('steeper'), 'Undo')
        wait_until(lambda: abs(parameter('a') - 6.0) < NOISE, 'the whole drag to be taken back')

    def test_a_limit_that_stands_in_the_way_stays(self):
        """The hand changes the number that it took hold of, and no other."""
        self.drop('limited', 3.5)
        wait_until(lambda: 'b' in self.changed(), 'the source to follow')
        wait_until(self.is_at('limited', 2.0), 'the cube to be at its limit')
        time.sleep(A_WHILE)
        self.assertEqual(parameter('limit'), 2.0)

    def test_a_drag_ends_when_a_patrol_goes_on(self):
        waypoint = rospy.Publisher('waypoint', Int32, queue_size=1)
        wait_until(waypoint.get_num_connections, 'the patrol to hear')
        held = self.live.press(handle('patrol'))
        self.addCleanup(self.live.release, held)
        self.live.move(held, dx=0.5)
        wait_until(lambda: abs(parameter('first') - 1.5) < NOISE, 'the first waypoint to follow')
        waypoint.publish(1)
        wait_until(lambda: self.is_told_of_the_second(held), 'the hand to be told')
        self.live.release(held)
        wait_until(
            lambda: abs(self.live.position(handle('patrol'))[0] - 5.0) < NOISE, 'the cube to be at the second waypoint'
        )
        self.live.drag(handle('patrol'), dx=0.5)
        wait_until(lambda: abs(parameter('second') - 5.5) < NOISE, 'the second waypoint to follow a hand of its own')
        self.assertLess(abs(parameter('first') - 1.5), 0.2)
        waypoint.publish(0)
        wait_until(self.is_at('patrol', parameter('first')), 'the cube to be at the first waypoint')

    def test_a_hand_keeps_its_target_if_the_next_has_the_same_numbers(self):
        waypoint = rospy.Publisher('waypoint', Int32, queue_size=1)
        wait_until(waypoint.get_num_connections, 'the patrol to hear')
        self.addCleanup(waypoint.publish, 0)
        seen = []
        rospy.Subscriber('branching', MarkerArray, lambda message: seen.append(shown(message, 'spaced')))
        held = self.live.press(handle('spaced'))
        self.live.move(held, dx=0.5)
        waypoint.publish(1)
        wait_until(lambda: seen and seen[-1] > 4.0, 'the next target to be shown')
        self.live.move(held, dx=0.5, steps=20)
        self.live.release(held)
        wait_until(
            lambda: abs(parameter('spaced') - 2.0) < NOISE, lambda: 'spaced to become 2: %s' % parameter('spaced')
        )
        wait_until(
            lambda: abs(self.live.position(handle('spaced'))[0] - 6.0) < NOISE, 'the cube to be at the second target'
        )
        time.sleep(A_WHILE)
        self.assertEqual(max(map(abs, self.values_of('spaced'))), parameter('spaced'))

    def is_told_of_the_second(self, held):
        self.live.move(held, dx=0.001)
        note = handle('patrol') + ':note'
        if note not in self.live.names():
            return False
        return self.live.marker(note).controls[0].markers[0].text.replace('\n', ' ') == 'it comes from second now'

    def test_what_stays_elsewhere_is_taken_back(self):
        """The cube is never between 10 and 15, whatever its source is."""
        self.drop('gap', 12.0)
        wait_until(lambda: len(self.values_of('c')) > 1, 'c to be tried')
        wait_until(
            lambda: self.values_of('c')[-1] == 1.0, lambda: 'c to be 1 again; it became %s' % self.values_of('c')
        )
        wait_until(self.is_at('gap', 2.0), 'the cube to be where it was')
        time.sleep(A_WHILE)
        self.assertEqual(self.values_of('c')[-1], 1.0)

    def test_what_moves_by_itself_is_changed_once(self):
        self.drop('moving', 30.0)
        wait_until(lambda: 'start' in self.changed(), 'the start to follow')
        time.sleep(A_WHILE)
        self.assertEqual(self.changed().count('start'), 1)

    def test_what_moves_at_a_lower_rate_than_it_is_sent_is_changed_once(self):
        name = handle('ticking')
        self.hand.drag(name, dx=30.0 - self.hand.position(name)[0], steps=HELD)
        wait_until(lambda: 'tick' in self.changed(), 'the source to follow')
        time.sleep(A_WHILE)
        self.assertEqual(self.changed().count('tick'), 1)

    def test_what_begins_to_move_once_it_is_dropped_is_changed_once(self):
        self.drop('setting_off', 30.0)
        wait_until(lambda: 'off' in self.changed(), 'the source to follow')
        wait_until(lambda: self.hand.position(handle('setting_off'))[0] > 30.01, 'it to move on')
        self.assertEqual(len(self.values_of('off')), 1, self.values_of('off'))

    def test_what_its_node_only_began_with_is_changed_back(self):
        """What it has gone on from is no longer the source's value."""
        self.drop('gone_on', 30.0)
        wait_until(lambda: self.values_of('begun')[-1:] == [0.0], lambda: f'it to be undone: {self.values_of("begun")}')
        wait_until(lambda: self.hand.position(handle('gone_on'))[0] < 5.0, 'the cube to be where its node has it')

    def test_what_stands_on_the_ground_grows_until_it_reaches_the_hand(self):
        name = handle('tower') + ':scale.z'
        for hand, by, height in ((self.hand, 0.5, 2.5), (self.live, -1.0, 1.5)):
            hand.release(hand.press(handle('tower')))  # a click has it show its sizes
            hand.drag(name, dz=by, steps=20)
            wait_until(lambda there=height: abs(parameter('height') - there) < NOISE, 'the height to follow')
            wait_until(
                lambda there=height, hand=hand: abs(hand.position(name)[2] - there) < NOISE, 'the top to be at the hand'
            )
            time.sleep(A_WHILE)
            self.assertLess(abs(parameter('height') - height), NOISE)

    def values_of(self, name):
        """What a location has become, in turn."""
        return [json.loads(change.new_value) for change in self.changes if change.name == name]

    def changed(self):
        return [change.name for change in self.changes]


def handle(name):
    return '/branching:{}:0'.format(name)


def shown(message, name):
    return next(marker.pose.position.x for marker in message.markers if marker.ns == name)


def parameter(name):
    return rospy.get_param('/branching_stage/rosslt/' + name)


if __name__ == '__main__':
    rosslt.init_node('check_dropping')
    rostest.rosrun('rosslt', 'check_dropping', Dropping)
