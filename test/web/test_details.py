"""What a click on a thing of the page says, and drags that go as far as they go or are refused."""

import pytest
import rosgraph

from support.browser import PATIENCE
from support.processes import Node, wait_until
from support.shell import rosslt

pytestmark = pytest.mark.rostest

BALL = """
    from visualization_msgs.msg import Marker
    publisher = rosslt.Publisher('ball', Marker, queue_size=10)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        ball = Marker(type=Marker.SPHERE)
        ball.header.frame_id = 'world'
        ball.scale.x = ball.scale.y = ball.scale.z = 0.8
        ball.color.r = ball.color.a = 1.0
        ball.pose.orientation.w = 1.0
        left = rosslt.location(0.25, name='left', maximum=0.5)
        ball.pose.position.x = left + rosslt.location(0.0, name='right', maximum=0.5)
        ball.pose.position.y = rosslt.location(0.0, name='side')
        publisher.publish(ball)
        rate.sleep()
    """

WALL = """
    from visualization_msgs.msg import Marker

    def set_place(value):
        if value > 0.5:
            raise ValueError('there is a wall')
        place.append(value)

    place = [0.0]
    publisher = rosslt.Publisher('block', Marker, queue_size=10)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        block = Marker(type=Marker.CUBE)
        block.header.frame_id = 'world'
        block.scale.x = block.scale.y = block.scale.z = 0.6
        block.color.b = block.color.a = 1.0
        block.pose.orientation.w = 1.0
        block.pose.position.x = rosslt.location(getter=lambda: place[-1], setter=set_place, name='place')
        publisher.publish(block)
        rate.sleep()
    """


@pytest.fixture(scope='module')
def ball(master):
    with Node('ball', BALL) as node:
        yield node


def value(name):
    """The value in force at a literal of a node, as its parameter says."""
    node, _, location = name.rpartition('/')
    return rosgraph.Master('/test').getParam('{}/rosslt/{}'.format(node, location))


def click(browser, point, says):
    """Click on a thing until the page says something."""

    def clicked():
        pixel = browser.pixel(point)
        browser.press(pixel)
        browser.release()
        return says in browser.text

    browser.wait(clicked, 'a click says ' + says)


def test_a_click_says_where_a_thing_comes_from(ball, browser):
    browser.wait_for_text('ball.py')
    click(browser, (0.25, 0.0, 0.0), 'Where it comes from')
    browser.wait_for_text('/ball → … → /ball → /ball')
    text = browser.text
    assert '0.25 [left, ball.py:' in text
    assert 'right = 0 (ball.py:' in text
    assert ball.file in text
    browser.picture('details')
    browser.click('Close')
    browser.wait(lambda: 'Where it comes from' not in browser.text, 'the details are closed')


def test_a_drag_goes_as_far_as_it_goes(ball, browser):
    browser.wait_for_text('ball.py')

    def dragged():
        browser.drag((value('/ball/left') + value('/ball/right'), value('/ball/side'), 0.0), (2.0, 0.0, 0.0))
        return value('/ball/left') == 0.5

    browser.wait(dragged, 'the ball comes to the bounds of its sources')
    wait_until(lambda: value('/ball/right') == 0.5, 'both sources are at their bounds', PATIENCE)


def test_a_refused_drag_is_told_and_the_thing_goes_back(master, browser):
    with Node('wall', WALL):
        browser.wait_for_text('place')

        def refused():
            browser.drag((0.0, 0.0, 0.0), (1.5, 0.0, 0.0))
            return 'there is a wall' in browser.text

        browser.wait(refused, 'the refusal is told')
        browser.picture('refused_drag')
        assert float(rosslt('get', '/wall/place').stdout) <= 0.5
