"""Hands on arrows and rings of the page; and two hands on one thing, in two browsers, or one of them in RViz."""

import math
import os
import subprocess
from pathlib import Path

import pytest

from support.browser import PATIENCE, Browser
from support.processes import Node, wait_until
from support.scenery import marker_node, value
from support.shell import rosslt

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

ARROW = 1.0  # from the middle of the box to the head of its arrow, in metres
RING = 0.785  # from there to its arc
BEGIN, TURN = math.radians(150), math.radians(35)  # where a hand takes hold of the arc, and how far it turns it

#: A hand in RViz, which does what it is told: a word in a line, and perhaps a number.
RVIZ_HAND = """
    from support.hand import Hand
    hand, name, feedback = Hand(), '/box::0', None
    rospy.Timer(rospy.Duration(0.5), lambda _: feedback and hand.keep(feedback))
    for line in sys.stdin:
        word, *numbers = line.split()
        if word == 'press':
            feedback = hand.press(name)
        elif word == 'move':
            hand.move(feedback, dx=float(numbers[0]))
        elif word == 'release':
            hand.release(feedback)
            feedback = None
        print(hand.position(name)[0], name + ':note' in hand.names(), flush=True)
    """


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


class Rviz:
    """`slt_visualization`, and a hand that does what one does in RViz."""

    def __init__(self):
        self._server = subprocess.Popen(
            ['rosrun', 'rosslt', 'slt_visualization'],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        tests = str(Path(__file__).resolve().parents[1])
        self._hand = Node('rviz_hand', RVIZ_HAND, PYTHONPATH='{}:{}'.format(tests, os.environ['PYTHONPATH']))

    def does(self, *words):
        """Have the hand do something; gives where it sees the box then, and whether there is a note at it."""
        print(*words, file=self._hand.process.stdin, flush=True)
        position, has_note = self._hand.read_line().split()
        return float(position), has_note == 'True'

    def stop(self):
        self._hand.stop()
        self._server.terminate()
        self._server.wait(30)


@pytest.fixture
def rviz(master):
    started = Rviz()
    yield started
    started.stop()


def box_at():
    return value('/box/along'), 0.0, 0.0


def test_an_arrow_moves_a_thing_along_its_axis(first):
    first.drag_until(
        lambda: abs(value('/box/along') - 1.0) < NEAR,
        lambda: (value('/box/along') + ARROW, 0.0, 0.0),
        (1.0 + ARROW, 0.0, 0.0),
        'the arrow moves the box',
    )
    first.picture('arrow')
    assert value('/box/yaw') == 0.0


def on_ring(angle):
    return RING * math.cos(angle), RING * math.sin(angle), 0.0


def test_a_ring_turns_a_thing(first):
    first.drag_until(
        lambda: abs(value('/box/yaw') - TURN) < NEAR,
        lambda: on_ring(BEGIN),
        on_ring(BEGIN + TURN),
        'the ring turns the box',
    )
    first.picture('ring')
    assert value('/box/along') == 0.0


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


def test_what_a_hand_in_rviz_holds_is_held_on_the_page(first, rviz):
    rviz.does('press')
    rviz.does('move', 0.5)
    wait_until(lambda: abs(value('/box/along') - 0.5) < NEAR, 'the box follows RViz', PATIENCE)
    first.drag_until(lambda: HELD in first.text, box_at, (-1.0, 0.0, 0.0), 'the hand on the page is refused')
    first.picture('held_in_rviz')
    assert abs(value('/box/along') - 0.5) < NEAR
    rviz.does('release')
    first.drag_until(lambda: abs(value('/box/along') + 1.0) < NEAR, box_at, (-1.0, 0.0, 0.0), 'the box is free again')


def test_what_a_hand_on_the_page_holds_is_held_in_rviz(first, rviz):
    first.see(box_at())
    first.press(first.pixel((0.0, 0.0, 0.0)))
    first.move(first.pixel((0.0, 0.0, 0.0)), first.pixel((0.6, 0.0, 0.0)))
    wait_until(lambda: abs(value('/box/along') - 0.6) < NEAR, 'the box follows the page', PATIENCE)
    rviz.does('press')
    rviz.does('move', -1.0)
    wait_until(lambda: rviz.does('look')[1], 'the hand in RViz is told', PATIENCE)
    rviz.does('release')
    # a slow browser may still be on its way to 0.6; RViz's view, which has just started, may have heard of the page's
    # hand only while its own was moving, and takes back what that one did
    wait_until(
        lambda: abs(rviz.does('look')[0] - value('/box/along')) < 1e-6 and abs(value('/box/along') - 0.6) < NEAR,
        'RViz shows the box where the page holds it',
        PATIENCE,
    )
    first.release()
