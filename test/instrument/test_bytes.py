"""While nothing is changed, a node sends byte for byte what it sends by itself, with provenance behind it."""

import threading

import pytest
import rospy
from rosgraph_msgs.msg import Clock

from support.processes import wait_until
from support.unmodified import Unmodified

MESSAGES = 25

START = """\
import math, time
import rospy
{imports}
rospy.init_node('{name}')
while not rospy.Time.now().to_sec():
    time.sleep(0.01)
"""
# The first message goes out once somebody hears it. The clock stands still, and with it `rospy.sleep`.
WAIT = """
while not pub.get_num_connections():
    time.sleep(0.01)
"""

NODES = {
    'loop': (
        'PointStamped',
        'from geometry_msgs.msg import PointStamped',
        """
radius, t = 2.0, 0
def send():
    global t
    p = PointStamped()
    p.header.stamp = rospy.Time.now() + rospy.Duration(0.1 * t)
    p.header.frame_id = 'f%.3f' % (radius * t)
    p.point.x = radius * math.cos(t * 0.5) + 1
    p.point.y = (radius * 3) ** 2 / 7
    p.point.z = 4
    pub.publish(p)
    t += 0.1
""",
    ),
    'joints': (
        'JointState',
        'from sensor_msgs.msg import JointState',
        """
names = ['joint_%d' % (i + 1) for i in range(6)]
limits = {'low': -1.5, 'high': 2}
count = 0
def send():
    global count
    msg = JointState()
    msg.header.stamp = rospy.get_rostime()
    msg.name = names
    phase = count / 10.0
    msg.position = [max(limits['low'], min(limits['high'], 3 * math.sin(phase + i * 0.2))) for i in range(len(names))]
    msg.velocity = [round(p * 0.5, 2) for p in msg.position]
    msg.effort = [float(int(p * 100) // 7) for p in msg.position]
    pub.publish(msg)
    count += 1
""",
    ),
    'scan': (
        'LaserScan',
        'import numpy as np\nimport random\nfrom sensor_msgs.msg import LaserScan',
        """
random.seed(3)
np.random.seed(4)
def send():
    scan = LaserScan(angle_min=-math.pi / 2, angle_max=math.pi / 2, range_min=0.1, range_max=30)
    scan.header.stamp = rospy.Time.now()
    angles = np.linspace(scan.angle_min, scan.angle_max, 40)
    scan.angle_increment = angles[1] - angles[0]
    ranges = np.clip(2.5 / np.abs(np.cos(angles)) + 0.01 * np.random.randn(40), scan.range_min, scan.range_max)
    scan.ranges = ranges.tolist()
    scan.intensities = [100 * random.random() for r in ranges]
    pub.publish(scan)
""",
    ),
    'tip': (
        'PointStamped',
        'import tf2_ros, tf2_geometry_msgs, tf\nfrom geometry_msgs.msg import PointStamped, TransformStamped',
        """
turn = 0.0
def send():
    global turn
    frame = TransformStamped()
    frame.header.stamp = rospy.Time.now()
    frame.header.frame_id = 'map'
    frame.transform.translation.x = 1.5
    q = tf.transformations.quaternion_from_euler(0.1, turn, 0.3)
    (frame.transform.rotation.x, frame.transform.rotation.y,
     frame.transform.rotation.z, frame.transform.rotation.w) = q
    point = PointStamped()
    point.header = frame.header
    point.point.x, point.point.y = 0.25, math.hypot(0.5, turn)
    pub.publish(tf2_geometry_msgs.do_transform_point(point, frame))
    turn += 0.05
""",
    ),
    'growing': (
        'MarkerArray',
        'from visualization_msgs.msg import Marker, MarkerArray',
        """
array = MarkerArray()
count = 0
def send():
    global count
    m = Marker(type=Marker.CUBE, lifetime=rospy.Duration(2.5))
    m.header.stamp = rospy.Time.now()
    m.scale.x = m.scale.y = m.scale.z = 0.2
    m.color.r, m.color.a = (count % 10) / 10.0, 1
    m.pose.position.x = math.cos(count / 50.0)
    m.pose.orientation.w = 1
    m.text = '{} of {:.2f}'.format(count, m.pose.position.x)
    array.markers.append(m)
    if len(array.markers) > 5:
        array.markers.pop(0)
    i = 0
    for m in array.markers:
        m.id = i
        i += 1
    pub.publish(array)
    count += 1
""",
    ),
    'controller': (
        'TwistStamped',
        'from geometry_msgs.msg import TwistStamped',
        """
class Controller(object):
    GAIN = 0.75
    def __init__(self, limit=0.5):
        self.limit, self.x, self.last = limit, rospy.get_param('~start', -3), None
        self.sent = TwistStamped()
    def step(self):
        error = 1.0 - self.x
        self.sent.header.stamp = rospy.Time.now()
        self.sent.header.seq += 1
        self.sent.twist.linear.x = max(-self.limit, min(self.limit, self.GAIN * error))
        self.sent.twist.angular.z = 0 if self.last is None else (error - self.last) / 0.1
        self.sent.twist.angular.y = rospy.get_param('~tilt', 2) * 1e-3
        self.last = error
        self.x += self.sent.twist.linear.x * 0.1
        pub.publish(self.sent)
send = Controller().step
""",
    ),
}


class Recorder:
    """The bytes of the first messages of a topic."""

    def __init__(self, topic):
        self.heard = []
        self._lock = threading.Lock()
        self._subscriber = rospy.Subscriber(topic, rospy.AnyMsg, self._take)

    def _take(self, message):
        with self._lock:
            self.heard.append(bytes(message._buff))

    def stop(self):
        self._subscriber.unregister()
        return self.heard[:MESSAGES]


@pytest.fixture
def standing_clock(master):
    rospy.set_param('/use_sim_time', True)
    clock = rospy.Publisher('/clock', Clock, latch=True, queue_size=1)
    clock.publish(Clock(clock=rospy.Time(1000, 250)))
    yield
    clock.unregister()
    rospy.delete_param('/use_sim_time')


def _code(name, kind, imports, body):
    return (
        START.format(imports=imports, name=name)
        + f"pub = rospy.Publisher('{name}', {kind}, queue_size=100)\n"
        + body
        + WAIT
        + f'for _ in range({MESSAGES}):\n    send()\n    time.sleep(0.02)\nrospy.spin()\n'
    )


def _heard(folder, name, code, topic, tracked):
    recorder = Recorder(topic)
    with Unmodified(folder, name, code, f'{name}:={topic}', tracked=tracked) as program:
        wait_until(lambda: len(recorder.heard) >= MESSAGES or program.process.poll() is not None, 'all came', 60)
    return recorder.stop()


@pytest.mark.parametrize('name', NODES)
def test_the_messages_are_those_of_the_plain_node(standing_clock, tmp_path, name):
    code = _code(name, *NODES[name])
    plain = _heard(tmp_path, name, code, f'/{name}_plain', tracked=False)
    tracked = _heard(tmp_path, name, code, f'/{name}_tracked', tracked=True)
    assert len(plain) == len(tracked) == MESSAGES
    assert len(tracked[0]) > len(plain[0])
    for ours, theirs in zip(tracked, plain):
        assert ours[: len(theirs)] == theirs
