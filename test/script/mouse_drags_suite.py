#!/usr/bin/env python3
"""What a mouse in a real RViz does to the script of demo.launch."""

import re
import sys
from pathlib import Path

import rospy
import rostest
from visualization_msgs.msg import InteractiveMarkerFeedback, Marker, MarkerArray

import rosslt
from support.hand import wait_until
from support.mouse import MouseCase

SCRIPT = Path(rospy.myargv()[1])
QUADCOPTER, END = '/quadcopter:quadcopter:0', '/trajectory_markers:end:0'
ON_SPHERE, ON_ROTOR = 0.07, 0.13  # m along x and y from the middle, where an arrow points at the eye


class MouseDrags(MouseCase):
    config = rospy.myargv()[2]
    topic, node = '/trajectory_markers', '/interactive_script'
    spots = (-3.5, 2.5), (3.5, -2.5)

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.quadcopter, cls.curve = None, []
        rosslt.Subscriber('quadcopter', Marker, cls.take_quadcopter, keep_provenance=True)
        rosslt.Subscriber('trajectory_markers', MarkerArray, cls.take_curve)

    @classmethod
    def take_quadcopter(cls, marker):
        cls.quadcopter = marker.pose.position

    @classmethod
    def take_curve(cls, markers):
        # The spots that pixels are measured by come on the same topic, and may come later.
        cls.curve = next((marker.points for marker in markers.markers if marker.ns == 'curve'), cls.curve)

    def fly(self, text, x, y):
        SCRIPT.write_text(text)
        wait_until(
            lambda: self.curve and abs(self.curve[-1].x - x) + abs(self.curve[-1].y - y) < 1e-6,
            'a curve to ({}, {})'.format(x, y),
        )
        self.inserts.clear()

    def progress(self):
        (source,) = rosslt.sources(self.curve[-1].x)
        here = self.quadcopter.x
        if source not in rosslt.sources(here):
            return 0.0
        return rosslt.evaluate(here, {source: 1.0}) - rosslt.evaluate(here, {source: 0.0})

    def waypoint(self):
        """The numbers of the first waypoint in the script."""
        return [float(number) for number in re.findall(r'-?[\d.]+', SCRIPT.read_text().splitlines()[0])]

    def test_dragging_the_end_point_changes_the_waypoint(self):
        self.fly('goto(2.0, 1.0, 0.5)  # to the window\n', 2.0, 1.0)
        right, down = self.drag((2.0 + ON_SPHERE, 1.0 + ON_SPHERE), (1.0, -1.5), END)
        x, y = 2.0 + right / self.screen.scale, 1.0 - down / self.screen.scale
        wait_until(
            lambda: abs(self.waypoint()[0] - x) + abs(self.waypoint()[1] - y) < 2.0 / self.screen.scale,
            lambda: 'goto({:.3f}, {:.3f}, 0.5); the script is {}'.format(x, y, SCRIPT.read_text()),
        )
        self.assertRegex(SCRIPT.read_text(), r'^goto\(\S+, \S+, 0.5\)  # to the window\n$')

    def test_dragging_the_quadcopter_in_mid_flight_has_the_curve_go_where_it_was_dropped(self):
        self.fly('goto(-2.0, 1.5, 0.0)\n# back home\nwait(5)\n', -2.0, 1.5)
        wait_until(lambda: self.progress() > 0.07, 'the quadcopter to be in mid-flight', 60.0)
        at = self.drag_quadcopter(0.3, 0.2)
        earliest = self.progress()
        wait_until(lambda: self.has_reported(InteractiveMarkerFeedback.MOUSE_UP, QUADCOPTER), 'RViz to report the end')
        dropped = self.events[-1].pose.position
        self.assertGreater(abs(dropped.x - at[0]), 0.2)
        sent = wait_until(
            lambda: next((one.pose.position for one in list(self.poses) if one.name == QUADCOPTER), None),
            'the handle to follow the quadcopter again',
        )
        self.assertLess(abs(sent.x - dropped.x) + abs(sent.y - dropped.y), 0.1, 'it does not flash back')
        wait_until(
            lambda: self.distance_of_curve(dropped) < 0.001,
            lambda: 'the curve to pass {}; the script is {}'.format(dropped, SCRIPT.read_text()),
        )
        latest = self.progress()
        # Not any curve through that point: the one that is there at that part of the flight, which continues meanwhile.
        start, end = self.curve[0], self.waypoint()
        part = (dropped.x - start.x) / (end[0] - start.x)
        self.assertGreater(part, earliest - 0.01)
        self.assertLess(part, latest + 0.01)
        self.assertTrue(SCRIPT.read_text().endswith('\n# back home\nwait(5)\n'))

    def drag_quadcopter(self, dx, dy):
        """Drag it from where it is when RViz takes hold of it, by so many metres; gives that place."""

        def on_rotor():
            return self.quadcopter.x + ON_ROTOR, self.quadcopter.y + ON_ROTOR

        def end(start):
            self.held_at = start
            return start[0] + dx, start[1] + dy

        self.drag(on_rotor, end, QUADCOPTER)
        return self.held_at[0] - ON_ROTOR, self.held_at[1] - ON_ROTOR

    def distance_of_curve(self, place):
        """From a place, in metres; the curve is straight, as its control point is in the middle."""
        start, end = ((point.x, point.y, point.z) for point in (self.curve[0], self.curve[-1]))
        way, out = ([b - a for a, b in zip(start, other)] for other in (end, (place.x, place.y, place.z)))
        part = sum(a * b for a, b in zip(way, out)) / sum(a * a for a in way)
        return sum((b - part * a) ** 2 for a, b in zip(way, out)) ** 0.5


if __name__ == '__main__':
    rosslt.init_node('mouse_drags')
    rostest.rosrun('rosslt', 'mouse_drags', MouseDrags, sys.argv)
