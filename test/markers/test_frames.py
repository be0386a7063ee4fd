"""Frames that no transform joins: RViz would show no handle at all if it was sent one of them."""

import re
import subprocess

import pytest

from support.processes import Node, wait_until
from support.shell import rosslt

pytestmark = pytest.mark.rostest

BALLS = """
from visualization_msgs.msg import Marker
publishers = [rosslt.Publisher(name, Marker, queue_size=1) for name in ('/alpha', '/beta', '/gamma')]
x = rosslt.location(1.0, name='x')
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    for publisher, frame in zip(publishers, ['map', 'world', 'map']):
        ball = Marker(type=Marker.SPHERE)
        ball.header.frame_id = frame
        ball.pose.position.x, ball.pose.orientation.w = x, 1.0
        ball.scale.x = ball.scale.y = ball.scale.z = 0.5
        ball.color.a = 1.0
        publisher.publish(ball)
    rate.sleep()
"""

JOINING = """
import tf2_ros
from geometry_msgs.msg import TransformStamped
broadcaster, transform = tf2_ros.StaticTransformBroadcaster(), TransformStamped()
transform.header.frame_id, transform.child_frame_id, transform.transform.rotation.w = 'map', 'world', 1.0
broadcaster.sendTransform(transform)
rospy.spin()
"""

#: A node that RViz is one of, as far as others can see.
VIEWER = """
from visualization_msgs.msg import InteractiveMarkerUpdate
rospy.Subscriber('/slt_visualization/update', InteractiveMarkerUpdate, lambda update: None)
rospy.spin()
"""


@pytest.fixture
def earlier(master):
    """An earlier run has left a frame that was apart."""
    subprocess.run(['rosparam', 'set', '/slt_visualization/frames_apart', '[[world, map]]'], check=True)


@pytest.fixture
def handles(master):
    """Names the topics that have handles in RViz."""

    def names():
        echo = ['rostopic', 'echo', '-n', '1', '/slt_visualization/update_full']
        said = subprocess.run(echo, stdout=subprocess.PIPE, text=True, timeout=60, check=False)
        return set(re.findall(r'^    name: "(/\w+):', said.stdout, re.MULTILINE))

    process = subprocess.Popen(['rosrun', 'rosslt', 'slt_visualization'])
    with Node('viewer', VIEWER):
        yield names
    process.terminate()
    process.wait()


@pytest.mark.slow
def test_what_is_apart_from_most_topics_waits_for_a_transform(handles):
    with Node('balls', BALLS):
        wait_until(lambda: handles() == {'/alpha', '/gamma'}, 'handles in the frame of most topics')
        said = 'fault\tRViz gets no handles of what is in the frame world: no transform joins it to map'
        wait_until(lambda: said in rosslt('doctor', '/beta').stdout, 'doctor to say why others have none')
        assert 'its handles are shown' in rosslt('doctor', '/alpha').stdout
        with Node('joining', JOINING):
            wait_until(lambda: handles() == {'/alpha', '/beta', '/gamma'}, 'handles in both frames')
            wait_until(lambda: 'its handles are shown' in rosslt('doctor', '/beta').stdout, 'doctor to say so')


def test_frames_that_were_apart_in_an_earlier_run_are_forgotten(earlier, handles):
    with Node('joining', JOINING), Node('balls', BALLS):
        wait_until(lambda: handles() == {'/alpha', '/beta', '/gamma'}, 'handles in both frames')
        wait_until(lambda: 'its handles are shown' in rosslt('doctor', '/beta').stdout, 'doctor to say so')
