"""Drags without RViz: sees the interactive markers of a server, and reports drags as RViz does."""

import copy
import struct
import threading
import time

import rospy
from visualization_msgs.msg import InteractiveMarkerFeedback, InteractiveMarkerInit, InteractiveMarkerUpdate

from support.processes import wait_until

STEP_TIME = 0.02


class Hand:
    """What can be seen and dragged of an interactive marker server.

    Attributes:
        inserts: names in the order in which markers were inserted.
        poses: names in the order in which poses were updated.
    """

    def __init__(self, server='/slt_visualization'):
        self._markers, self.inserts, self.poses = {}, [], []
        self._lock = threading.Lock()
        rospy.Subscriber(server + '/update_full', InteractiveMarkerInit, self._see_all)
        rospy.Subscriber(server + '/update', InteractiveMarkerUpdate, self._see_update)
        self._feedback = rospy.Publisher(server + '/feedback', InteractiveMarkerFeedback, queue_size=100)
        wait_until(self._feedback.get_num_connections, server + ' to take feedback')

    def _see_all(self, init):
        with self._lock:
            self._markers = {marker.name: marker for marker in init.markers}

    def _see_update(self, update):
        with self._lock:
            self.inserts.extend(marker.name for marker in update.markers)
            self.poses.extend(pose.name for pose in update.poses)

    def names(self):
        with self._lock:
            return set(self._markers)

    def marker(self, name):
        """The interactive marker of that name, once it is there."""
        return wait_until(
            lambda: self._markers.get(name),
            lambda: 'the interactive marker {}; there are: {}'.format(name, ', '.join(sorted(self.names())) or 'none'),
        )

    def position(self, name):
        position = self.marker(name).pose.position
        return position.x, position.y, position.z

    def controls(self, name):
        return {control.name: control for control in self.marker(name).controls}

    def press(self, name):
        """Take hold of a marker; what comes back is the feedback to move and release with."""
        marker = self.marker(name)
        feedback = InteractiveMarkerFeedback(client_id='hand', marker_name=name)
        feedback.pose = copy.deepcopy(marker.pose)
        feedback.header.frame_id = marker.header.frame_id
        self._send(feedback, InteractiveMarkerFeedback.MOUSE_DOWN)
        return feedback

    def move(self, feedback, dx=0.0, dy=0.0, dz=0.0, orientation=None, steps=5):
        start = copy.deepcopy(feedback.pose.position)
        for step in range(1, steps + 1):
            part = step / steps
            feedback.pose.position.x = start.x + part * dx
            feedback.pose.position.y = start.y + part * dy
            feedback.pose.position.z = start.z + part * dz
            if orientation is not None:
                feedback.pose.orientation = orientation
            self._send(feedback, InteractiveMarkerFeedback.POSE_UPDATE)
            time.sleep(STEP_TIME)

    def keep(self, feedback):
        """Still hold a marker, as RViz says several times a second."""
        self._send(feedback, InteractiveMarkerFeedback.KEEP_ALIVE)

    def release(self, feedback):
        self._send(feedback, InteractiveMarkerFeedback.MOUSE_UP)

    def drag(self, name, **by):
        """A whole drag."""
        feedback = self.press(name)
        self.move(feedback, **by)
        self.release(feedback)

    def choose(self, name, title):
        """Select an entry of a marker's menu."""
        entry = wait_until(
            lambda: next((entry for entry in self.marker(name).menu_entries if title in entry.title), None),
            'an entry {!r} in the menu of {}'.format(title, name),
        )
        feedback = InteractiveMarkerFeedback(client_id='hand', marker_name=name, menu_entry_id=entry.id)
        self._send(feedback, InteractiveMarkerFeedback.MENU_SELECT)

    def _send(self, feedback, event):
        feedback.event_type = event
        reported = copy.deepcopy(feedback)
        for part in (reported.pose.position, reported.pose.orientation):
            for field in part.__slots__:
                setattr(part, field, in_32_bits(getattr(part, field)))
        self._feedback.publish(reported)


def in_32_bits(number):
    """A number as RViz knows it."""
    return struct.unpack('f', struct.pack('f', number))[0]
