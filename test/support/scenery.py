"""Nodes that show something to be dragged, and messages for scenes without nodes."""

import textwrap

import rosgraph

_SHOWN = """\
from rosslt import math
from visualization_msgs.msg import Marker
{before}
publisher = rosslt.Publisher({name!r}, Marker, queue_size=10)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    marker = Marker(type=Marker.{kind})
    marker.header.frame_id = 'world'
    marker.scale.x = marker.scale.y = marker.scale.z = {size}
    marker.color.{color} = marker.color.a = 1.0
    marker.pose.orientation.w = 1.0
{fields}
    publisher.publish(marker)
    rate.sleep()
"""


def marker_node(name, kind, size, color, fields, before=''):
    """The code of a node that shows one marker.

    Args:
        name: of its topic.
        kind: of the marker: CUBE, SPHERE and so on.
        size: in metres.
        color: r, g or b.
        fields: lines that set fields of `marker`.
        before: lines that stand before that.
    """
    return _SHOWN.format(
        name=name,
        kind=kind,
        size=size,
        color=color,
        fields=textwrap.indent(textwrap.dedent(fields).strip(), '    '),
        before=textwrap.dedent(before).strip(),
    )


def value(location):
    """The value in force at a literal of a node, NODE/LOCATION, as its parameter says."""
    node, _, name = location.rpartition('/')
    return rosgraph.Master('/test').getParam('{}/rosslt/{}'.format(node, name))


def take(scene, topic, message, publisher='/owner'):
    """Have a scene take a message as if a node had sent it."""
    message._connection_header = {'callerid': publisher}
    scene.take(topic, message, is_shown=True)
