"""Which things of the page show their handles: those that somebody has clicked."""

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.wheel_input import ScrollOrigin
from selenium.webdriver.common.keys import Keys

from support.browser import PATIENCE
from support.processes import Node, wait_until
from support.scenery import value
from support.shell import rosslt

pytestmark = pytest.mark.rostest

#: Four boxes, of which the first is gray and can be made wider to the left, and a line with a point that moves; a gray
#: box that can be made wider and nothing else, and one that no change moves.
BOXES = """
    from geometry_msgs.msg import Point
    from visualization_msgs.msg import Marker, MarkerArray

    def marker(number, kind, size):
        made = Marker(type=kind, id=number)
        made.header.frame_id = 'world'
        made.scale.x = made.scale.y = made.scale.z = size
        made.color.b = made.color.a = 1.0
        made.pose.orientation.w = 1.0
        return made

    publisher = rosslt.Publisher('boxes', MarkerArray, queue_size=10)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        boxes = [marker(number, Marker.CUBE, 0.5) for number in range(4)]
        boxes[0].color.r = boxes[0].color.g = boxes[0].color.b = 0.5
        boxes[0].pose.orientation.z, boxes[0].pose.orientation.w = 1.0, 0.0
        boxes[0].pose.position.x = -1.5
        boxes[0].pose.position.y = rosslt.location(0.0, name='across')
        boxes[0].scale.x = rosslt.location(0.5, name='width')
        for number, box in enumerate(boxes[1:], 1):
            box.pose.position.x = rosslt.location(-1.5, name='along{}'.format(number))
            box.pose.position.y = -1.0 * number
        line = marker(4, Marker.LINE_STRIP, 0.05)
        line.points = [Point(0.5, -1.0, 0.0), Point(0.5, rosslt.location(-2.0, name='end'), 0.0)]
        wide, fixed = marker(5, Marker.CUBE, 0.5), marker(6, Marker.CUBE, 0.5)
        wide.color = boxes[0].color
        wide.pose.orientation = boxes[0].pose.orientation
        wide.pose.position.x, wide.pose.position.y = 2.5, 0.5
        wide.scale.x = rosslt.location(0.5, name='only_width')
        fixed.pose.position.x = rosslt.location(1.5, name='fixed', read_only=True)
        fixed.pose.position.y = -1.0
        publisher.publish(MarkerArray([*boxes, line, wide, fixed]))
        rate.sleep()
    """

BOX = (-1.5, 0.0, 0.0)
OTHERS = [(-1.5, -1.0 * number, 0.0) for number in (1, 2, 3)]
#: Where the cube is that makes the first box wider: half of it sticks out.
CUBE = (BOX[0] - 0.27, 0.0, 0.0)
END = (0.5, -2.0, 0.0)
WIDE, ITS_CUBE = (2.5, 0.5, 0.0), (2.5 - 0.27, 0.5, 0.0)
FIXED = (1.5, -1.0, 0.0)
VOID = (0.5, 0.5, 0.0)
PIXELS = 60  # from the middle of a thing to a place on its arrow


@pytest.fixture(scope='module')
def boxes(master):
    with Node('boxes', BOXES) as node:
        yield node


@pytest.fixture
def view(boxes, browser):
    """A browser with all things where the code has them, and nothing selected."""
    rosslt('reset', '/boxes')
    browser.wait_for_text('boxes.py')
    browser.see(*OTHERS, END)
    browser.driver.find_element('tag name', 'body').send_keys(Keys.ESCAPE)
    browser.wait_until_gone(arrow(browser, BOX, 1), *[arrow(browser, other, 0) for other in OTHERS])
    return browser


def arrow(browser, place, axis):
    """A point of the world on the arrow of a thing."""
    length = PIXELS * browser.metres(place)
    return tuple(part + length * (index == axis) for index, part in enumerate(place))


def click(browser, point):
    browser.press(browser.pixel(point))
    browser.release()


def test_a_thing_that_is_clicked_shows_its_handles_and_others_do_not(view):
    view.wait_until_gone(CUBE)
    view.picture('unselected')
    click(view, BOX)
    view.see(arrow(view, BOX, 1), CUBE)
    view.picture('selected')
    assert 'Where it comes from' not in view.text, 'a first click shows the handles alone'
    click(view, OTHERS[0])
    view.see(arrow(view, OTHERS[0], 0))
    view.wait_until_gone(arrow(view, BOX, 1), CUBE)
    click(view, VOID)
    view.wait_until_gone(arrow(view, OTHERS[0], 0))


def test_a_thing_is_dragged_at_once_and_is_selected_by_that(view):
    view.press(view.pixel(OTHERS[1]))
    view.move(view.pixel(OTHERS[1]), view.pixel((-2.5, -2.0, 0.0)))
    wait_until(lambda: abs(value('/boxes/along2') + 2.5) < 0.1, 'the box follows', PATIENCE)
    view.release()
    view.see(arrow(view, (-2.5, -2.0, 0.0), 0), within=5)
    view.picture('selected_by_drag')
    view.wait_until_gone(arrow(view, OTHERS[0], 0))


def test_a_body_without_tracked_numbers_is_clicked_for_the_sizes(view):
    view.wait_until_gone(ITS_CUBE)
    click(view, WIDE)
    view.see(ITS_CUBE)
    view.picture('sizes_alone')


@pytest.mark.slow
def test_what_no_change_moves_says_why_and_lets_a_drag_turn_the_view(view, page):
    try:
        view.see(FIXED)
        view.press(view.pixel(FIXED))
        view.move(view.pixel(FIXED), (view.pixel(FIXED)[0] - 200, view.pixel(FIXED)[1]))
        view.wait_until_gone(FIXED, OTHERS[1])
        view.picture('turned_view')
        view.release()
        view.open(page.view)
        view.wait_for_text('boxes.py')
        view.click_at(FIXED, 'takes no change')
        view.picture('why_fixed')
    finally:
        view.open(page.view)


def test_a_checkbox_shows_all_handles(view):
    view.field('Show all handles').click()
    view.see(arrow(view, BOX, 1), *[arrow(view, other, 0) for other in OTHERS], CUBE)
    view.picture('all_handles')
    view.field('Show all handles').click()
    view.wait_until_gone(CUBE)


def test_a_thing_under_the_mouse_is_marked(view):
    assert view.canvas().value_of_css_property('cursor') == 'auto'
    view.move(view.pixel(VOID), view.pixel(OTHERS[1]))
    wait_until(lambda: view.canvas().value_of_css_property('cursor') == 'pointer', 'the cursor is a hand', PATIENCE)
    view.picture('hovered')


def red(browser):
    """How many rows and columns of pixels, at most, there are between two that have the color of an arrow along x."""
    image = browser.screenshot()
    rows, columns = ((image[..., 0] > 200) & (image[..., 1] < 100) & (image[..., 2] > 60)).nonzero()
    return max(rows.max() - rows.min(), columns.max() - columns.min()) if rows.size else 0


def test_handles_have_the_same_size_from_near_by(view, page):
    click(view, OTHERS[0])
    view.see(arrow(view, OTHERS[0], 0))
    before, seen = red(view), [view.screenshot()]

    def is_still():
        seen.append(view.screenshot())
        return (seen[-1] == seen[-2]).all()

    try:
        origin = ScrollOrigin.from_viewport(*view.pixel(VOID))
        for _ in range(3):
            ActionChains(view.driver).scroll_from_origin(origin, 0, -200).perform()
        view.wait_until_gone(OTHERS[2])
        view.wait(is_still, 'the camera rests')
        view.picture('near_by')
        assert 0.85 * before < red(view) < 1.15 * before
    finally:
        view.open(page.view)
