"""What a click on a thing of the page says, and drags that go as far as they go or are refused."""

import pytest

from support.browser import PATIENCE
from support.processes import Node, wait_until
from support.scenery import marker_node, value
from support.shell import rosslt
from support.unmodified import Unmodified

pytestmark = pytest.mark.rostest

BALL = marker_node(
    'ball',
    'SPHERE',
    0.8,
    'r',
    """
    left = rosslt.location(0.25, name='left', maximum=0.5)
    marker.pose.position.x = left + rosslt.location(0.0, name='right', maximum=0.5)
    marker.pose.position.y = rosslt.location(0.0, name='side')
    """,
)

WALL = marker_node(
    'block',
    'CUBE',
    0.6,
    'b',
    "marker.pose.position.x = rosslt.location(getter=lambda: place[-1], setter=set_place, name='place')",
    before="""
    place = [0.0]

    def set_place(value):
        if value > 0.5:
            raise ValueError('there is a wall, as {} says'.format('/a_long_name' * 10) + ' once more' * 40)
        place.append(value)
    """,
)

PATROL = """import rospy
from visualization_msgs.msg import Marker

WAYPOINTS = [
    (0.25, -1.0),  # the dock
    (1.25, 3.0),
]
rospy.init_node('patrol')
pub = rospy.Publisher('stop', Marker, queue_size=1)
stop = Marker(type=Marker.SPHERE)
stop.header.frame_id = 'world'
stop.scale.x = stop.scale.y = stop.scale.z = 0.8
stop.pose.orientation.w = stop.color.a = stop.color.g = 1.0
while not rospy.is_shutdown():
    stop.pose.position.x, stop.pose.position.y = WAYPOINTS[0]
    pub.publish(stop)
    rospy.sleep(0.05)
"""


@pytest.fixture(scope='module')
def ball(master):
    with Node('ball', BALL) as node:
        yield node


def test_a_click_says_where_a_thing_comes_from(ball, browser):
    browser.wait_for_text('ball.py')
    browser.click_at((0.25, 0.0, 0.0), 'Where it comes from')
    browser.wait_for_text('/ball → /ball')
    text = browser.text
    assert '0.25 [left, ball.py:' in text
    assert 'right = 0 (ball.py:' in text
    assert ball.file in text
    browser.picture('details')
    browser.click('Close')
    browser.wait(lambda: 'Where it comes from' not in browser.text, 'the details are closed')


def test_what_a_drag_changes_is_chosen_in_the_details(ball, browser):
    browser.wait_for_text('ball.py')
    browser.click_at(place(), 'Where it comes from')
    titles = {
        button.text.partition(' ')[0]: button.text for button in browser.driver.find_elements('tag name', 'button')
    }
    for name in ('right', 'side'):
        browser.click(titles[name])
    browser.wait(lambda: all('✓ ' + titles[name] in browser.text for name in ('right', 'side')), 'both are marked')
    browser.click('✓ ' + titles['side'])
    browser.click('✓ ' + titles['right'])
    browser.wait(lambda: '✓ left (ball.py' in browser.text, 'the default is marked')
    browser.click('Close')
    browser.wait(lambda: 'Where it comes from' not in browser.text, 'the details are closed')


def place():
    """Where the ball is."""
    return value('/ball/left') + value('/ball/right'), value('/ball/side'), 0.0


def test_a_drag_is_taken_back_in_the_details(ball, browser):
    browser.wait_for_text('ball.py')
    browser.drag_until(
        lambda: abs(value('/ball/side') + 1.0) < 0.1, place, (0.25, -1.0, 0.0), 'the ball follows the mouse'
    )
    browser.click_at((0.25, -1.0, 0.0), 'Where it comes from')
    browser.click('Undo the last drag')
    wait_until(lambda: value('/ball/side') == 0.0, 'the drag is taken back', PATIENCE)
    browser.picture('undone')
    browser.click('Close')
    browser.wait(lambda: 'Where it comes from' not in browser.text, 'the details are closed')


def test_a_drag_goes_as_far_as_it_goes(ball, browser):
    browser.wait_for_text('ball.py')
    browser.drag_until(
        lambda: value('/ball/left') == value('/ball/right') == 0.5,
        place,
        (2.0, 0.0, 0.0),
        'the ball comes to the bounds of its sources',
    )


def test_a_refused_drag_is_told_and_the_thing_goes_back(master, browser):
    with Node('wall', WALL):
        browser.wait_for_text('place')

        browser.drag_until(
            lambda: 'there is a wall' in browser.text, lambda: (0.0, 0.0, 0.0), (1.5, 0.0, 0.0), 'the refusal is told'
        )
        browser.wait(lambda: not browser.cut_off('[class*=Notification-]:not(button)'), 'all of the notes can be read')
        browser.picture('refused_drag')
        assert float(rosslt('get', '/wall/place').stdout) <= 0.5


@pytest.mark.slow
def test_a_waypoint_is_duplicated_in_the_details(master, browser, tmp_path):
    with Unmodified(tmp_path, 'patrol', PATROL) as node:
        browser.wait_for_text('WAYPOINTS_0_0')
        browser.click_at((0.25, -1.0, 0.0), 'Where it comes from')
        browser.click('Duplicate')
        browser.wait_for_text(
            'duplicated WAYPOINTS_0 in patrol.py; /patrol has the rows as they are now at its next start'
        )
        row = '    (0.25, -1.0),  # the dock\n'
        assert node.file.read_text() == PATROL.replace(row, row * 2)
        browser.picture('duplicated')
        browser.click('Close')
        browser.wait(lambda: 'Where it comes from' not in browser.text, 'the details are closed')


@pytest.mark.slow
def test_a_call_of_a_live_script_is_duplicated_in_the_details(browser, script):
    text = script.read_text() + 'goto(-1, 2, height)\n'
    script.write_text(text)
    browser.wait_for_text('line 3:')
    # The end of the curve stands on the waypoint, and is white in its middle.
    browser.click_at((1.0, 0.5, 1.0), 'Where it comes from', within=8)
    browser.click('Duplicate')
    browser.wait_for_text('duplicated line 2 in way.script')
    row = 'goto(1, 0.5, height)\n'
    assert script.read_text() == text.replace(row, row * 2)
    browser.click('Close')
    browser.wait(lambda: 'Where it comes from' not in browser.text, 'the details are closed')
