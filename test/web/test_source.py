"""The source beside the view, in a real browser."""

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from support.browser import PATIENCE
from support.processes import Node, wait_until
from support.scenery import marker_node, value
from support.shell import rosslt

pytestmark = pytest.mark.rostest

LAMP = marker_node(
    'lamp',
    'SPHERE',
    0.8,
    'b',
    """
    marker.pose.position.x = rosslt.location(0.50, name='east', minimum=-4.0, maximum=4.0)
    marker.pose.position.y = rosslt.location(-1.0, name='north')
    marker.pose.position.z = rosslt.location(getter=lambda: up[-1], setter=set_up, name='up')
    rosslt.location(2.0, name='fixed', read_only=True)
    rosslt.location(7.5, name='unused')
    """,
    """
    def set_up(height):
        up.append(height)

    up = [0.0]
    """,
)
PLACE = (0.5, -1.0, 0.0)


class Panel:
    """The panel beside the view of a browser."""

    def __init__(self, browser):
        self.browser, self.driver = browser, browser.driver

    def box(self, name):
        """The box of a number."""
        selector = f'#text input[aria-label^="{name},"]'
        return self.browser.wait(lambda: self.driver.find_elements('css selector', selector), f'{name} is marked')[0]

    def shows(self, name, shown):
        self.browser.wait(lambda: self.box(name).get_attribute('value') == shown, f'{name} is shown as {shown}')

    def type(self, name, *keys):
        self.box(name).click()
        self.box(name).send_keys(*keys)

    def says(self, text):
        self.browser.wait(lambda: text in self.driver.find_element('id', 'source').text, f'the panel says {text}')

    def line_of(self, name):
        """The text of the line of a number, without the number."""
        return self.driver.execute_script('return arguments[0].parentNode.textContent', self.box(name))

    def scrub(self, name, pixels):
        hand = ActionChains(self.driver, duration=50).click_and_hold(self.box(name))
        for _ in range(abs(pixels) // 4):
            hand.move_by_offset(4 if pixels > 0 else -4, 0)
        hand.release().perform()


@pytest.fixture(scope='module')
def lamp(master):
    with Node('lamp', LAMP) as node:
        yield node


@pytest.fixture
def panel(lamp, page, browser):
    """The panel with the file of the lamp, as the code has it."""
    rosslt('reset', '/lamp')
    browser.open(page.url)
    browser.wait(lambda: browser.driver.find_elements('css selector', '#tabs button'), 'a file')
    for tab in browser.driver.find_elements('css selector', '#tabs button'):
        if tab.text.startswith('lamp.py'):
            tab.click()
    shown = Panel(browser)
    shown.shows('/lamp/east', '0.50')
    yield shown
    browser.driver.switch_to.default_content()
    browser.open(page.view)


def has_become(name, expected):
    wait_until(lambda: value(name) == expected, f'{name} is {expected}', PATIENCE)


def test_a_number_stands_in_its_line_and_can_be_typed(panel):
    assert "rosslt.location(0.50, name='east'" in panel.line_of('/lamp/east')
    panel.type('/lamp/east', Keys.CONTROL, 'a', Keys.NULL, '1.5', Keys.ENTER)
    has_become('/lamp/east', 1.5)
    panel.shows('/lamp/east', '1.50')
    panel.browser.picture('source')
    assert panel.driver.find_element('css selector', '.changed + s').text == '0.50'
