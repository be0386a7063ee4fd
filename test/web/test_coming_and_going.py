"""Nodes, browsers and pages that come and go."""

import pytest

from support.browser import Server
from support.processes import Node
from support.scenery import marker_node, value
from support.shell import rosslt

pytestmark = pytest.mark.rostest

PLACE = (0.5, 0.0, 0.0)
ELSEWHERE = (1.25, 0.0, 0.0)

POST = marker_node('post', 'CYLINDER', 0.9, 'b', "marker.pose.position.x = rosslt.location(0.5, name='place')")


def see_post(browser):
    """See the post where the code has it: a node that ended has left its values behind."""
    browser.wait_for_text('post.py')
    rosslt('reset', '/post')
    browser.see(PLACE)


def test_a_node_that_ends_takes_its_things_along_and_brings_them_again(master, browser):
    for _ in range(2):
        with Node('post', POST):
            see_post(browser)
        browser.wait(lambda: 'post.py' not in browser.text, 'its numbers are gone')
        browser.wait_until_gone(PLACE)


@pytest.mark.slow
def test_a_browser_that_comes_back_sees_the_present(page, browser):
    with Node('post', POST):
        see_post(browser)
        browser.open('about:blank')
        rosslt('set', '/post/place', '1.25')
        browser.open(page.view)
        browser.wait_for_text('post.py')
        browser.wait(lambda: float(browser.value('place')) == 1.25, 'the field has the present value')
        browser.see(ELSEWHERE)


@pytest.mark.slow
def test_a_browser_connects_again_to_a_page_that_was_away(master, page, browser):
    other = Server('__name:=again')
    try:
        with Node('post', POST):
            browser.open(other.view)
            see_post(browser)
            other.stop()
            rosslt('set', '/post/place', '1.25')
            other.start()
            browser.wait(lambda: float(browser.value('place')) == 1.25, 'the field has the present value')
            browser.see(ELSEWHERE)
            browser.picture('again')
            browser.drag_until(
                lambda: abs(value('/post/place') + 0.5) < 0.1,
                lambda: (value('/post/place'), 0.0, 0.0),
                (-0.5, 0.0, 0.0),
                'it can be dragged',
            )
    finally:
        browser.open(page.view)
        other.stop()
