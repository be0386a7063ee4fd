#!/usr/bin/env python3
"""What holds for frames that nodes broadcast with provenance and others look up."""

import unittest

import rospy
import tf2_ros

import rosslt
from rosslt import tf
from support.processes import Node, wait_until

BROADCASTER = """
    from geometry_msgs.msg import TransformStamped

    def stamped(parent, child, **translation):
        made = TransformStamped()
        made.header.frame_id, made.child_frame_id = parent, child
        made.header.stamp = rospy.Time.now()
        made.transform.rotation.w = 1.0
        for name, value in translation.items():
            setattr(made.transform.translation, name, value)
        return made

    static = rosslt.StaticTransformBroadcaster()
    static.sendTransform(stamped('world', 'base', x=rosslt.location(1.0, name='base')))
    broadcaster = rosslt.TransformBroadcaster()
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        height = rosslt.location(0.5, name='height')
        {send}
        rate.sleep()
    """

#: The ways to broadcast a transform.
WAYS = (
    "broadcaster.sendTransform(stamped('base', 'arm', z=2 * height))",
    "broadcaster.sendTransform([stamped('base', 'arm', z=2 * height), stamped('base', 'other', x=1.0)])",
    "broadcaster.sendTransform((0, 0, 2 * height), (0, 0, 0, 1), rospy.Time.now(), 'arm', 'base')",
    "broadcaster.sendTransformMessage(stamped('base', 'arm', z=2 * height))",
)


class Broadcasts(unittest.TestCase):
    def broadcasting(self, send, code=BROADCASTER):
        """A node that broadcasts, with nothing remembered of an earlier one."""
        if rospy.has_param('/broadcaster'):
            rospy.delete_param('/broadcaster')
        return Node('broadcaster', code.format(send=send))

    def listening(self, buffer_class, listener_class):
        buffer = buffer_class(debug=False)
        listener = listener_class(buffer)
        self.addCleanup(listener.unregister)
        return buffer

    def position(self, buffer, holds=lambda position: True):
        """Where the arm is in the world, once something holds of it."""

        def look():
            try:
                found = buffer.lookup_transform('world', 'arm', rospy.Time(0)).transform.translation
            except tf2_ros.TransformException:
                return None
            return found if holds(found) else None

        return wait_until(look, 'the arm is where it is expected')

    def test_a_frame_is_moved_from_where_it_is_looked_up(self):
        for send in WAYS:
            with self.broadcasting(send):
                buffer = self.listening(tf.Buffer, tf.TransformListener)
                seen = self.position(buffer)
                self.assertEqual((seen.x, seen.y, seen.z), (1.0, 0.0, 1.0))
                self.assertEqual([source.node for source in rosslt.sources([seen.x, seen.z])], ['/broadcaster'] * 2)
                rosslt.force_value(seen.z, 3.0)
                self.position(buffer, lambda position: position.z == 3.0)
                # a static frame is broadcast again
                rosslt.force_value(seen.x, 7.0)
                self.position(buffer, lambda position: (position.x, position.z) == (7.0, 3.0))
                self.doCleanups()

    def test_plain_listeners_and_buffers_are_served(self):
        with self.broadcasting(WAYS[0]):
            for buffer_class, listener_class in (
                (tf2_ros.Buffer, tf2_ros.TransformListener),
                (tf2_ros.Buffer, tf.TransformListener),
                (tf.Buffer, tf.TransformListener),
                (tf.Buffer, tf2_ros.TransformListener),
            ):
                seen = self.position(self.listening(buffer_class, listener_class))
                self.assertEqual((seen.x, seen.y, seen.z), (1.0, 0.0, 1.0))
                self.assertEqual(
                    rosslt.is_tracked(seen), buffer_class is tf.Buffer and listener_class is tf.TransformListener
                )
                self.doCleanups()

    def test_plain_broadcasters_are_heard(self):
        code = '    import tf2_ros' + BROADCASTER.replace('rosslt.StaticTrans', 'tf2_ros.StaticTrans').replace(
            'rosslt.TransformB', 'tf2_ros.TransformB'
        )
        with self.broadcasting(WAYS[0], code):
            seen = self.position(self.listening(tf.Buffer, tf.TransformListener))
            self.assertEqual((seen.x, seen.z, rosslt.is_tracked(seen)), (1.0, 1.0, False))


if __name__ == '__main__':
    import rostest

    rosslt.init_node('broadcasts')
    rostest.rosrun('rosslt', 'broadcasts', '__main__')
