"""A number of NumPy on the left of one that has provenance: the node gets NumPy's number, and keeps the provenance."""

import pytest
from std_msgs.msg import Float64MultiArray

from rosslt import node, values
from support.unmodified import Listener, Unmodified

NUMBERS = """
import pickle
import numpy as np
class Robot:
    def __init__(self):
        self.x, self.none, self.count = 1.5, 0.0, 3
robot = Robot()
two = np.float64(2)
total = np.float64(0.1)
total += robot.x
total *= robot.x
for made in (
    two * robot.x, two + robot.x, two - robot.x, two / robot.x, -two * robot.x, two ** robot.x, two // robot.x,
    two % robot.x, two * robot.count, np.int64(2) * robot.x, np.float32(0.1) * robot.x, np.sqrt(two) * robot.x, total,
    two > robot.x, max(two, robot.x), np.hypot(two, robot.x), np.array([1.0, 2.5])[1] * robot.x,
):
    print(repr(float(made)), made == made.__class__(made))
with np.errstate(divide='ignore'):
    print(two / robot.none, -two / robot.none, 0 * two / robot.x)
print([pickle.dumps(one) for one in (np.sqrt(robot.x), np.array([robot.x]))])
"""

SCALED = """
import numpy as np
import rospy
from std_msgs.msg import Float64MultiArray
class Scaled:
    def __init__(self):
        self.x, self.y = 1.5, 2.5
        self.gain = np.float64(2)
        self.pub = rospy.Publisher('scaled', Float64MultiArray, queue_size=1)
    def run(self):
        while not rospy.is_shutdown():
            total = np.float64(1)
            total += self.x
            bent = np.sqrt(self.gain) - np.arctan2(self.x * np.sin(self.y), 3 + np.hypot(self.x, 2))
            self.pub.publish(Float64MultiArray(data=[np.float64(2) * self.x, self.gain - self.y, total, bent]))
            rospy.sleep(0.03)
rospy.init_node('scaled')
Scaled().run()
"""


def test_numpy_numbers_compute_with_tracked_ones_as_by_themselves(tmp_path):
    plain = Unmodified(tmp_path, 'arithmetic', NUMBERS.lstrip(), tracked=False).end()
    assert plain[0] == 0
    assert Unmodified(tmp_path, 'arithmetic', NUMBERS.lstrip()).end() == plain


def test_what_numpy_numbers_scale_keeps_its_source_and_follows(master, tmp_path):
    with Unmodified(tmp_path, 'scaled', SCALED.lstrip()), Listener('scaled', Float64MultiArray) as heard:
        message = heard.next()
        assert message.data[:3] == (3.0, -0.5, 2.5)
        assert all(map(values.is_tracked, message.data))
        node.force_value(message.data[0], 8.0)
        moved = heard.comes(lambda one: one.data[0] == 8.0)
        assert moved.data[1:3] == (-0.5, 5.0)
        node.force_value(moved.data[1], -1.0)
        assert heard.comes(lambda one: one.data[1] == pytest.approx(-1.0)).data[0] == 8.0
