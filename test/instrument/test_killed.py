"""A node that is killed in the middle of a drag: what it keeps of it is taken back by `rosslt undo`."""

import signal

import rosgraph
from geometry_msgs.msg import PointStamped

from rosslt import node, values
from support.shell import failure, rosslt
from support.unmodified import Listener, Unmodified

NODE = """
import rospy
from geometry_msgs.msg import PointStamped
rospy.init_node('dragged')
y = rospy.get_param('~y', 2.5)
publisher = rospy.Publisher('dragged', PointStamped, queue_size=1)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    place = PointStamped()
    place.point.x = 1.5
    place.point.y = y
    publisher.publish(place)
    rate.sleep()
"""


def drag(heard, x, y):
    """A step of a drag."""
    point = heard.next().point
    wanted = values.solve([point.x, point.y], [x, y])
    node.request_values(wanted, 5.0, 'drag')
    heard.comes(lambda message: (message.point.x, message.point.y) == (x, y))


def test_half_a_drag_is_taken_back_by_the_command(master, tmp_path):
    with Unmodified(tmp_path, 'dragged', NODE) as dragged, Listener('dragged', PointStamped) as heard:
        drag(heard, 2.0, 3.0)
        drag(heard, 3.5, 4.0)
        dragged.stop(signal.SIGKILL)
    with Unmodified(tmp_path, 'dragged', NODE), Listener('dragged', PointStamped) as heard:
        heard.comes(lambda message: values.is_tracked(message.point.x) and message.point.x == 3.5)
        assert rosslt('undo', '/dragged').returncode == 0
        heard.comes(lambda message: (message.point.x, message.point.y) == (1.5, 2.5))
        assert rosgraph.Master('/test').getParam('/dragged/y') == 2.5
        assert 'there is no change to take back' in failure('undo', '/dragged')
