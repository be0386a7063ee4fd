#!/usr/bin/env python3
"""rviz.launch: RViz opens with the topics that can be dragged, follows them as they come and go, and has handles."""

import unittest
from pathlib import Path

import rosgraph
import rospy
import rostest
import yaml
from geometry_msgs.msg import Point, PoseStamped
from sensor_msgs.msg import JointState

import rosslt
from support.hand import Hand, wait_until

ROBOT = '<robot><link name="base"/><joint name="hip"><parent link="base"/><child link="leg"/></joint></robot>'
SHOWN = Path(rospy.myargv()[1])


def manager():
    return yaml.safe_load(SHOWN.read_text())['Visualization Manager']


def displays():
    return {display['Name']: display['Class'] for display in manager()['Displays']}


class RvizLaunch(unittest.TestCase):
    def test_rviz_opens_with_the_topics_that_can_be_dragged(self):
        wait_until(SHOWN.exists, 'RViz to be opened', 60.0)
        wait_until(lambda: '/stage' in displays(), 'the display of the stage')
        self.assertEqual(manager()['Global Options']['Fixed Frame'], 'world')
        shown = displays()
        self.assertEqual(shown['/stage'], 'rviz/MarkerArray')
        self.assertNotIn('/blinking', shown, 'RViz knows no tracked types: the handles draw them')
        Hand().marker('/stage:axis:0')

    def test_rviz_gets_displays_of_topics_that_come_later_and_keeps_what_was_changed_in_it(self):
        wait_until(SHOWN.exists, 'RViz to be opened', 60.0)
        shown = yaml.safe_load(SHOWN.read_text())
        shown['Visualization Manager']['Displays'][0]['Color'] = '1; 2; 3'
        SHOWN.write_text(yaml.safe_dump(shown))
        pose = PoseStamped()
        pose.header.frame_id, pose.pose.position.x = 'world', rosslt.location(1.5, name='late')
        late = rosslt.Publisher('/late', PoseStamped, queue_size=1, latch=True)
        late.publish(pose)
        wait_until(lambda: displays().get('/late') == 'rviz/Pose', 'the display of the new topic')
        self.assertEqual(manager()['Displays'][0]['Color'], '1; 2; 3')
        late.unregister()
        wait_until(lambda: '/late' not in displays(), 'the display of what is gone to go')
        self.assertEqual(manager()['Displays'][0]['Color'], '1; 2; 3')

    def test_the_master_knows_a_topic_again_by_its_own_type_if_a_tool_of_rviz_has_said_another(self):
        goal = rospy.Publisher('/goal', Point, queue_size=1)
        tool = rosgraph.Master('/tool')  # as RViz, before it reads its configuration
        tool.registerPublisher('/goal', 'geometry_msgs/PoseStamped', rospy.get_node_uri())
        self.assertEqual(dict(tool.getTopicTypes())['/goal'], 'geometry_msgs/PoseStamped')
        tool.unregisterPublisher('/goal', rospy.get_node_uri())
        wait_until(lambda: dict(tool.getTopicTypes())['/goal'] == 'geometry_msgs/Point', 'the type to be corrected')
        goal.unregister()

    def test_a_robot_is_shown_where_a_node_says_how_it_stands(self):
        rospy.set_param('/robot_description', ROBOT)
        wait_until(SHOWN.exists, 'RViz to be opened', 60.0)
        wait_until(lambda: '/stage' in displays(), 'the display of the stage')
        rospy.sleep(3.0)
        self.assertNotIn('Robot', displays())
        states = rospy.Publisher('/joint_states', JointState, queue_size=1, latch=True)
        states.publish(name=['hip'], position=[0.5])
        wait_until(lambda: displays().get('Robot') == 'rviz/RobotModel', 'the display of the robot')
        states.unregister()
        wait_until(lambda: 'Robot' not in displays(), 'the display of the robot to go')


if __name__ == '__main__':
    rosslt.init_node('check_rviz_launch')
    rostest.rosrun('rosslt', 'rviz_launch', RvizLaunch)
