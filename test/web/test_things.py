"""The things in the page's 3D view, dragged with the mouse of a real browser."""

import re

import pytest

from support.browser import PATIENCE, Browser
from support.processes import wait_until

pytestmark = pytest.mark.rostest


def numbers(script):
    """The numbers of the waypoint in the script."""
    return [float(number) for number in re.findall(r'-?\d+\.?\d*', script.read_text(encoding='utf-8').splitlines()[1])]


def see(browser, script):
    browser.wait_for_text(script.name)


def test_dragging_the_end_point_changes_the_script(script, browser):
    see(browser, script)

    def dragged():
        browser.drag((1.0, 0.5, 1.0), (1.8, -0.3, 1.0))
        return numbers(script)[:2] != [1.0, 0.5]

    browser.wait(dragged, 'the mouse gets hold of the end point')
    wait_until(
        lambda: all(abs(a - b) < 0.1 for a, b in zip(numbers(script), (1.8, -0.3))),
        lambda: 'the waypoint follows the mouse, it is {}'.format(numbers(script)),
        PATIENCE,
    )
    browser.picture('dragged')


def test_a_second_browser_sees_it(script, browser, page):
    see(browser, script)
    second = Browser(page.url)
    try:
        see(second, script)
        before = second.value('line 2:6')
        browser.type('line 2:6', '-1.25')
        second.wait(lambda: second.value('line 2:6') == '-1.25', 'the other one follows, from ' + before)
        wait_until(lambda: numbers(script)[0] == -1.25, 'the script follows', PATIENCE)
        second.picture('second')
    finally:
        second.close()
