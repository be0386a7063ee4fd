"""The launch file of a node that runs as it is, beside the view: its parameters are changed there."""

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from support.browser import PATIENCE
from support.packages import launched, package_of_node
from support.panel import Panel
from support.processes import wait_until
from support.shell import rosslt

pytestmark = pytest.mark.rostest

PLAIN = """
import rospy
from std_msgs.msg import Float64

rospy.init_node('plain')
gain, publisher = rospy.get_param('~gain'), rospy.Publisher('~sent', Float64, queue_size=1)
while not rospy.is_shutdown():
    publisher.publish(gain)
    rospy.sleep(0.03)
"""

LAUNCH = """<launch>
  <node pkg="plain_package" type="plain.py" name="plain">
    <param name="gain" value="2.50"/>
  </node>
</launch>
"""


def sends(gain):
    wait_until(
        lambda: f'{gain}' in rosslt('echo', '--once', '/plain/sent').stdout.split(), f'it sends {gain}', PATIENCE
    )


def test_a_parameter_of_a_node_as_it_is_is_typed_in_its_place(master, page, browser, tmp_path):
    environment = package_of_node(tmp_path, 'plain_package', 'plain.py', PLAIN)
    launch = tmp_path / 'plain.launch'
    launch.write_text(LAUNCH)
    with launched(environment, 'rosslt', 'launch', '--no-markers', '--except', 'plain', str(launch)):
        wait_until(lambda: rosslt('list', '/plain').returncode == 0, 'its parameters', PATIENCE)
        name = rosslt('list', '/plain').stdout.split('\t')[0]
        browser.open(page.url)
        panel = Panel(browser)
        panel.open('plain.launch')
        panel.shows(name, '2.50')
        panel.type(name, Keys.CONTROL, 'a', Keys.NULL, '-1.5', Keys.ENTER)
        sends(-1.5)
        panel.says('takes effect as `rosslt launch` starts /plain again')
        ActionChains(panel.driver).move_to_element(panel.box(name)).perform()
        assert f'given at {launch}:3, a change takes effect' in panel.box(name).get_attribute('title')
        rosslt('undo')
        sends(2.5)
        panel.shows(name, '2.50')
        browser.driver.switch_to.default_content()
        browser.open(page.view)
