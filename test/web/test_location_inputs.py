"""The numbers on the page, in a real browser."""

import signal

import pytest
from selenium.webdriver.common.keys import Keys

from support import scenery
from support.browser import PATIENCE
from support.processes import Node, wait_until
from support.shell import rosslt
from support.unmodified import Unmodified

pytestmark = pytest.mark.rostest


def value(name):
    return scenery.value('/talker/' + name)


def has_become(name, expected):
    wait_until(lambda: value(name) == expected, '{} is {}'.format(name, expected), PATIENCE)


def test_every_location_has_a_field(talker, browser):
    browser.wait_for_text('talker.py')
    names = {'radius', 'side', 'mast', 'huge', 'fixed', 'is_on', 'place', 'altitude', 'port', '~parking'}
    browser.wait(lambda: names <= set(browser.labels()), 'all fields are there')
    assert browser.row('radius').find_elements('css selector', '[role=slider]')
    assert float(browser.value('side')) == -1.0
    assert browser.value('place') == 'home'
    assert not browser.field('fixed').is_enabled()
    assert browser.value('huge') == str(10**30)
    assert browser.value('altitude') == '12.0', 'a getter may be beyond the bounds'
    assert browser.field('side').is_enabled()
    assert browser.value('port') == 'the getter of port fails: OSError: the port is closed'
    assert not browser.field('port').is_enabled()
    browser.picture('numbers')


def test_a_slider_changes_its_location_and_marks_it(talker, browser):
    browser.slide('radius', 40)
    wait_until(lambda: value('radius') > 1.1, 'radius follows the slider', PATIENCE)
    browser.wait(lambda: '● radius' in browser.labels(), 'radius is marked')
    browser.picture('slider')
    browser.click('undo')
    has_become('radius', 1.0)
    browser.wait(lambda: '● radius' not in browser.labels(), 'radius is not marked any more')
    browser.wait(lambda: float(browser.value('radius')) == 1.0, 'the field follows')


def test_what_is_typed_is_taken_when_the_typing_ends(talker, browser):
    browser.type('side', '-2.25')
    has_become('side', -2.25)
    history = rosslt('log', '/talker').stdout
    assert '-2.0' not in history, 'half of the number was taken'


def test_a_whole_number_that_a_browser_cannot_hold_is_typed_like_any_other(talker, browser):
    browser.type('huge', str(10**30 + 1))
    wait_until(lambda: int(rosslt('get', '/talker/huge').stdout) == 10**30 + 1, 'it is taken', PATIENCE)


def test_what_is_no_number_is_told_and_the_field_goes_back(talker, browser):
    before = browser.value('side')
    browser.type('side', 'abc')
    browser.field('side').send_keys(Keys.TAB)
    browser.wait_for_text("'abc' is not a number")
    browser.wait(lambda: browser.value('side') == before, 'the field goes back')
    assert value('side') == float(before)


def test_a_refused_change_is_told_and_the_field_goes_back(talker, browser):
    browser.type('mast', '7')
    browser.wait_for_text('the mast is 5 m high at most')
    browser.picture('refused_number')
    browser.wait(lambda: float(browser.value('mast')) == 1.0, 'the field goes back')
    assert float(rosslt('get', '/talker/mast').stdout) == 1.0


def test_a_change_from_elsewhere_is_seen(talker, browser):
    rosslt('set', '/talker/radius', '2.5')
    browser.wait(lambda: float(browser.value('radius')) == 2.5, 'the page follows')


def test_reset_gives_the_values_of_the_code_again(talker, browser):
    rosslt('set', '/talker/radius', '3.5')
    browser.click('reset')
    has_become('radius', 1.0)


def test_save_shows_the_diff_and_writes_it_where_the_number_stands(talker, browser):
    rosslt('set', '/talker/side', '--', '-3.5')
    browser.wait(lambda: float(browser.value('side')) == -3.5, 'the page follows')
    browser.click('save')
    browser.wait_for_text("location(-3.5, name='side')")
    browser.picture('save')
    with open(talker.file, encoding='utf-8') as file:
        assert "location(-1.0, name='side')" in file.read(), 'nothing is written before somebody says so'
    browser.click('Write')

    def is_saved():
        with open(talker.file, encoding='utf-8') as file:
            return "location(-3.5, name='side')" in file.read()

    wait_until(is_saved, 'the file has the number', PATIENCE)


def test_undo_takes_nothing_back_where_a_node_hangs_that_may_have_a_part_in_it(talker, browser):
    with Node('zealous', "rosslt.location(1.0, name='share')\nrospy.spin()") as other:
        browser.wait(lambda: 'share' in browser.labels(), 'its location is there')
        rosslt('set', '/talker/radius', '2.5')
        other.process.send_signal(signal.SIGSTOP)
        browser.click('undo')
        browser.wait_for_text('/zealous may have changed, too, and does not answer')
        assert value('radius') == 2.5
        other.process.send_signal(signal.SIGCONT)
        browser.click('undo')
        has_become('radius', 1.0)


#: The 4.0 gives a formula its shape.
HALF = """
import rospy
from std_msgs.msg import Float64
rospy.init_node('half')
pub = rospy.Publisher('half', Float64, queue_size=1)
while not rospy.is_shutdown():
    width = 1.5
    pub.publish(width / 4.0)
    rospy.sleep(0.05)
"""
WIDTH, SHAPE = 'width', 'publish'


@pytest.mark.slow
def test_what_gives_a_formula_its_shape_is_shown_if_asked_for(browser, tmp_path):
    with Unmodified(tmp_path, 'half', HALF):
        browser.wait_for_text('half.py')
        browser.wait(lambda: WIDTH in browser.labels(), 'the other number has a field')
        assert SHAPE not in browser.labels()
        browser.field('Show all numbers').click()
        browser.wait(lambda: {WIDTH, SHAPE} <= set(browser.labels()), 'it has a field')
        browser.picture('shapes')
        browser.field('Show all numbers').click()
        browser.wait(lambda: SHAPE not in browser.labels(), 'its field is gone')
        rosslt('set', '/half/publish', '8.0')
        browser.wait(lambda: '● ' + SHAPE in browser.labels(), 'it is shown as somebody has changed it')


LEGS = """import rospy
from geometry_msgs.msg import Point

SPEED = 1.5


class Leg:
    def __init__(self):
        self.speed = SPEED


rospy.init_node('legs')
pub = rospy.Publisher('legs', Point, queue_size=1)
leg = None
while not rospy.is_shutdown():
    rospy.sleep(0.05)
    leg = leg or Leg()
    pub.publish(leg.speed, SPEED, 0.0)
"""


def test_what_still_has_the_former_value_is_told(browser, tmp_path):
    with Unmodified(tmp_path, 'legs', LEGS):
        browser.wait(lambda: 'SPEED' in browser.labels(), 'its number is there')
        browser.type('SPEED', '2.5')
        browser.wait_for_text('speed of /legs still holds what was made of the former value')
        assert rosslt('get', '/legs/SPEED').stdout == '2.5\n'
