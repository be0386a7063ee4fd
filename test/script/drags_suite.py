#!/usr/bin/env python3
"""What demo.launch promises: whatever is dragged, the right numbers in the script change, and it is where it was
dropped. Each drag is told by the text of the file."""

import re
import sys
import time
import unittest
from pathlib import Path

import rospy
import rostest
from rosgraph_msgs.msg import Clock
from rosslt.msg import PoseTracked
from visualization_msgs.msg import Marker, MarkerArray

import rosslt
from support.hand import Hand, wait_until

SCRIPT = Path(rospy.myargv()[1])
TICK = 20_000_000  # ns, one turn of the nodes; whole, since a node waits for another tick if one is too short by 1 ns
PRECISION = 0.001
A_WHILE = 1.5  # s, longer than it is looked whether something else is shown where a thing was dropped
LINE, CONTROL, END = range(3)


class Time:
    """The simulated time, which stands still unless it is told to move.

    Args:
        topics: {topic: class of its messages}, what the nodes publish once a tick.
    """

    def __init__(self, topics):
        self._counts = {}
        for topic, kind in topics.items():
            self._counts[topic] = 0
            rospy.Subscriber(topic, kind, self._count, topic)
        self._publisher = rospy.Publisher('/clock', Clock, queue_size=1, latch=True)
        self._ticks = 0

    def _count(self, _message, topic):
        self._counts[topic] += 1

    def tick(self, timeout=1.0):
        """Move it by one tick, and wait until the nodes have gone along.

        Where it moves while `rospy.Rate` is about to sleep, a node sleeps for another tick.

        Returns:
            The topics without a message of this tick: those of nodes that stand still.
        """
        before = dict(self._counts)
        self._ticks += 1
        self._publisher.publish(rospy.Time(1000, self._ticks * TICK))
        deadline = time.monotonic() + timeout
        while True:
            missing = [topic for topic in before if self._counts[topic] == before[topic]]
            if not missing or time.monotonic() > deadline:
                return missing
            time.sleep(0.001)

    def begin_anew(self):
        """Set it back, as where a bag is played in a loop."""
        self._ticks = 0
        wait_until(lambda: not self.tick(0.1), 'the nodes to go along with time', 40.0)

    def move_until(self, holds, what, ticks=3000):
        """Move it until something holds."""
        silent = 0
        for _ in range(ticks):
            if holds():
                return
            missing = self.tick()
            silent = silent + 1 if missing else 0
            if silent > 30:
                raise AssertionError('time moved on, and nothing came on {}'.format(', '.join(missing)))
        raise AssertionError('not within {} ticks: {}'.format(ticks, what))


class Drags(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.trajectory = cls.quadcopter = None
        cls.time = Time({'trajectory': PoseTracked, 'quadcopter': Marker})
        rosslt.Subscriber('trajectory_markers', MarkerArray, cls.take_trajectory)
        rosslt.Subscriber('quadcopter', Marker, cls.take_quadcopter, keep_provenance=True)
        wait_until(lambda: not cls.time.tick(0.1) and cls.trajectory, 'the nodes to go along with time', 40.0)
        cls.hand = Hand()

    @classmethod
    def take_trajectory(cls, markers):
        cls.trajectory = markers.markers

    @classmethod
    def take_quadcopter(cls, marker):
        cls.quadcopter = marker

    def fly(self, text, end, progress):
        """Save a script, and let time pass until a part of the flight to its waypoint is over; as `fly_on`."""
        SCRIPT.write_text(text)
        self.time.move_until(lambda: near(place(self.trajectory[END].pose.position), end), 'the flight to begin')
        return self.fly_on(progress)

    def progress(self, position):
        """How much of a flight is over at a position of it: by how much that moves when the end moves."""
        (source,) = rosslt.sources(self.trajectory[END].pose.position.x)
        if source not in rosslt.sources(position.x):
            return 0.0
        return rosslt.evaluate(position.x, {source: 1.0}) - rosslt.evaluate(position.x, {source: 0.0})

    def fly_on(self, progress):
        """Let time pass until a part of the flight is over; give the position of the quadcopter."""
        self.time.move_until(
            lambda: self.progress(self.quadcopter.pose.position) > progress - 1e-6, 'the flight to be on its way'
        )
        return self.quadcopter.pose.position

    def drag(self, name, dx, dy, dz):
        """Drag a handle, and give where it has been dropped."""
        wait_until(lambda: near(self.hand.position(name), self.shown(name)), 'the handle ' + name)
        x, y, z = self.hand.position(name)
        self.hand.drag(name, dx=dx, dy=dy, dz=dz)
        return x + dx, y + dy, z + dz

    def shown(self, name):
        """Where the thing is that a handle belongs to."""
        if name.startswith('/quadcopter'):
            return place(self.quadcopter.pose.position)
        point = re.search(r'points\[(\d+)\]', name)
        if point:
            return place(self.trajectory[LINE].points[int(point.group(1))])
        return place(self.trajectory[CONTROL if 'control' in name else END].pose.position)

    def assert_script_becomes(self, template, *expected, within=0.51 * PRECISION):
        """The file holds this very text, with numbers in the places of `{}`; give them."""
        pattern = re.escape(template).replace(re.escape('{}'), r'(-?\d+(?:\.\d{1,3})?)')

        def numbers():
            match = re.fullmatch(pattern, SCRIPT.read_text())
            return match and [float(number) for number in match.groups()]

        wait_until(
            lambda: numbers() and near(numbers(), expected, within),
            lambda: '{!r} with {}; it is {!r}'.format(template, expected, SCRIPT.read_text()),
            5.0,
        )
        return numbers()

    def assert_comes_to(self, what, where):
        """With the next ticks, something is where it ought to be."""
        self.time.move_until(lambda: near(place(what()), where, 0.51 * PRECISION), '{} at {}'.format(what, where))

    def test_dragging_the_end_point_changes_the_waypoint(self):
        self.fly('# home\ngoto(2.0, 1, -0.5)    # x, y, z\nwait(9)\n', (2.0, 1.0, -0.5), 0.25)
        dropped = self.drag('/trajectory_markers:end:0', 0.5, -1.75, 1.0)
        self.assert_script_becomes('# home\ngoto({}, {}, {})    # x, y, z\nwait(9)\n', *dropped)
        self.assertIn('goto(2.5, -0.75, 0.5)', SCRIPT.read_text())
        self.assert_comes_to(lambda: self.trajectory[END].pose.position, dropped)

    def test_dragging_a_point_of_the_curve_changes_the_waypoint_so_that_the_curve_goes_through_there(self):
        self.fly('height = 2\ngoto(1.0, -2.0, height - 0.5)\n', (1.0, -2.0, 1.5), 0.25)
        start = place(self.trajectory[LINE].points[0])
        dropped = self.drag('/trajectory_markers:curve:0:points[3]', 0.2, 0.3, 0.15)
        end = [a + (b - a) / 0.3 for a, b in zip(start, dropped)]
        self.assert_script_becomes('height = {}\ngoto({}, {}, height - 0.5)\n', end[2] + 0.5, *end[:2])
        self.assert_comes_to(lambda: self.trajectory[LINE].points[3], dropped)

    def test_dragging_the_control_point_changes_the_waypoint(self):
        text = 'def over(x, y):\n    goto(x, -y, {})\n\nfor x, y in [({}, {})]:\n    over(x, y / 2)\n'
        self.fly(text.format(1.5, 2.0, 4.0), (2.0, -2.0, 1.5), 0.25)
        start = place(self.trajectory[LINE].points[0])
        dropped = self.drag('/trajectory_markers:control:0', -0.4, 0.3, 0.25)
        end = [2 * b - a for a, b in zip(start, dropped)]
        self.assert_script_becomes(text, end[2], end[0], -2 * end[1])
        self.assert_comes_to(lambda: self.trajectory[CONTROL].pose.position, dropped)

    def test_dragging_the_quadcopter_in_mid_flight_changes_the_waypoint_so_that_it_flies_through_there(self):
        """The waypoint occurs in its position twice, as the end and in the control point.

        It is as round as a hand can tell at the quadcopter, which moves by less than the waypoint.
        """
        before = (-1.5, -1.0, 2.5)
        here = self.fly('goto(-1.5, -1.0, 2.5)\nspare = 0\n', before, 0.4)
        start, progress = place(self.trajectory[LINE].points[0]), self.progress(here)
        moved = (0.3, 0.2, -0.25)
        dropped = self.drag('/quadcopter:quadcopter:0', *moved)
        end = [a + (b - a) / progress for a, b in zip(start, dropped)]
        end = self.assert_script_becomes('goto({}, {}, {})\nspare = 0\n', *end, within=0.51 * PRECISION / progress)
        overshooting = [old + by / progress**2 for old, by in zip(before, moved)]
        self.assertFalse(near(end, overshooting, 0.5), 'the first occurrence alone would have to move that far')

        self.assert_comes_to(lambda: self.trajectory[END].pose.position, end)
        there = {
            rosslt.sources(old)[0]: float(new)
            for old, new in zip(parts(here), parts(self.trajectory[END].pose.position))
        }
        there = [rosslt.evaluate(part, there) for part in parts(here)]
        self.assertTrue(
            near(there, dropped, 0.51 * PRECISION),
            'where it was dragged, the new flight is at {} instead of {}'.format(there, dropped),
        )
        for progress in (0.6, 1.0):
            here = self.fly_on(progress)
            on_the_way = [a + self.progress(here) * (b - a) for a, b in zip(start, end)]
            self.assertTrue(
                near(place(here), on_the_way, 0.51 * PRECISION),
                'the quadcopter is at {} instead of {}'.format(place(here), on_the_way),
            )

    def test_a_script_that_is_written_anew_after_a_drop_keeps_its_numbers(self):
        self.fly('old = 0\ngoto(1.5, 0.5, 1.0)\n', (1.5, 0.5, 1.0), 0.25)
        dropped = self.drag('/trajectory_markers:control:0', 0.25, 0.5, 0.25)
        self.assert_script_becomes('old = 0\ngoto({}, {}, {})\n', *self.end_for(dropped))
        self.assert_anew_is_kept()

    def test_a_script_that_is_written_anew_under_a_hand_keeps_its_numbers(self):
        self.fly('old = 0\ngoto(1.5, 0.5, 1.0)\n', (1.5, 0.5, 1.0), 0.25)
        name = '/trajectory_markers:control:0'
        wait_until(lambda: near(self.hand.position(name), self.shown(name)), 'the handle ' + name)
        x, y, z = self.hand.position(name)
        held = self.hand.press(name)
        self.hand.move(held, 0.25, 0.5, 0.25)
        dropped = x + 0.25, y + 0.5, z + 0.25
        self.assert_script_becomes('old = 0\ngoto({}, {}, {})\n', *self.end_for(dropped))
        self.assert_anew_is_kept(lambda: (self.hand.move(held, 0.1, 0.1, 0.1), self.hand.release(held)))

    def end_for(self, control):
        """Where a flight ends that has its control point there."""
        return [2 * b - a for a, b in zip(place(self.trajectory[LINE].points[0]), control)]

    def assert_anew_is_kept(self, then=lambda: None):
        text, end = 'new = 0\ngoto(-1.0, 2.0, 1.5)\n', (-1.0, 2.0, 1.5)
        self.fly(text, end, 0.25)
        wait_until(lambda: near(self.hand.position('/trajectory_markers:end:0'), end), 'the new flight to be seen')
        then()
        deadline = time.monotonic() + A_WHILE
        while time.monotonic() < deadline:
            self.time.tick()
        self.assertEqual(SCRIPT.read_text(), text)

    def test_nodes_go_on_where_time_begins_anew(self):
        self.fly('goto(0.5, -0.5, 0.5)\n', (0.5, -0.5, 0.5), 0.25)
        self.time.begin_anew()
        self.fly('goto(-0.5, 0.5, 1.0)\n', (-0.5, 0.5, 1.0), 0.25)

    def test_dragging_the_quadcopter_where_it_rests_moves_it_there(self):
        self.fly('goto(1.0, 1.0, 1.0)\na = b = 0\n', (1.0, 1.0, 1.0), 1.0)
        dropped = self.drag('/quadcopter:quadcopter:0', 0.25, -0.5, 0.125)
        self.assert_script_becomes('goto({}, {}, {})\na = b = 0\n', *dropped)
        self.assert_comes_to(lambda: self.quadcopter.pose.position, dropped)


def parts(position):
    return position.x, position.y, position.z


def place(position):
    return tuple(map(float, parts(position)))


def near(first, second, tolerance=1e-6):
    return all(abs(a - b) <= tolerance for a, b in zip(first, second))


if __name__ == '__main__':
    rosslt.init_node('drags')
    rostest.rosrun('rosslt', 'drags', Drags, sys.argv)
