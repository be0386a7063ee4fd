#!/usr/bin/env python3
"""What talker_listener.launch promises."""

import unittest

import rospy
import rostest
from rosslt.msg import Int32Tracked

import rosslt
from support.hand import wait_until

COUNTER = '/talker/rosslt/counter'


class TalkerListener(unittest.TestCase):
    def test_the_source_in_the_talker_climbs(self):
        heard = []
        rosslt.Subscriber('chatter', Int32Tracked, lambda message: heard.append(message.data))
        wait_until(lambda: len(heard) > 1 and heard[-1] >= heard[0] + 6, 'the numbers to climb by 6')
        self.assertEqual({number % 2 for number in heard}, {0}, 'the talker publishes twice its counter')
        self.assertEqual({source.node for source in rosslt.sources(heard[-1])}, {'/talker'})
        low = heard[-1] // 2
        self.assertGreaterEqual(rospy.get_param(COUNTER), low)


if __name__ == '__main__':
    rosslt.init_node('check_talker_listener')
    rostest.rosrun('rosslt', 'talker_listener', TalkerListener)
