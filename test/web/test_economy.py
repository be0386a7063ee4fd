"""What a browser without a graphics card does without."""

import pytest

from support.browser import Browser

pytestmark = pytest.mark.rostest

#: Whether the 3D view, the largest canvas, is drawn with smooth edges.
HAS_SMOOTH_EDGES = """
const canvas = [...document.querySelectorAll('canvas')].sort((one, other) => other.width - one.width)[0];
return canvas?.dataset.engine ? canvas.getContext('webgl2').getContextAttributes().antialias : null;
"""


def has_smooth_edges(browser):
    def found():
        smooth = browser.driver.execute_script(HAS_SMOOTH_EDGES)
        return None if smooth is None else [smooth]

    return browser.wait(found, 'the 3D view is there')[0]


def test_a_browser_that_draws_with_the_processor_draws_plain_edges(browser):
    assert not has_smooth_edges(browser)


def test_a_browser_with_a_graphics_card_draws_smooth_ones(page):
    card = Browser(page.url, says_card=True)
    try:
        assert has_smooth_edges(card)
    finally:
        card.close()
