#!/usr/bin/env python3
"""What a mouse does in a real RViz: each drag is measured at the source, to within a pixel."""

import math
import sys

import rospy
import rostest
from geometry_msgs.msg import Point, PoseStamped
from nav_msgs.msg import Odometry
from visualization_msgs.msg import InteractiveMarkerFeedback

import rosslt
from support.hand import wait_until
from support.mouse import EMPTY, MouseCase

ARROW = 1.0  # how far out an arrow is, against the size of its marker
RING = 0.93  # how far out a ring is
WHITE = (255, 255, 255)
NOTE_COLOR = (255, 217, 77)
BESIDE_ARROW = 0.15  # m along x and y from the middle, where an arrow points at the eye


class Mouse(MouseCase):
    config = rospy.myargv()[1]
    topic, node = '/stage', '/stage'
    spots = (-5.5, 4.0), (5.5, -4.0)

    def test_an_axis_moves_its_source(self):
        before = self.parameter('axis_x')
        right, _ = self.drag((before + ARROW * 0.5, 3.0), (before + 1.5, 2.5), '/stage:axis:0')
        self.assert_comes_to('axis_x', before + right / self.screen.scale)

    def test_a_body_moves_in_the_plane_of_its_two_axes(self):
        x, half_y = self.parameter('plane_x'), self.parameter('plane_half_y')
        right, down = self.drag((x, 2 * half_y), (x + 0.75, 2 * half_y - 0.5), '/stage:plane:0')
        self.assert_comes_to('plane_x', x + right / self.screen.scale)
        self.assert_comes_to('plane_half_y', half_y - down / self.screen.scale / 2)

    def test_a_rotated_marker_moves_along_the_axes_of_its_frame(self):
        before = self.parameter('rotated_y')
        _, down = self.drag((3.5, before - ARROW * 0.5), (4.0, before - 1.2), '/stage:rotated:0')
        self.assert_comes_to('rotated_y', before - down / self.screen.scale)

    def test_a_point_of_a_line_strip_moves_its_sources(self):
        x, y = self.parameter('corner_x'), self.parameter('corner_y')
        right, down = self.drag((-4.0 + x, 0.5 + y), (-3.5 + x, 1.0 + y), '/stage:strip:0:points[1]')
        self.assert_comes_to('corner_x', x + right / self.screen.scale)
        self.assert_comes_to('corner_y', y - down / self.screen.scale)

    def test_a_ring_turns_the_angle_that_the_orientation_comes_from(self):
        before, angle, radius = self.parameter('yaw'), math.radians(60), RING * 0.8
        start = (1.0 + radius * math.cos(2.4), radius * math.sin(2.4))
        centre = self.screen.pixel(1.0, 0.0)
        first = self.press(start, '/stage:ring:0')
        path = [
            self.screen.pixel(
                1.0 + radius * math.cos(2.4 + angle * step / 20), radius * math.sin(2.4 + angle * step / 20)
            )
            for step in range(1, 21)
        ]
        self.screen.move(path)
        self.screen.release()

        def direction(pixel):
            return math.atan2(centre[1] - pixel[1], pixel[0] - centre[0])

        turned = (direction(path[-1]) - direction(first)) % (2 * math.pi)
        self.assert_comes_to('yaw', before + turned, tolerance=1.5 / (radius * self.screen.scale))

    def test_a_size_is_dragged_by_its_handle(self):
        before = self.parameter('width')
        right, _ = self.drag((4.0 + before / 2, -2.0), (4.25 + before / 2, -2.0), '/stage:scaled:0:scale.x')
        self.assert_comes_to('width', before + 2 * right / self.screen.scale, 2.0 / self.screen.scale)

    def test_a_menu_entry_chooses_the_source_that_drags_change(self):
        base, offset = self.parameter('base'), self.parameter('offset')
        right, _ = self.drag((base + offset, -2.0), (base + offset + 0.5, -2.0), '/stage:sum:0')
        self.assert_comes_to('base', base + right / self.screen.scale)
        base = self.parameter('base')

        pixel = self.point_at((base + offset, -2.0))
        self.screen.press(3)
        self.screen.release(3)
        # The third entry is the other source, below a heading and the default: the entries are 25 pixels high.
        entry = (pixel[0] + 20, pixel[1] + 12 + 50)
        wait_until(lambda: self.screen.color(entry) == WHITE, 'the menu')
        self.screen.screenshot('menu')
        self.screen.move([entry], step_time=0.3)
        self.screen.press()
        self.screen.release()
        wait_until(
            lambda: self.has_reported(InteractiveMarkerFeedback.MENU_SELECT, '/stage:sum:0'),
            'RViz to report the choice',
        )

        right, _ = self.drag((base + offset, -2.0), (base + offset - 0.25, -2.0), '/stage:sum:0')
        self.assert_comes_to('offset', offset + right / self.screen.scale)
        self.assertEqual(self.parameter('base'), base)

    def test_a_refused_drag_of_a_body_snaps_back_and_says_why_at_the_handle(self):
        name, there = '/stage:stubborn:0', self.screen.pixel(2.85, -2.75)
        empty = self.screen.color(there)
        self.press((2.0 + BESIDE_ARROW, -3.2 + BESIDE_ARROW), name)
        self.screen.move([self.screen.pixel(2.85 + BESIDE_ARROW, -2.75 + BESIDE_ARROW)])
        wait_until(lambda: self.screen.color(there) != empty, 'the ghost to be where the mouse has it')
        self.screen.release()
        self.screen.move([EMPTY])
        wait_until(lambda: self.screen.color(there) == empty, 'the ghost to be gone from there')
        wait_until(lambda: name + ':note' in self.inserts, 'the note')
        wait_until(lambda: self.screen.count(NOTE_COLOR, *self.around(2.0, -3.2)) > 20, 'the note to be seen there')
        self.screen.screenshot('refused')

    def around(self, x, y):
        """The box of pixels around a place: left, top, right, bottom."""
        (left, top), (right, bottom) = self.screen.pixel(x - 1.5, y + 1.0), self.screen.pixel(x + 1.5, y - 0.5)
        return left, top, right, bottom

    def test_a_drag_past_a_bound_comes_to_the_bound(self):
        before = self.parameter('limited_x')
        self.drag((before, -2.0), (1.5, -2.0), '/stage:limited:0')
        self.assert_comes_to('limited_x', 0.5, 1e-12)

    def test_a_drag_turns_the_view_if_it_begins_on_what_cannot_move(self):
        start, elsewhere = self.screen.pixel(-1.5, -3.2), self.screen.pixel(4.0, -2.0)
        wait_until(lambda: self.status_at(start) == self.status_of_nothing, 'RViz to find nothing to grab there')
        before = self.screen.color(elsewhere)
        self.addCleanup(self.screen.release)
        self.screen.press()
        self.screen.move([(start[0] + 20 * step, start[1]) for step in range(1, 11)])
        wait_until(lambda: self.screen.color(elsewhere) != before, 'the view to turn')
        self.screen.screenshot('turned_view')
        self.screen.move([(start[0] + 20 * step, start[1]) for step in reversed(range(10))])
        wait_until(lambda: self.screen.color(elsewhere) == before, 'the view to be as it was')

    def test_what_cannot_be_moved_leaves_the_mouse_to_what_lies_under_it(self):
        """As a robot that has come to its goal."""
        robots = rosslt.Publisher('robot', Odometry, queue_size=1)
        goals = rosslt.Publisher('goal', PoseStamped, queue_size=1)
        robot, goal = Odometry(), PoseStamped()
        robot.header.frame_id = goal.header.frame_id = 'world'
        robot.pose.pose.position = Point(rosslt.location(4.3, name='robot_x', read_only=True), -3.4, 1.0)

        def publish(_event):
            goal.pose.position.x, goal.pose.position.y = rosslt.location(4.3, name='goal_x'), -3.4
            robots.publish(robot)
            goals.publish(goal)

        for publisher in (robots, goals):
            self.addCleanup(publisher.unregister)
            wait_until(publisher.get_num_connections, 'slt_visualization to hear')
        self.addCleanup(rospy.Timer(rospy.Duration(0.05), publish).shutdown)
        right, _ = self.drag((4.3, -3.4), (4.9, -3.4), '/goal')
        there = 4.3 + right / self.screen.scale
        wait_until(lambda: abs(rospy.get_param('/check_rviz/rosslt/goal_x') - there) < 0.02, 'the goal to be moved')

    def test_a_marker_that_changes_in_every_message_can_be_dragged_for_seconds(self):
        before = self.parameter('blinking_x')
        del self.inserts[:]
        right, _ = self.drag((before, 0.5), (before + 1.0, 0.5), '/blinking:blinking:0', steps=60, step_time=0.05)
        self.assert_comes_to('blinking_x', before + right / self.screen.scale)


if __name__ == '__main__':
    rosslt.init_node('check_rviz')
    rostest.rosrun('rosslt', 'rviz', Mouse, sys.argv)
