#!/usr/bin/env python3
"""rviz.launch: RViz opens with the topics that can be dragged, gets those that come later, and has handles."""

import unittest
from pathlib import Path

import rospy
import rostest
import yaml
from geometry_msgs.msg import PoseStamped

import rosslt
from support.hand import Hand, wait_until

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


if __name__ == '__main__':
    rosslt.init_node('check_rviz_launch')
    rostest.rosrun('rosslt', 'rviz_launch', RvizLaunch)
