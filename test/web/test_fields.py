"""The plot of any tracked field, also of messages that show nothing to drag."""

import pytest

from support.processes import Node

pytestmark = pytest.mark.rostest

SPEED = """
    publisher = rosslt.Publisher('speed', Float64, queue_size=10)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        publisher.publish(rosslt.location(3.0, name='pedal') * rosslt.location(0.5, name='gear'))
        rate.sleep()
    """


def legend(browser):
    """What the lines of the plot are called, and their values where the mouse is."""
    return [label.text for label in browser.driver.find_elements('css selector', '.u-legend .u-label')]


def choose(browser, label, option):
    """Choose from one of the lists."""

    def chosen():
        if browser.value(label) == option:
            return True
        browser.field(label).click()
        for one in browser.driver.find_elements('css selector', '[role=option]'):
            if one.text == option and one.is_displayed():
                one.click()
        return False

    browser.wait(chosen, '{} is {}'.format(label, option))


def test_any_tracked_field_is_plotted_beside_its_sources(talker, browser):
    with Node('car', SPEED):
        browser.wait_for_text('car.py')
        browser.click('Plot a field')
        browser.wait(lambda: browser.value('topic') == '/goal of /talker', 'a topic')
        choose(browser, 'field', 'pose.position.y')
        browser.wait(lambda: legend(browser) == ['s', 'pose.position.y', 'side'], 'a plot of the goal')
        choose(browser, 'topic', '/speed of /car')
        browser.wait(lambda: legend(browser) == ['s', 'data', 'pedal', 'gear'], 'a plot of the speed')
        browser.picture('field')
    browser.click('Close')
    browser.wait(lambda: not legend(browser), 'the plot is closed')
