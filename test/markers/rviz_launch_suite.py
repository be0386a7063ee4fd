#!/usr/bin/env python3
"""What rviz.launch promises: RViz is opened with the topics that can be dragged, and there are handles on them."""

import unittest
from pathlib import Path

import rospy
import rostest
import yaml

import rosslt
from support.hand import Hand, wait_until

SHOWN = Path(rospy.myargv()[1])


class RvizLaunch(unittest.TestCase):
    def test_rviz_opens_with_the_topics_that_can_be_dragged(self):
        wait_until(SHOWN.exists, 'RViz to be opened', 60.0)
        manager = yaml.safe_load(SHOWN.read_text())['Visualization Manager']
        self.assertEqual(manager['Global Options']['Fixed Frame'], 'world')
        shown = {display['Name']: display['Class'] for display in manager['Displays']}
        self.assertEqual(shown['/stage'], 'rviz/MarkerArray')
        self.assertNotIn('/blinking', shown, 'RViz knows no tracked types: the handles draw them')
        Hand().marker('/stage:axis:0')


if __name__ == '__main__':
    rosslt.init_node('check_rviz_launch')
    rostest.rosrun('rosslt', 'rviz_launch', RvizLaunch)
