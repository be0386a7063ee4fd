"""A master, what there is to look at, and the page, for the tests beside this file.

All of it ends with the last of them: a browser that nobody looks at any more would go on drawing.
"""

import signal
import subprocess
from pathlib import Path

import pytest
import rosgraph

from support.browser import PATIENCE, Browser, Server
from support.masters import reached_master
from support.processes import Node, wait_until

TALKER = """
    publisher = rosslt.Publisher('goal', PoseStamped, queue_size=10)
    rospy.set_param('~parking', 0.5)

    def set_mast(height):
        if height > 5.0:
            raise ValueError('the mast is 5 m high at most')
        mast.append(height)

    def get_port():
        if port:
            raise OSError('the port is closed')
        return 1.0

    mast, climb, port = [1.0], [5.0], []
    port.append(rosslt.location(getter=get_port, setter=print, name='port'))
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        goal = PoseStamped()
        goal.header.frame_id = 'world'
        goal.pose.position.x = rosslt.location(1.0, name='radius', minimum=-4.0, maximum=4.0)
        goal.pose.position.y = rosslt.location(-1.0, name='side')
        goal.pose.position.z = rosslt.location(getter=lambda: mast[-1], setter=set_mast, name='mast')
        goal.pose.orientation.w = rosslt.location(1.0, name='fixed', read_only=True)
        rosslt.location(getter=lambda: climb[0], setter=set_mast, name='altitude', minimum=0.0, maximum=10.0)
        climb[0] = 12.0
        rosslt.location(True, name='is_on')
        rosslt.location(10**30, name='huge')
        rosslt.location('home', name='place')
        rosslt.get_param('~parking')
        publisher.publish(goal)
        rate.sleep()
    """


@pytest.fixture(scope='package')
def master(tmp_path_factory):
    """A master for all tests of the page."""
    with reached_master(tmp_path_factory.mktemp('log'), Path(__file__).parent):
        yield rosgraph.Master('/test')


@pytest.fixture(scope='package')
def page(master):
    """The page, at its address."""
    started = Server()
    yield started
    started.stop()


@pytest.fixture(scope='package')
def browser(page):
    """A browser that looks at the page."""
    opened = Browser(page.view)
    yield opened
    opened.close()


@pytest.fixture(autouse=True)
def _answering(request):
    """A test that has a browser has one that answers."""
    if 'browser' in request.fixturenames:
        request.getfixturevalue('browser').reopen_if_hung()


@pytest.fixture(scope='module')
def talker(master):
    """A node with locations of all kinds, which shows a pose made of them."""
    with Node('talker', TALKER) as node:
        yield node


@pytest.fixture(scope='module')
def script(master, tmp_path_factory):
    """The demo, so slow that the curve stays where it is: its script."""
    file = tmp_path_factory.mktemp('demo') / 'way.script'
    file.write_text('height = 1\ngoto(1, 0.5, height)\n', encoding='utf-8')
    master.setParam('/slt_trajectory/duration', 240.0)
    launched = subprocess.Popen(
        ['roslaunch', 'rosslt', 'demo.launch', 'rviz:=false', 'script:={}'.format(file)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    wait_until(lambda: dict(master.getTopicTypes()).get('/trajectory_markers'), 'the demo runs', PATIENCE)
    yield file
    launched.send_signal(signal.SIGINT)
    launched.wait(30)
