"""A thing that a device holds is marked in RViz, and the mouse cannot take it, until the device lets go or is gone."""

import itertools
import shutil
import signal
import subprocess
import threading

import pytest
import rosnode
import rospy
from sensor_msgs.msg import Joy

from support.processes import forget_node, wait_until
from support.unmodified import Unmodified

pytestmark = pytest.mark.rostest

THING = """import rospy
from visualization_msgs.msg import Marker

x = 1.5
rospy.init_node('thing')
pub = rospy.Publisher('thing', Marker, queue_size=1)
while not rospy.is_shutdown():
    made = Marker(type=Marker.CUBE)
    made.header.frame_id = 'world'
    made.scale.x = made.scale.y = made.scale.z = made.color.a = 1
    made.pose.orientation.w = 1
    made.pose.position.x = x
    pub.publish(made)
    rospy.sleep(0.05)
"""

NAME = '/thing::0'
NOTE = NAME + ':note'


class Stick:
    """A joystick that says 20 times a second whether its deadman button is pressed, and never moves."""

    def __init__(self):
        self.is_pressed, self._is_over = True, threading.Event()
        self._publisher = rospy.Publisher('/stick', Joy, queue_size=10)
        self._thread = threading.Thread(target=self._work)

    def _work(self):
        for count in itertools.count(1):
            message = Joy(axes=[0.0] * 3, buttons=[int(self.is_pressed)])
            message.header.stamp = rospy.Time.from_sec(0.05 * count)
            self._publisher.publish(message)
            if self._is_over.wait(0.05):
                return

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._is_over.set()
        self._thread.join()
        self._publisher.unregister()


@pytest.fixture
def teaching():
    """`rosslt teach` of the thing by the stick."""
    started = subprocess.Popen(
        [shutil.which('rosslt'), 'teach', NAME, '--by', '/stick', '--wait', '60'],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
    )
    yield started
    started.kill()
    started.communicate()
    for name in rosnode.get_node_names():
        if name.startswith('/slt_teach'):
            forget_node(name)


def note(hand):
    return hand.marker(NOTE).controls[0].markers[0].text.split('\n')


def drag(hand):
    """A drag by 1 m."""
    wait_until(lambda: NAME in hand.names(), 'the thing is shown')
    hand.drag(NAME, dx=1.0)


def test_what_a_device_holds_is_marked_until_it_lets_go(hand, teaching, tmp_path):
    with Unmodified(tmp_path, 'thing', THING), Stick() as stick:
        wait_until(lambda: NOTE in hand.names() and note(hand) == ['held by /stick'], 'it is marked', 60)
        drag(hand)
        wait_until(lambda: hand.position(NAME)[0] == 1.5, 'the mouse does not get it')
        wait_until(lambda: note(hand) == ['held by /stick'], 'it is marked again')
        stick.is_pressed = False
        wait_until(lambda: NOTE not in hand.names(), 'the mark goes')
        drag(hand)
        wait_until(lambda: hand.position(NAME)[0] == 2.5, 'the mouse gets it')


def test_a_device_that_was_killed_holds_nothing(hand, teaching, tmp_path):
    with Unmodified(tmp_path, 'thing', THING), Stick():
        wait_until(lambda: NOTE in hand.names() and note(hand) == ['held by /stick'], 'it is marked', 60)
        teaching.send_signal(signal.SIGKILL)
        wait_until(lambda: NOTE not in hand.names(), 'the mark goes')
        drag(hand)
        wait_until(lambda: hand.position(NAME)[0] == 2.5, 'the mouse gets it')
