"""The things in the page's 3D view, dragged with the mouse of a real browser."""

import re

import pytest

from support.browser import PATIENCE, Browser
from support.processes import Node, wait_until

pytestmark = pytest.mark.rostest

ROUTE = """
    from nav_msgs.msg import Path

    def at(x, y):
        place = PoseStamped()
        place.header.frame_id = 'world'
        place.pose.position.x, place.pose.position.y, place.pose.orientation.w = x, y, 1.0
        return place

    route = rosslt.Publisher('route', Path, queue_size=10)
    goal = rosslt.Publisher('goal', PoseStamped, queue_size=10)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        path = Path(poses=[at(rosslt.location(-2.0, name='start'), -1.0), at(-0.4, -1.0), at(-0.4, -2.0)])
        path.header.frame_id = 'world'
        route.publish(path)
        goal.publish(at(rosslt.location(0.0, name='goal'), -0.5))
        rate.sleep()
    """


def numbers(script):
    """The numbers of the waypoint in the script."""
    return [float(number) for number in re.findall(r'-?\d+\.?\d*', script.read_text(encoding='utf-8').splitlines()[1])]


def see(browser, script):
    browser.wait_for_text(script.name)


def test_dragging_the_end_point_changes_the_script(script, browser):
    see(browser, script)

    browser.drag_until(
        lambda: all(abs(a - b) < 0.1 for a, b in zip(numbers(script), (1.8, -0.3))),
        lambda: (*numbers(script)[:2], 1.0),
        (1.8, -0.3, 1.0),
        'the waypoint follows the mouse',
    )
    browser.picture('dragged')


def test_the_line_of_a_path_and_the_axes_of_a_pose_are_drawn(master, browser):
    with Node('route', ROUTE):
        browser.wait_for_text('route.py')
        browser.see((-1.2, -1.0, 0.0), within=3)  # between two places of the path
        browser.see((0.0, -0.3, 0.0), within=3)  # on the y axis of the pose
        browser.picture('lines')


@pytest.mark.slow
def test_a_second_browser_sees_it(script, browser, page):
    see(browser, script)
    second = Browser(page.view)
    try:
        see(second, script)
        before = second.value('line 2:6')
        browser.type('line 2:6', '-1.25')
        second.wait(lambda: second.value('line 2:6') == '-1.25', 'the other one follows, from ' + before)
        wait_until(lambda: numbers(script)[0] == -1.25, 'the script follows', PATIENCE)
        second.picture('second')
    finally:
        second.close()
