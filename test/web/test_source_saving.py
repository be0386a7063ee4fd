"""What saving would write, and the saving, in the source beside the view, in a real browser."""

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from support.browser import PATIENCE
from support.packages import launched, package_of_node
from support.panel import Panel
from support.processes import wait_until
from support.shell import rosslt

pytestmark = pytest.mark.rostest

TWIN = """
import rospy
from geometry_msgs.msg import Point

rospy.init_node('twin')
pub = rospy.Publisher('~at', Point, queue_size=1)
while not rospy.is_shutdown():
    pub.publish(0.50, rospy.get_param('~given', 2.0), 0.25)
    rospy.sleep(0.05)
"""

LAUNCH = """<launch>
  <arg name="given" default="1.5"/>
  <node pkg="twin_package" type="twin.py" name="left"><param name="given" value="$(eval given + 0)"/></node>
  <node pkg="twin_package" type="twin.py" name="right"><param name="given" value="3"/></node>
</launch>
"""
X, Z = '/left/publish_0', '/left/publish_2'


@pytest.fixture(scope='module')
def twin(master, tmp_path_factory):
    """The file of two nodes."""
    folder = tmp_path_factory.mktemp('twin')
    environment = package_of_node(folder, 'twin_package', 'twin.py', TWIN)
    launch = folder / 'twin.launch'
    launch.write_text(LAUNCH, encoding='utf-8')
    with launched(environment, 'rosslt', 'launch', '--no-markers', str(launch)):
        yield folder / 'twin_package' / 'twin.py'


@pytest.fixture
def panel(twin, page, browser):
    """The panel with the file of the nodes, which run as it says."""
    browser.open(page.url)
    shown = Panel(browser)
    shown.open('twin.py')
    for node in ('/left', '/right'):
        shown.box(f'{node}/publish_0')
    yield shown
    shown.prefer('')
    browser.driver.switch_to.default_content()
    browser.open(page.view)


def press(panel, title):
    panel.driver.find_element('xpath', f'//div[@id="bar"]/button[.="{title}"]').click()


def lines(panel, kind):
    return [line.text for line in panel.driver.find_elements('css selector', f'#diff {kind}')]


def shows_diff(panel, old, new):
    panel.browser.wait(lambda: lines(panel, 'ins') == ['+    ' + new], f'{new} is new')
    assert lines(panel, 'del') == ['-    ' + old]
    assert panel.driver.execute_script('return document.getElementById("diff").scrollLeft') == 0


def is_closed(panel):
    panel.browser.wait(lambda: not panel.driver.find_element('id', 'diff').is_displayed(), 'the source is shown')


FIRST = "pub.publish(0.50, rospy.get_param('~given', 2.0), 0.25)"
THEN = "pub.publish(0.50, rospy.get_param('~given', 2.0), 0.75)"


def test_the_diff_stands_in_the_whole_file_and_is_what_is_written(panel, twin):
    before = twin.read_text(encoding='utf-8')
    press(panel, 'Show the diff')
    panel.says('nothing to save: all is as the file says')
    is_closed(panel)
    panel.type(Z, Keys.CONTROL, 'a', Keys.NULL, '0.75')
    press(panel, 'Show the diff')
    shows_diff(panel, FIRST, THEN)
    shown = panel.driver.find_elements('css selector', '#diff .line')
    kept = [line for line in shown if line.find_elements('css selector', 'span, del')]
    assert [line.text[1:] for line in kept] == before.split('\n')[:-1]
    panel.browser.picture('source_diff')
    ActionChains(panel.driver).send_keys(Keys.ESCAPE).perform()
    is_closed(panel)
    assert twin.read_text(encoding='utf-8') == before
    ActionChains(panel.driver).send_keys(Keys.ENTER).perform()  # the focus is on the button
    shows_diff(panel, FIRST, THEN)
    ActionChains(panel.driver).send_keys(Keys.TAB, Keys.ENTER).perform()
    panel.says(f'saved in {twin}')
    is_closed(panel)
    assert twin.read_text(encoding='utf-8') == before.replace(FIRST, THEN)
    panel.browser.wait(lambda: not panel.driver.find_elements('css selector', '.changed'), 'all is as in the file')
    panel.shows(Z, '0.75')


def test_what_cannot_be_saved_is_said(panel):
    rosslt('set', '/left/publish_0', '1.5')
    rosslt('set', '/right/publish_0', '2.5')
    press(panel, 'Show the diff')
    panel.says('nothing can be saved: ')
    panel.says('several values were read here, and 0.50 cannot become both 1.50 (for publish_0) and 2.50')
    is_closed(panel)
    rosslt('undo', '/right')
    rosslt('undo', '/left')
    rosslt('set', '/left/~given', '7.5')
    panel.open('twin.launch')
    panel.says('not marked are /left/~given')
    press(panel, 'Show the diff')
    panel.says('/left/~given cannot be saved: it stands in')
    rosslt('undo', '/left')


def test_an_edit_of_somebody_else_is_not_overwritten(panel, twin):
    panel.type(X, Keys.CONTROL, 'a', Keys.NULL, '4.5', Keys.ENTER)
    press(panel, 'Show the diff')
    panel.browser.wait(lambda: lines(panel, 'ins'), 'the diff')
    edited = '# of somebody else\n' + twin.read_text(encoding='utf-8')
    twin.write_text(edited, encoding='utf-8')
    press(panel, 'Save')
    panel.says('nothing is written: ')
    panel.says('it was edited at this moment; try again')
    is_closed(panel)
    assert twin.read_text(encoding='utf-8') == edited
    rosslt('undo', '/left')


@pytest.mark.parametrize('scheme', ['light', 'dark'])
def test_both_colors_of_the_diff_can_be_read(panel, scheme):
    panel.prefer(scheme)
    panel.type(X, Keys.CONTROL, 'a', Keys.NULL, '5.5', Keys.ENTER)
    press(panel, 'Show the diff')
    panel.browser.wait(lambda: lines(panel, 'ins') and lines(panel, 'del'), 'the diff')
    panel.browser.picture('source_diff_' + scheme)
    assert panel.low_contrasts() == []
    panel.open('twin.launch')
    is_closed(panel)
    wait_until(lambda: rosslt('undo', '/left').returncode == 0, 'it is taken back', PATIENCE)
