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


def test_two_hands_on_one_thing_the_first_one_holds_it(script, browser, page):
    see(browser, script)
    x, y = numbers(script)[:2]
    second = Browser(page.url)
    try:
        see(second, script)
        start, other = browser.pixel((x, y, 1.0)), browser.pixel((x + 1.0, y, 1.0))

        def held():
            browser.press(start)
            browser.move(start, browser.pixel((x + 0.5, y, 1.0)))
            if numbers(script)[:2] != [x, y]:
                return True
            browser.release()
            return False

        browser.wait(held, 'the first hand gets hold of it')
        wait_until(lambda: abs(numbers(script)[0] - x - 0.5) < 0.1, 'it follows the first hand', PATIENCE)

        def refused():
            here = second.pixel((numbers(script)[0], y, 1.0))
            second.press(here)
            second.move(here, other)
            second.release()
            return 'somebody else holds it' in second.text

        second.wait(refused, 'the second hand is told that it is held')
        assert abs(numbers(script)[0] - x - 0.5) < 0.1
        browser.release()
    finally:
        second.close()
