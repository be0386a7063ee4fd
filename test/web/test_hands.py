"""Hands on arrows and rings of the page; two hands on one thing, in two browsers; and a thing that a device holds."""

import math
import shutil

import pytest

from support.browser import PATIENCE, Browser
from support.processes import Node, wait_until
from support.scenery import marker_node, value
from support.shell import rosslt
from support.teaching import Teach

pytestmark = pytest.mark.rostest

HELD = 'somebody else holds it'
NEAR = 0.2  # metres and radians: what a mouse misses by that takes hold of the front of a box, with wide pixels

BOX = marker_node(
    'box',
    'CUBE',
    0.8,
    'g',
    """
    marker.pose.position.x = rosslt.location(0.0, name='along')
    yaw = rosslt.location(0.0, name='yaw')
    marker.pose.orientation.z = math.sin(yaw / 2)
    marker.pose.orientation.w = math.cos(yaw / 2)
    """,
)

ARROW = 80  # from the middle of the box to the head of its arrow, in pixels
RING = 58  # from there to its arc
BEGIN, TURN = math.radians(150), math.radians(35)  # where a hand takes hold of the arc, and how far it turns it


@pytest.fixture(scope='module')
def box(master):
    with Node('box', BOX) as node:
        yield node


@pytest.fixture
def first(box, browser):
    """A browser with the box at rest where the code has it."""
    rosslt('reset', '/box')
    browser.wait_for_text('box.py')
    return browser


def box_at():
    return value('/box/along'), 0.0, 0.0


def test_an_arrow_moves_a_thing_along_its_axis(first):
    out = ARROW * first.metres((0.0, 0.0, 0.0))
    first.drag_until(
        lambda: abs(value('/box/along') - 1.0) < NEAR,
        lambda: (value('/box/along') + out, 0.0, 0.0),
        (1.0 + out, 0.0, 0.0),
        'the arrow moves the box',
    )
    first.picture('arrow')
    assert value('/box/yaw') == 0.0


def test_a_ring_turns_a_thing(first):
    out = RING * first.metres((0.0, 0.0, 0.0))

    def on_ring(angle):
        return out * math.cos(angle), out * math.sin(angle), 0.0

    first.drag_until(
        lambda: abs(value('/box/yaw') - TURN) < NEAR,
        lambda: on_ring(BEGIN),
        on_ring(BEGIN + TURN),
        'the ring turns the box',
    )
    first.picture('ring')
    assert value('/box/along') == 0.0


@pytest.mark.slow
def test_of_two_browsers_the_first_hand_holds_a_thing_and_the_other_one_follows(first, page):
    second = Browser(page.url)
    try:
        second.wait_for_text('box.py')
        first.see(box_at())
        first.press(first.pixel((0.0, 0.0, 0.0)))
        first.move(first.pixel((0.0, 0.0, 0.0)), first.pixel((0.6, 0.0, 0.0)))
        wait_until(lambda: abs(value('/box/along') - 0.6) < NEAR, 'the box follows the first hand', PATIENCE)
        second.drag_until(lambda: HELD in second.text, box_at, (-1.0, 0.0, 0.0), 'the second hand is refused')
        second.picture('held_in_another_browser')
        assert abs(value('/box/along') - 0.6) < NEAR
        assert HELD not in first.text
        first.release()
        second.drag_until(
            lambda: abs(value('/box/along') + 1.0) < NEAR, box_at, (-1.0, 0.0, 0.0), 'the box is free again'
        )
        first.see((-1.0, 0.0, 0.0))
    finally:
        second.close()


JOYSTICK = """
    from sensor_msgs.msg import Joy

    joy = rospy.Publisher('/joy', Joy, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        joy.publish(Joy(axes=[0.0, 0.0, 0.0], buttons=[1]))
        rate.sleep()
    """


def test_the_page_says_which_device_holds_a_thing_and_leaves_it_to_that(first):
    with Node('joystick', JOYSTICK):
        teaching = Teach(shutil.which('rosslt'), 'teach', '/box', '--by', '/joy', '--wait', '60')
        try:
            teaching.wait_for('holds')
            first.wait_for_text('held by /joy')
            first.drag_until(lambda: HELD in first.text, box_at, (-1.0, 0.0, 0.0), 'the mouse is refused')
            assert value('/box/along') == 0.0
        finally:
            teaching.stop()
