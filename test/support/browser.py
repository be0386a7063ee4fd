"""A browser of its own, which looks at the page and has a mouse."""

import base64
import contextlib
import io
import math
import os
import socket
import subprocess
import tempfile
import urllib.error
import urllib.request
from pathlib import Path

import numpy
from PIL import Image
from selenium import webdriver
from selenium.common.exceptions import (
    InvalidSessionIdException,
    StaleElementReferenceException,
    TimeoutException,
    WebDriverException,
)
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.remote_connection import RemoteConnection
from urllib3.exceptions import HTTPError

from support.processes import wait_until

#: For how long a browser may take that draws with the processor alone, in seconds.
PATIENCE = 240.0
#: For how long a browser may not answer that is not taken to have stopped for good, in seconds.
HANG = 120.0
#: How long something may take to come of what a mouse did before it does it again, in seconds.
EFFECT = 20.0
#: What is gray differs by no more than this between red, green and blue, of 255.
GRAY = 60
SIZE = (1100, 800)
FIELD_OF_VIEW = math.radians(75.0)  # of viser's camera, from top to bottom
EYE, FOCUS = (-3.0, -4.5, 3.5), (0.0, 0.0, 0.5)  # where the page's camera is at first
SCREENSHOTS = Path(
    os.environ.get('ROSSLT_SCREENSHOTS') or Path(__file__).resolve().parents[2] / 'build' / 'screenshots'
)

#: What the page needs is not among the system's packages; `./run test` says where it is.
LIBRARIES = os.environ.get('ROSSLT_PAGE_PATH', '')

FLAGS = [
    '--headless=new',
    '--no-sandbox',
    '--use-gl=angle',  # drawn by Mesa, as RViz is: chromium's own SwiftShader locks up for good now and then
    '--use-angle=gl-egl',
    '--ignore-gpu-blocklist',
    '--disable-background-networking',
    '--disable-component-update',
    '--disable-sync',
    '--no-first-run',
    '--window-size={},{}'.format(*SIZE),
]


def python_path():
    """The path of Python modules for a process that shows the page."""
    return '{}:{}'.format(LIBRARIES, os.environ['PYTHONPATH'])


class Server:
    """`rosslt web` in a process of its own.

    Args:
        arguments: those of the command, but for the port.
    """

    def __init__(self, *arguments):
        with socket.socket() as free:
            free.bind(('127.0.0.1', 0))
            self.port = free.getsockname()[1]
        self.url = 'http://127.0.0.1:{}/'.format(self.port)
        self.view = self.url + '?view'  # without the source beside it
        self._arguments = arguments
        self._directory = tempfile.TemporaryDirectory(prefix='rosslt_web_')
        self._log = Path(self._directory.name) / 'log'
        self.start()

    def start(self):
        """Start it, also after a stop, and wait until it answers."""
        with self._log.open('a') as log:
            self.process = subprocess.Popen(
                ['rosslt', 'web', '--port', str(self.port), *self._arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=dict(os.environ, PYTHONPATH=python_path()),
            )
        try:
            wait_until(self.answers, 'the page answers', PATIENCE)
        except AssertionError:
            self.stop()
            raise AssertionError('no page: ' + self.log()) from None

    def answers(self):
        if self.process.poll() is not None:
            raise AssertionError('the page has ended: ' + self.log())
        try:
            with urllib.request.urlopen(self.url, timeout=5):
                return True
        except urllib.error.HTTPError:
            return True
        except OSError:
            return False

    def log(self):
        return self._log.read_text(encoding='utf-8')

    def stop(self):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class _Chromium(webdriver.Chrome):
    """Knows when it has stopped answering: its drawing without a graphics card may lock up for good."""

    is_hung = False

    def execute(self, driver_command, params=None):
        try:
            return super().execute(driver_command, params)
        except (HTTPError, InvalidSessionIdException):
            self.is_hung = True
            raise


class Browser:
    """Chromium with the page in it.

    Args:
        url: of the page.
    """

    def __init__(self, url):
        self._url = url
        self.start()

    def start(self):
        self._profile = tempfile.TemporaryDirectory(prefix='rosslt_browser_', ignore_cleanup_errors=True)
        options = webdriver.ChromeOptions()
        options.binary_location = '/usr/bin/chromium'
        for flag in [*FLAGS, '--user-data-dir=' + self._profile.name]:
            options.add_argument(flag)
        RemoteConnection.set_timeout(HANG)
        self.driver = _Chromium(options=options, service=Service('/usr/bin/chromedriver'))
        self.driver.set_page_load_timeout(HANG - 10)
        self.driver.get(self._url)

    def reopen_if_hung(self):
        """Open another one for the next test if a test has failed since nothing answered any more."""
        if self.driver.is_hung:
            self.close()
            self.start()

    def close(self):
        if self.driver.is_hung:
            subprocess.run(['pkill', '-KILL', '-f', self._profile.name], check=False)
            self.driver.service.stop()
        else:
            self.driver.quit()
        self._profile.cleanup()

    def wait(self, holds, what):
        """Wait until `holds()` gives something true; what the page has drawn anew meanwhile is looked for again."""

        def held():
            try:
                return holds()
            except (StaleElementReferenceException, IndexError):
                return None

        try:
            return wait_until(held, what, PATIENCE)
        except AssertionError:
            self.picture('failed')
            raise

    def picture(self, name):
        """Keep a screenshot, to be looked at after the tests."""
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(TimeoutException):  # no test depends on it: it draws as fast as the processor lets it
            self.driver.save_screenshot(str(SCREENSHOTS / 'web_{}.png'.format(name)))

    def screenshot(self):
        """The red, green and blue of all pixels, from 0 to 255, row by row."""
        # hardly compressed: to compress it takes longer than to draw it
        taken = self.driver.execute_cdp_cmd('Page.captureScreenshot', {'format': 'png', 'optimizeForSpeed': True})
        return numpy.asarray(Image.open(io.BytesIO(base64.b64decode(taken['data']))).convert('RGB'), int)

    @property
    def text(self):
        """All text on the page."""
        return self.text_in('body')

    def text_in(self, selector):
        """The text of the first element that a selector finds, from the browser: Selenium asks each part of it."""
        return self.driver.execute_script('return document.querySelector(arguments[0]).innerText', selector)

    def cut_off(self, selector):
        """The texts of the elements of which a part is not shown, as they are too small or reach out of the window."""
        return self.driver.execute_script(
            """
            const is_cut_off = one => {
                const place = one.getBoundingClientRect();
                return one.scrollWidth > one.clientWidth || one.scrollHeight > one.clientHeight
                    || place.left < 0 || place.top < 0 || place.right > innerWidth || place.bottom > innerHeight;
            };
            return [...document.querySelectorAll(arguments[0])].filter(is_cut_off).map(one => one.innerText);
            """,
            selector,
        )

    def wait_for_text(self, text):
        self.wait(lambda: text in self.text, 'the page says ' + text)

    def labels(self):
        """What the fields are called."""
        return [text for _, text in self._visible('label[for]') if text]

    def _visible(self, selector):
        """What a selector finds that is shown, [(element, its text)]."""
        return self.driver.execute_script(
            """
            const shown = [...document.querySelectorAll(arguments[0])].filter(one => one.checkVisibility());
            return shown.map(one => [one, one.innerText.trim()]);
            """,
            selector,
        )

    def row(self, name):
        """The row of a field."""

        def found():
            for label, text in self._visible('label[for]'):
                if text.split('● ')[-1] == name:
                    return label.find_element(By.XPATH, 'ancestor::div[contains(@class, "mantine-Flex-root")][1]')
            return None

        return self.wait(found, 'a field {}'.format(name))

    def field(self, name):
        """The box of a field, to type into."""
        return self.wait(
            lambda: self.row(name).find_elements(By.CSS_SELECTOR, 'input:not([type=hidden])')[-1], 'a box for ' + name
        )

    def value(self, name):
        """What stands in a field."""
        return self.wait(lambda: [self.field(name).get_attribute('value')], 'a value of ' + name)[0]

    def type(self, name, text):
        """Type into a field."""
        self.field(name).send_keys(Keys.CONTROL, 'a')
        self.field(name).send_keys(text)

    def slide(self, name, pixels):
        """Move a slider to the right."""
        thumb = self.row(name).find_element(By.CSS_SELECTOR, '[role=slider]')
        ActionChains(self.driver).move_to_element(thumb).click_and_hold().move_by_offset(pixels // 2, 0).move_by_offset(
            pixels - pixels // 2, 0
        ).release().perform()

    def click(self, text):
        """Click a button."""

        def clicked():
            for button, its_text in self._visible('button'):
                if its_text == text:
                    try:
                        button.click()
                    except WebDriverException:  # something is still moving over it
                        return False
                    return True
            return False

        self.wait(clicked, 'a button ' + text)

    def open(self, url):
        """Look at another page."""
        self.driver.get(url)

    # In the 3D view.

    def canvas(self):
        """The largest one."""
        found = self.driver.find_elements(By.TAG_NAME, 'canvas')
        return sorted(found, key=lambda one: one.rect['width'] * one.rect['height'])[-1]

    def pixel(self, point):
        """Where a point of the world, (x, y, z), is on the page, as long as nobody has moved the camera."""
        rect = self._view()
        right, up, _ = _seen_from_eye(point) / _metres(point, rect)
        return round(rect['x'] + rect['width'] / 2 + right), round(rect['y'] + rect['height'] / 2 - up)

    def metres(self, point):
        """The width of a pixel at a point of the world."""
        return _metres(point, self._view())

    def _view(self):
        """The place of the canvas on the page, in pixels: {'x', 'y', 'width', 'height'}."""
        return self.driver.execute_script(
            """
            const area = place => place.width * place.height;
            const places = [...document.querySelectorAll('canvas')].map(one => one.getBoundingClientRect());
            return places.sort((one, other) => area(one) - area(other)).pop().toJSON();
            """
        )

    def press(self, pixel):
        pointer = ActionChains(self.driver, duration=30).w3c_actions
        pointer.pointer_action.move_to_location(*pixel)
        pointer.pointer_action.pointer_down()
        pointer.perform()

    def move(self, start, end, steps=8):
        pointer = ActionChains(self.driver, duration=60).w3c_actions
        for step in range(1, steps + 1):
            x, y = (round(a + (b - a) * step / steps) for a, b in zip(start, end))
            pointer.pointer_action.move_to_location(x, y)
        pointer.perform()

    def release(self):
        pointer = ActionChains(self.driver).w3c_actions
        pointer.pointer_action.pointer_up()
        pointer.perform()

    def click_at(self, point, says, within=0):
        """Click on what is drawn at a point of the world until the page says something; `within` is that of `see`."""

        def clicked():
            self.see(point, within=within)
            self.press(self.pixel(point))
            self.release()
            return self._comes(lambda: says in self.text)

        self.wait(clicked, 'a click says ' + says)

    def drag(self, start, end):
        """Drag with the left button what is drawn at a point of the world to another point."""
        self.see(start)
        first, last = self.pixel(start), self.pixel(end)
        self.press(first)
        self.move(first, last)
        self.release()

    def drag_until(self, holds, start, end, what):
        """Drag until `holds()`.

        Args:
            start: gives the point of the world where what is dragged is now.
            end: where it is dragged to.
        """

        def dragged():
            self.drag(start(), end)
            return self._comes(holds)

        self.wait(dragged, what)

    def see(self, *points, within=0):
        """Wait until something colorful is drawn at points of the world: beside it, a mouse would turn the camera.

        Args:
            within: how many pixels beside them is near enough, for thin lines that nobody takes hold of.
        """
        self.wait(lambda: all(self._are_colorful(points, within)), 'something colorful at {}'.format(points))

    def wait_until_gone(self, *points):
        """Wait until nothing colorful is drawn at any of some points of the world any more."""
        self.wait(lambda: set(self._are_colorful(points, 0)) == {False}, 'nothing at {}'.format(points))

    def _are_colorful(self, points, within):
        """Whether each is, in one picture; [None] where the browser takes too long to say."""
        try:
            image = self.screenshot()
        except TimeoutException:
            return [None]
        return [self._is_colorful(image, self.pixel(point), within) for point in points]

    @staticmethod
    def _is_colorful(image, pixel, within):
        rows, columns = (slice(max(0, at - within), at + within + 1) for at in reversed(pixel))
        colors = image[rows, columns]
        return bool((colors.max(axis=2) - colors.min(axis=2) > GRAY).any())

    @staticmethod
    def _comes(holds):
        """Whether something holds soon after a mouse has done something."""
        with contextlib.suppress(AssertionError):
            return wait_until(holds, 'what comes of it', EFFECT)
        return False


def _metres(point, view):
    return 2 * math.tan(FIELD_OF_VIEW / 2) * _seen_from_eye(point)[2] / view['height']


def _seen_from_eye(point):
    """How far a point of the world is to the right of the camera's axis, above it, and along it."""
    out = numpy.subtract(FOCUS, EYE)
    right = numpy.cross(out, (0.0, 0.0, 1.0))
    axes = [axis / numpy.linalg.norm(axis) for axis in (right, numpy.cross(right, out), out)]
    return axes @ numpy.subtract(point, EYE)
