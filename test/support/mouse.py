"""Test cases with a mouse in a real RViz, seen from above."""

import contextlib
import unittest

import rospy
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import InteractiveMarkerFeedback, InteractiveMarkerUpdate, Marker, MarkerArray

from support.hand import wait_until
from support.screen import Screen

#: A pixel in view where no marker is, and where RViz says what the mouse does there: left, top, right, bottom.
EMPTY = (30, 80)
STATUS = (60, 775, 700, 798)

#: For how long RViz may take to see a handle that is there, in seconds: it draws with the processor alone.
HOLD_TIMEOUT = 60.0
SPOT_COLOR = (255, 0, 255)


class MouseCase(unittest.TestCase):
    """RViz for all tests of a class.

    Attributes:
        config: the RViz configuration, which shows the MarkerArrays of a topic.
        topic: that topic.
        spots: two places (x, y) in view by which pixels are measured, the left one first.
        node: whose parameters the tests look at.
        inserts: the names of the interactive markers that were inserted.
    """

    config = topic = spots = node = None

    @classmethod
    def setUpClass(cls):
        cls.screen = Screen(cls.config)
        cls.addClassCleanup(cls.screen.close)
        cls.events, cls.inserts = [], []
        rospy.Subscriber('/slt_visualization/feedback', InteractiveMarkerFeedback, cls.events.append)
        rospy.Subscriber('/slt_visualization/update', InteractiveMarkerUpdate, cls.see_update)
        publisher = rospy.Publisher(cls.topic, MarkerArray, queue_size=1, latch=True)
        spots = cls.spot_marker()
        publisher.publish([spots])
        cls.screen.calibrate(SPOT_COLOR, *cls.spots)
        cls.status_of_nothing = cls.status_at(EMPTY)
        # They are no longer needed, and would hide parts of the screenshots.
        spots.action = Marker.DELETE
        publisher.publish([spots])

    @classmethod
    def spot_marker(cls):
        marker = Marker(ns='spots', type=Marker.POINTS, color=ColorRGBA(1.0, 0.0, 1.0, 1.0))
        marker.header.frame_id = 'world'
        marker.pose.orientation.w = 1.0
        marker.scale.x = marker.scale.y = 0.1
        marker.points = [Point(x, y, 0.0) for x, y in cls.spots]
        return marker

    @classmethod
    def see_update(cls, update):
        cls.inserts.extend(marker.name for marker in update.markers)

    def setUp(self):
        self.addCleanup(self.screen.screenshot, self.id().rpartition('.')[2])

    def parameter(self, name):
        """The value in force at a source."""
        return rospy.get_param('{}/rosslt/{}'.format(self.node, name))

    def press(self, place, name):
        """Press the left button on a handle, wherever it is by then.

        Args:
            place: (x, y) in metres, or a function that gives it, for a handle of something that moves.
            name: of the handle.

        Returns:
            The pixel where RViz took hold of it.
        """
        self.addCleanup(self.screen.release)
        return wait_until(
            lambda: self._pressed(place() if callable(place) else place, name),
            lambda: 'RViz to take hold of {} at {}'.format(name, place() if callable(place) else place),
            HOLD_TIMEOUT,
        )

    def _pressed(self, place, name):
        """Press the button at a place; the pixel if RViz reports that it holds the handle now, else None."""
        pixel = self.screen.pixel(*place)
        if self.status_at(pixel) == self.status_of_nothing:
            return None
        del self.events[:]
        self.screen.press()
        with contextlib.suppress(AssertionError):
            wait_until(lambda: self.has_reported(InteractiveMarkerFeedback.MOUSE_DOWN), 'RViz to take hold', 3.0)
        if self.has_reported(InteractiveMarkerFeedback.MOUSE_DOWN, name):
            return pixel
        # What moves has flown on, or RViz has drawn another handle over it: this was a click, which changes nothing.
        self.screen.release()
        return None

    def point_at(self, place):
        """Move the mouse to a handle, and wait for RViz to say that it can be dragged; gives the pixel."""

        def pointed():
            pixel = self.screen.pixel(*(place() if callable(place) else place))
            return pixel if self.status_at(pixel) != self.status_of_nothing else None

        return wait_until(pointed, 'RViz to see a handle at {}'.format(place), HOLD_TIMEOUT)

    @classmethod
    def status_at(cls, pixel):
        """What RViz says that the mouse does at a pixel: it looks only when the mouse moves."""
        cls.screen.move([(pixel[0] + 3, pixel[1]), pixel], step_time=0.2)
        return cls.screen.picture(STATUS)

    def has_reported(self, event, name=None):
        """Whether RViz has reported an event on a handle, or on any, since the button was pressed."""
        return any(one.event_type == event and name in (None, one.marker_name) for one in self.events)

    def drag(self, start, end, name, steps=12, step_time=0.03, is_released=True):
        """Drag a handle, and give the pixels that the mouse went through, to the right and down.

        Args:
            start: as `place` of `press`.
            end: (x, y) in metres; or a function of the place where RViz took hold.
        """
        first = self.press(start, name)
        last = self.screen.pixel(*(end(self.screen.place(first)) if callable(end) else end))
        self.screen.move(
            [
                (
                    round(first[0] + (last[0] - first[0]) * step / steps),
                    round(first[1] + (last[1] - first[1]) * step / steps),
                )
                for step in range(1, steps + 1)
            ],
            step_time,
        )
        if is_released:
            self.screen.release()
        return last[0] - first[0], last[1] - first[1]

    def assert_comes_to(self, name, value, tolerance=None):
        """A parameter comes to a value, within a pixel's worth."""
        tolerance = tolerance or 1.0 / self.screen.scale
        wait_until(
            lambda: abs(self.parameter(name) - value) <= tolerance,
            lambda: '{} to become {} +- {}; it is {}'.format(name, value, tolerance, self.parameter(name)),
        )
