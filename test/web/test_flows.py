"""The flow of provenance on the page: who feeds whom."""

import pytest

from support.processes import Node

pytestmark = pytest.mark.rostest

RELAY = """
    from geometry_msgs.msg import PoseStamped
    publisher = rosslt.Publisher('shifted', PoseStamped, queue_size=10)

    def shift(goal):
        goal.pose.position.x = goal.pose.position.x - rosslt.location(2.5, name='shift')
        publisher.publish(goal)

    rosslt.Subscriber('goal', PoseStamped, shift)
    rospy.spin()
    """


#: What of a goal comes from the talker's locations.
FIELDS = 'pose.orientation.w, pose.position.x y z'


def drawn(browser):
    """What is written in the drawing."""
    texts = browser.driver.find_elements('css selector', 'svg g.graph text')
    return [text.get_attribute('textContent') for text in texts]


def close(browser):
    browser.click('Close')
    browser.wait(lambda: not drawn(browser), 'the drawing is closed')


def test_the_flow_of_all_nodes_is_drawn_and_follows(talker, browser):
    browser.wait_for_text('talker.py')
    browser.click('Data flow')
    browser.wait(lambda: {'radius', '/talker', '/goal', FIELDS} <= set(drawn(browser)), 'a drawing')
    assert '/relay' not in drawn(browser)
    with Node('relay', RELAY):
        browser.wait(lambda: {'shift', '/relay', '/shifted'} <= set(drawn(browser)), 'the relay is drawn')
        browser.picture('flow')
    browser.wait(lambda: '/relay' not in drawn(browser), 'the relay is drawn no more')
    close(browser)


def test_a_node_tells_what_its_numbers_reach(talker, browser):
    with Node('relay', RELAY):
        browser.wait_for_text('relay.py')
        browser.click('affects')  # of the first node that is there
        browser.wait(lambda: {'radius', '/relay', '/shifted'} <= set(drawn(browser)), 'a drawing')
        browser.picture('affects')
        assert 'shift' not in drawn(browser)
        close(browser)


def test_a_thing_tells_the_whole_way_of_its_numbers(talker, browser):
    with Node('relay', RELAY):
        browser.wait_for_text('relay.py')
        browser.click_at((-1.5, -1.0, 0.95), 'Where it comes from')
        browser.wait_for_text('/talker → /goal → /relay → /shifted')
        browser.wait_for_text('/relay → /shifted')
        browser.wait(lambda: {'radius', 'shift', '/talker', '/relay'} <= set(drawn(browser)), 'a drawing')
        browser.picture('way')
        close(browser)
