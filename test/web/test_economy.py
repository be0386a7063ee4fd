"""What a browser without a graphics card does without."""

import pytest

from support.browser import Browser
from support.processes import Node
from support.scenery import marker_node, value

pytestmark = pytest.mark.rostest

#: Whether the 3D view, the largest canvas, is drawn with smooth edges.
HAS_SMOOTH_EDGES = """
const canvas = [...document.querySelectorAll('canvas')].sort((one, other) => other.width - one.width)[0];
return canvas?.dataset.engine ? canvas.getContext('webgl2').getContextAttributes().antialias : null;
"""

#: The share of the pixels that are drawn, in each direction.
SHARE = """
const canvas = [...document.querySelectorAll('canvas')].sort((one, other) => other.width - one.width)[0];
return canvas.width / canvas.clientWidth;
"""

#: How many frames have been drawn.
FRAMES = 'return window.__viserTestpoints.rendererInfo.render.frame'

#: What the script relies on, and what was chosen with it.
SETTINGS = 'return typeof window.__viserTestpoints?.devSettings?.set'
PICTURE = 'return window.__viserMutable?.backgroundMaterial?.visible'
CHOSEN = 'return window.__viserTestpoints.devSettings.get().fixedDpr'

#: Has the browser tell its page that each frame takes `frameTakes` ms, whatever it takes; 0: as long as it takes.
FRAME_TIMES = """
const real = window.requestAnimationFrame;
let begun = 0;
let told = 0;
window.frameTakes = 0;
window.requestAnimationFrame = callback => real(now => {
  if (now !== begun) {
    told += window.frameTakes || now - begun;
    begun = now;
  }
  callback(told);
});
"""
SLOW, FAST = 100, 10

#: The fewest pixels: their share in each direction.
FEWEST = 0.35

#: So many frames take long enough to choose another number of pixels.
MANY_FRAMES = 10

#: A box that goes up and up again.
LIFT = marker_node(
    'lift',
    'CUBE',
    0.5,
    'g',
    """
    heights.append((heights.pop() + 0.01) % 2.0)
    marker.pose.position.x = rosslt.location(-1.5, name='column')
    marker.pose.position.z = heights[0]
    """,
    before='heights = [0.0]',
)

BUOY = marker_node('buoy', 'SPHERE', 0.8, 'r', "marker.pose.position.x = rosslt.location(0.5, name='place')")


def has_smooth_edges(browser):
    def found():
        smooth = browser.driver.execute_script(HAS_SMOOTH_EDGES)
        return None if smooth is None else [smooth]

    return browser.wait(found, 'the 3D view is there')[0]


def share(browser):
    return browser.driver.execute_script(SHARE)


def draws(browser, chosen):
    """Whether that share of the pixels is drawn; a canvas has whole ones."""
    return abs(share(browser) - chosen) < 0.01


def takes(browser, milliseconds):
    """Have frames take so long, as far as the page knows."""
    browser.driver.execute_script('window.frameTakes = arguments[0]', milliseconds)


def draws_slowly_for_long(browser):
    """Have it draw so many slow frames that the page chooses another number of pixels, if it ever does."""
    browser.wait_for_text('lift.py')
    takes(browser, SLOW)
    last = browser.driver.execute_script(FRAMES) + MANY_FRAMES
    browser.wait(lambda: browser.driver.execute_script(FRAMES) > last, 'frames are drawn')


@pytest.fixture
def lift(master):
    """Something that moves all the time."""
    with Node('lift', LIFT) as node:
        yield node


@pytest.fixture(scope='module')
def timed(page):
    """A browser whose page believes what it is told of the time that frames take."""
    opened = Browser(page.url, script=FRAME_TIMES)
    yield opened
    opened.close()


def test_a_browser_that_draws_with_the_processor_draws_plain_edges(browser):
    assert not has_smooth_edges(browser)


def test_a_browser_with_a_graphics_card_draws_smooth_ones(page):
    card = Browser(page.url, says_card=True)
    try:
        assert has_smooth_edges(card)
    finally:
        card.close()


def test_viser_has_what_the_script_relies_on(browser):
    has_smooth_edges(browser)  # the 3D view is there
    assert browser.driver.execute_script(SETTINGS) == 'function', (
        'this viser has no __viserTestpoints.devSettings: src/rosslt/web/economy.js needs another way to say fixedDpr'
    )
    browser.wait(lambda: browser.driver.execute_script(PICTURE) is not None, '__viserMutable.backgroundMaterial')
    browser.wait(lambda: browser.driver.execute_script(PICTURE) is False, 'the empty picture is left out')


def test_what_moves_slowly_is_drawn_with_fewer_pixels_and_what_stands_still_with_all(master, timed):
    takes(timed, SLOW)
    with Node('lift', LIFT):
        timed.wait(lambda: draws(timed, FEWEST), 'fewer pixels while the lift moves')
        timed.picture('moving')
    timed.wait(lambda: draws(timed, 1.0), 'all pixels once nothing moves')
    timed.picture('still')


def test_more_pixels_are_drawn_again_where_there_is_time_for_them(lift, timed):
    takes(timed, SLOW)
    timed.wait(lambda: draws(timed, FEWEST), 'fewer pixels while the lift moves')
    takes(timed, FAST)
    timed.wait(lambda: draws(timed, 1.0), 'all pixels')


def test_things_are_clicked_and_dragged_as_well_with_fewer_pixels(lift, timed):
    takes(timed, SLOW)
    with Node('buoy', BUOY):
        timed.wait_for_text('buoy.py')
        timed.wait(lambda: draws(timed, FEWEST), 'fewer pixels while the lift moves')
        timed.drag_until(
            lambda: abs(value('/buoy/place') - 1.5) < 0.1,
            lambda: (value('/buoy/place'), 0.0, 0.0),
            (1.5, 0.0, 0.0),
            'the buoy follows the mouse',
        )
        timed.click_at((1.5, 0.0, 0.0), 'Where it comes from')
        timed.click('Close')


def test_who_has_chosen_the_number_of_pixels_keeps_it(page, lift, timed):
    try:
        timed.open(page.url + '?fixedDpr=0.75')
        draws_slowly_for_long(timed)
        assert draws(timed, 0.75)
    finally:
        timed.open(page.url)


def test_a_graphics_card_is_left_to_viser(page, lift):
    card = Browser(page.url, says_card=True, script=FRAME_TIMES)
    try:
        draws_slowly_for_long(card)
        assert card.driver.execute_script(CHOSEN) is None
    finally:
        card.close()
