"""The scene: what the watched topics show at present, by the rules that RViz itself goes by.

Adding, deleting, deleting all, lifetimes and namespaces mean here what they mean in RViz. In addition, what a
publisher has shown goes when the publisher goes.
"""

import math
import time

import rospy
from visualization_msgs.msg import Marker

from rosslt.markers import stamped, visuals

#: How long a warning stands before it is given again, in seconds.
WARN_PERIOD = 30.0


class Scene:
    """What stands in RViz, thing by thing, kept up to date on a board.

    Args:
        board: where the handles of things are put, and dropped when the things go.
    """

    def __init__(self, board):
        self._board = board
        self._things = {}  # topic -> {key: (names of its handles, publisher)}
        self._mortal = {}  # (topic, key) -> when it expires, a rospy.Time
        self._warned = {}  # what has been warned of -> when

    def take(self, topic, message, is_shown):
        """Follow a message of any type that is watched.

        Args:
            topic: its name.
            message: an ordinary message, with tracked values in it.
            is_shown: whether RViz shows it by itself.
        """
        publisher = (message._connection_header or {}).get('callerid', '')
        with self._board.lock:
            things = self._things.setdefault(topic, {})
            if hasattr(message, 'markers'):
                for marker in message.markers:
                    self._take_marker(topic, things, marker, publisher, is_shown)
            elif message._type == Marker._type:
                self._take_marker(topic, things, message, publisher, is_shown)
            else:
                handles = list(stamped.BY_TYPE[message._type](topic, message))
                if handles and not message.header.frame_id:
                    self._warn('{} on {}: the message has no frame_id'.format(publisher, topic))
                else:
                    self._put(topic, things, (), handles, publisher)

    def expire(self):
        """Drop the markers whose lifetime is over."""
        with self._board.lock:
            if self._mortal:
                now = rospy.Time.now()
                for topic, key in [whose for whose, end in self._mortal.items() if end <= now]:
                    self._delete(topic, self._things[topic], key)

    def keep_publishers(self, topic, publishers):
        """Drop what publishers other than these have shown on a topic."""
        with self._board.lock:
            things = self._things.get(topic, {})
            for key in [key for key, (_, publisher) in things.items() if publisher not in publishers]:
                self._delete(topic, things, key)

    def _take_marker(self, topic, things, marker, publisher, is_shown):
        key = (marker.ns, marker.id)
        if marker.action == Marker.DELETE:
            self._delete(topic, things, key)
        elif marker.action == Marker.DELETEALL:
            for key in list(things):
                self._delete(topic, things, key)
        elif marker.action == Marker.ADD:
            handles = visuals.marker_handles(topic, marker, is_shown)
            fault = handles and _fault(marker)
            if fault:
                self._warn('{} on {}: marker {}/{} {}'.format(publisher, topic, *key, fault))
                return
            self._put(topic, things, key, handles, publisher)
            if key in things and (marker.lifetime.secs or marker.lifetime.nsecs):
                self._mortal[topic, key] = rospy.Time.now() + marker.lifetime
            else:
                self._mortal.pop((topic, key), None)
        else:
            self._warn('{} on {}: marker {}/{} has the unknown action {}'.format(publisher, topic, *key, marker.action))

    def _warn(self, text):
        """Say what is wrong with a message, not with each one of its kind."""
        now = time.monotonic()
        if now - self._warned.get(text, -WARN_PERIOD) >= WARN_PERIOD:
            self._warned = {known: when for known, when in self._warned.items() if now - when < WARN_PERIOD}
            self._warned[text] = now
            rospy.logwarn('%s', text)

    def _put(self, topic, things, key, handles, publisher):
        names = []
        for handle in handles:
            self._board.put(handle)
            names.append(handle.name)
        before = things.get(key)
        if before is not None and before[0] != names:
            for name in set(before[0]).difference(names):
                self._board.drop(name)
        if names:
            things[key] = (names, publisher)
        else:
            things.pop(key, None)

    def _delete(self, topic, things, key):
        for name in things.pop(key, ((), ''))[0]:
            self._board.drop(name)
        self._mortal.pop((topic, key), None)


def _fault(marker):
    """What keeps a marker from being shown, or None."""
    if not marker.header.frame_id:
        return 'has no frame_id'
    if marker.type not in visuals.KINDS:
        return 'has the unknown type %d' % marker.type
    pose, scale = marker.pose, marker.scale
    numbers = (
        pose.position.x,
        pose.position.y,
        pose.position.z,
        pose.orientation.x,
        pose.orientation.y,
        pose.orientation.z,
        pose.orientation.w,
        scale.x,
        scale.y,
        scale.z,
    )
    if not all(map(math.isfinite, numbers)) or not all(
        math.isfinite(point.x) and math.isfinite(point.y) and math.isfinite(point.z) for point in marker.points
    ):
        return 'has a number that is not finite'
    return None
