"""YAML and launch files beside the view, with the parameters that they give, in a real browser."""

import pytest
import rosgraph
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from support.browser import PATIENCE
from support.packages import launched, package_of_node
from support.panel import Panel
from support.processes import wait_until
from support.shell import rosslt

pytestmark = pytest.mark.rostest

BUOY = """
import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import String

rospy.init_node('buoy')
pub = rospy.Publisher('buoy', PoseStamped, queue_size=1)
told = rospy.Publisher('~told', String, queue_size=1)
while not rospy.is_shutdown():
    p = PoseStamped()
    frame, lines = rospy.get_param('~frame'), rospy.get_param('~lines')
    told.publish(frame if rospy.get_param('~shown') else lines)
    p.header.frame_id = 'world'
    p.pose.position.x = rospy.get_param('~east')
    p.pose.position.y = rospy.get_param('~place/north') + rospy.get_param('~given') * rospy.get_param('~more')
    p.pose.position.z = rospy.get_param('~heights')[1] + rospy.get_param('~count', 4)
    p.pose.orientation.w = 1.0
    pub.publish(p)
    rospy.sleep(0.05)
"""

LAUNCH = """<launch>
  <!-- <param name="east" value="0"/> ä -->
  <arg name="given" default="1.5"/> <arg name="more" default="0"/>
  <node pkg="buoy_package" type="buoy.py" name="buoy">
    <param name="east" value='2.50'/> <param name="given" value="$(arg given)"/>
    <param name="more" value="$(eval more + 1)"/>
    <param name="frame" value="world"/> <param name="shown" value="True"/>
    <rosparam>place: {{north: -1.0}}  # -1.0</rosparam>
    <rosparam file="{folder}/buoy.yaml"/>
  </node>
  <node pkg="tf2_ros" type="static_transform_publisher" name="dock" args="0.1 2.50 3 0 0 0 1 world dock"/>
</launch>
"""

YAML = '# ä\nheights: [1.0, 2.50,  3]  # 2.50\nlines: "a\n\n  b"\n'


@pytest.fixture(scope='module')
def buoy(master, tmp_path_factory):
    """The launch file of a node whose numbers are parameters, and of a transform."""
    folder = tmp_path_factory.mktemp('buoy')
    environment = package_of_node(folder, 'buoy_package', 'buoy.py', BUOY)
    launch = folder / 'buoy.launch'
    launch.write_text(LAUNCH.format(folder=folder), encoding='utf-8')
    (folder / 'buoy.yaml').write_text(YAML, encoding='utf-8')
    with launched(environment, 'rosslt', 'launch', '--no-markers', str(launch)):
        yield launch


@pytest.fixture
def panel(buoy, page, browser):
    """The panel with the launch file, which says the values in force."""
    browser.open(page.url)
    shown = Panel(browser)
    shown.open('buoy.launch')
    shown.shows('/buoy/~east', '2.50')
    yield shown
    browser.driver.switch_to.default_content()
    browser.open(page.view)


def has_become(name, expected):
    wait_until(lambda: rosgraph.Master('/test').getParam(name) == expected, f'{name} is {expected}', PATIENCE)


def test_parameters_are_marked_where_a_launch_file_gives_them(panel):
    assert panel.line_of('/buoy/~east').startswith('    <param name="east" value=\'2.50\'/> <param')
    assert panel.line_of('/buoy/~place/north') == '    <rosparam>place: {north: -1.0}  # -1.0</rosparam>'
    assert panel.line_of('/buoy/~given').startswith('  <arg name="given" default="1.5"/> <arg')
    panel.shows('/buoy/~given', '1.5')
    panel.says('not marked are /buoy/~more: it stands in')
    panel.browser.picture('source_launch')
    panel.type('/buoy/~east', Keys.CONTROL, 'a', Keys.NULL, '-1.5', Keys.ENTER)
    has_become('/buoy/east', -1.5)
    panel.shows('/buoy/~east', '-1.50')
    assert panel.driver.find_element('css selector', '.changed + s').text == '2.50'
    panel.scrub('/buoy/~place/north', 40)
    has_become('/buoy/place/north', 0.0)
    rosslt('undo', '/buoy')
    panel.shows('/buoy/~place/north', '-1.0')
    rosslt('undo', '/buoy')
    panel.shows('/buoy/~east', '2.50')


def test_a_transform_is_marked_in_the_arguments_of_its_node(panel):
    names = [box.get_attribute('aria-label').partition(',')[0] for box in panel.boxes_of('/dock')]
    assert [panel.box(name).get_attribute('value') for name in names] == ['0.1', '2.50', '3', '0', '0', '0', '1']
    panel.type(names[1], Keys.ARROW_UP, Keys.ESCAPE)
    panel.shows(names[1], '2.51')
    rosslt('undo', '/dock')
    panel.shows(names[1], '2.50')


def test_a_parameter_under_the_mouse_says_where_it_is_given_and_read(panel):
    ActionChains(panel.driver).move_to_element(panel.box('/buoy/~east')).perform()
    assert 'buoy.launch, read at ' in panel.box('/buoy/~east').get_attribute('title')


def test_a_yaml_file_that_was_edited_names_what_it_does_not_say_any_more(panel, buoy):
    file = buoy.parent / 'buoy.yaml'
    panel.open('buoy.yaml')
    panel.shows('/buoy/~heights/1', '2.50')
    panel.type('/buoy/~heights/1', Keys.ARROW_UP, Keys.ESCAPE)
    has_become('/buoy/heights', [1.0, 2.51, 3])
    file.write_text('# one more\n' + YAML, encoding='utf-8')
    panel.browser.wait(lambda: panel.line_of('/buoy/~heights/1').startswith('heights: ['), 'it is followed')
    panel.browser.wait(lambda: 'line 3' in panel.box('/buoy/~heights/1').get_attribute('aria-label'), 'its line')
    file.write_text(YAML.replace('2.50,', '7.50,'), encoding='utf-8')
    panel.says('not marked are /buoy/~heights/1: the file has changed since it was loaded')
    file.write_text('heights: [', encoding='utf-8')
    panel.says('nothing is marked')
    file.write_text(YAML, encoding='utf-8')
    panel.shows('/buoy/~heights/1', '2.51')
    rosslt('undo', '/buoy')
    panel.shows('/buoy/~heights/1', '2.50')


def test_a_truth_value_is_another_one_after_a_click_space_or_enter(panel):
    panel.box('/buoy/~shown').click()
    panel.shows('/buoy/~shown', 'False')
    has_become('/buoy/shown', False)
    panel.shows_former('/buoy/~shown', 'True')
    assert panel.box('/buoy/~shown').get_attribute('aria-checked') == 'false'
    panel.box('/buoy/~shown').send_keys(Keys.SPACE)
    panel.shows('/buoy/~shown', 'True')
    panel.box('/buoy/~shown').send_keys(Keys.ENTER)
    panel.shows('/buoy/~shown', 'False')
    panel.box('/buoy/~shown').send_keys(Keys.SPACE)
    panel.shows('/buoy/~shown', 'True')
    assert not panel.driver.find_elements('css selector', '.changed')


def test_a_text_is_typed_in_its_place(panel):
    panel.type('/buoy/~frame', Keys.CONTROL, 'a', Keys.NULL, 'odom "x" ', Keys.ENTER)
    has_become('/buoy/frame', 'odom "x" ')
    panel.shows_former('/buoy/~frame', 'world')
    panel.browser.picture('source_texts')
    panel.type('/buoy/~frame', Keys.CONTROL, 'a', Keys.NULL, 'nowhere', Keys.ARROW_UP, Keys.ESCAPE)
    panel.shows('/buoy/~frame', 'odom "x" ')
    rosslt('undo', '/buoy')
    panel.shows('/buoy/~frame', 'world')


def test_a_text_in_several_lines_is_named(panel):
    panel.open('buoy.yaml')
    panel.says('not marked are /buoy/~lines: it is written in several lines')


def test_a_default_stays_marked_in_the_code(panel):
    panel.open('buoy.py')
    panel.shows('/buoy/~count', '4')
