"""Every part of the demo of markers, the master too, is killed and started again while the others run, in many orders.

Afterwards drags work, the handles are those that were there before, and so are the parameters. `./run bench restarts`
takes all orders.
"""

import contextlib

import pytest

from support.restarts import Demo, ShownDemo, orders, turned

pytestmark = [pytest.mark.rostest, pytest.mark.slow]


@pytest.fixture
def demo(master, tmp_path):
    with contextlib.closing(Demo(master, tmp_path)) as made:
        yield made


def test_after_any_two_were_killed_and_started_again_in_any_order_all_is_as_before(demo):
    for order in orders(demo.parts, 2):
        demo.restart(order)


def test_after_all_were_killed_and_started_again_all_is_as_before(demo):
    for order in turned(demo.parts):
        demo.restart(order)


@pytest.fixture
def shown_demo(master, tmp_path, request):
    with contextlib.closing(ShownDemo(master, tmp_path)) as made:
        yield made
        made.screenshot(request.node.name)


def test_after_rviz_and_what_it_shows_were_killed_and_started_again_a_mouse_drags(shown_demo):
    """In 4 of the 24 orders: each part is at each place once."""
    for order in turned(shown_demo.parts):
        shown_demo.restart(order)
