"""A node that sends a message that grows, without a pause, answers those who list, set and force its locations."""

import pytest
from std_msgs.msg import Int32

from rosslt.messages.codec.wire_format import FIELD_LIMIT
from support.shell import rosslt as command
from support.unmodified import Listener, Unmodified

CLOUD = """
import math
import rospy
from geometry_msgs.msg import Point32
from sensor_msgs.msg import PointCloud
from std_msgs.msg import Int32
rospy.init_node('flooding')
pub = rospy.Publisher('flood', PointCloud, queue_size=1)
count = rospy.Publisher('flood_count', Int32, queue_size=1)
radius = 1.5
height = 0.25
cloud = PointCloud()
while not rospy.is_shutdown():
    angle = 0.1 * len(cloud.points)
    if len(cloud.points) < 32768:
        cloud.points.append(Point32(radius * math.cos(angle), radius * math.sin(angle), height))
    cloud.header.stamp = rospy.Time.now()
    pub.publish(cloud)
    count.publish(len(cloud.points))
"""

STRIP = """
import threading
import rospy
from geometry_msgs.msg import Point
from std_msgs.msg import Int32
from visualization_msgs.msg import Marker
rospy.init_node('flooding')
class Strip:
    def __init__(self):
        self.pub = rospy.Publisher('flood', Marker, queue_size=10)
        self.count = rospy.Publisher('flood_count', Int32, queue_size=1)
        self.x, self.step, self.height = 0.0, 0.01, rospy.get_param('~height', 0.25)
        self.marker = Marker(type=Marker.LINE_STRIP)
        threading.Thread(target=self.run, daemon=True).start()
    def run(self):
        while not rospy.is_shutdown():
            self.x += self.step
            self.marker.points.append(Point(self.x, 1.25, self.height))
            self.pub.publish(self.marker)
            self.count.publish(len(self.marker.points))
Strip()
rospy.spin()
"""


KEPT = (
    'rosslt set: z of a geometry_msgs/{} of /flooding still holds what was made of the former value, until the node '
    'makes it again\n'
)


@pytest.mark.parametrize(
    ('code', 'height', 'kind'),
    [(CLOUD, 'height', 'Point32'), (STRIP, '~height', 'Point')],
    ids=['cloud', 'strip'],
)
def test_a_node_that_floods_answers(master, tmp_path, code, height, kind):
    with Unmodified(tmp_path, 'flooding', code.lstrip()), Listener('flood_count', Int32) as count:
        # While nobody hears of it, it grows much faster.
        count.comes(lambda message: message.data > 2 * FIELD_LIMIT / 3)
        assert '/flooding/' + height in command('list', '/flooding').stdout
        for wanted in ('0.5', '0.75'):
            result = command('set', '/flooding/' + height, wanted)
            assert result.returncode == 0, result.stderr
            assert result.stderr in ('', KEPT.format(kind)), 'its former points have the former height'
        result = command('explain', '/flood/points[3].z', '--timeout', '60')
        assert result.returncode == 0, result.stderr
        assert f'/flooding/{height}' in result.stdout
