"""What a browser without a graphics card does without."""

import pytest

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


def test_a_browser_with_a_graphics_card_draws_smooth_ones(page, browser):
    """The browser of the tests has none: here it says that it has."""
    added = browser.driver.execute_cdp_cmd(
        'Page.addScriptToEvaluateOnNewDocument',
        {
            'source': """
            const real = WebGL2RenderingContext.prototype.getParameter;
            WebGL2RenderingContext.prototype.getParameter = function (name) {
              return name === 0x9246 /* UNMASKED_RENDERER_WEBGL */ ? 'a graphics card' : real.call(this, name);
            };
            """
        },
    )
    try:
        browser.open(page.url)
        assert has_smooth_edges(browser)
    finally:
        browser.driver.execute_cdp_cmd('Page.removeScriptToEvaluateOnNewDocument', {'identifier': added['identifier']})
        browser.open(page.url)
