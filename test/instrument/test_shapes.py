"""An array that would get another shape by a change stays as it is until the shape is the same again."""

import pytest
from std_msgs.msg import Float32MultiArray

from support.shell import rosslt
from support.unmodified import Listener, Unmodified

pytestmark = pytest.mark.rostest

SHAPES = """\
import numpy as np
import rospy
from std_msgs.msg import Float32MultiArray

N = 4
STEP = 0.5
SIZE = 3.0
LO, HI = 1.0, 4.0
xs = np.arange(N) * STEP
ends = np.linspace(LO, HI, N)
last = xs[-1]
M = 2
others = np.arange(*[M]) * SIZE
total = STEP * N
rospy.init_node('shapes')
pub = rospy.Publisher('~all', Float32MultiArray, queue_size=1)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    pub.publish(data=[*xs, *ends, last, total, STEP, *others, M])
    rate.sleep()
"""

OF_COUNT = (
    'numpy.arange at shapes.py:9 and numpy.linspace at shapes.py:10 take it at the next start, '
    'or when those lines run again'
)
OF_OTHERS = 'an array whose length would change takes it at the next start, or when its length is as before'


def said(taken):
    return f'rosslt set: {taken}; what else uses it follows\n' if taken else ''


def test_an_array_of_another_length_waits_for_its_own(master, tmp_path):
    xs, ends, others = [0.0, 0.5, 1.0, 1.5], [1.0, 2.0, 3.0, 4.0], [0.0, 3.0, 2.0]
    with Unmodified(tmp_path, 'shapes', SHAPES), Listener('shapes/all', Float32MultiArray) as heard:

        def becomes(*numbers):
            heard.comes(lambda message: list(message.data) == list(numbers))

        becomes(*xs, *ends, 1.5, 2.0, 0.5, *others)
        assert rosslt('set', '/shapes/N', '2').stderr == said(OF_COUNT)
        becomes(*xs, *ends, 1.5, 1.0, 0.5, *others)
        assert rosslt('set', '/shapes/STEP', '2.0').stderr == said(OF_OTHERS)
        becomes(*xs, *ends, 1.5, 4.0, 2.0, *others)
        assert rosslt('set', '/shapes/N', '1').stderr == said(OF_COUNT)
        becomes(*xs, *ends, 1.5, 2.0, 2.0, *others)
        for _ in range(2):
            assert rosslt('undo', '/shapes').returncode == 0
        becomes(*xs, *ends, 1.5, 1.0, 0.5, *others)
        assert rosslt('set', '/shapes/HI', '7.0').stderr == said(OF_OTHERS)
        assert rosslt('set', '/shapes/N', '4').stderr == said(OF_COUNT)
        becomes(*xs, 1.0, 3.0, 5.0, 7.0, 1.5, 2.0, 0.5, *others)
        assert rosslt('set', '/shapes/STEP', '1.0').stderr == ''
        becomes(0.0, 1.0, 2.0, 3.0, 1.0, 3.0, 5.0, 7.0, 3.0, 4.0, 1.0, *others)
        assert rosslt('reset', '/shapes').returncode == 0
        becomes(*xs, *ends, 1.5, 2.0, 0.5, *others)


def test_a_count_that_no_line_shows_is_told_of_once_it_matters(master, tmp_path):
    with Unmodified(tmp_path, 'shapes', SHAPES), Listener('shapes/all', Float32MultiArray) as heard:
        heard.next()
        assert rosslt('set', '/shapes/M', '5').stderr == said(OF_OTHERS)
        assert list(heard.comes(lambda message: message.data[-1] == 5.0).data[-3:]) == [0.0, 3.0, 5.0]
        assert rosslt('set', '/shapes/M', '2').stderr == ''
        assert rosslt('set', '/shapes/SIZE', '4.0').stderr == ''
        heard.comes(lambda message: list(message.data[-3:]) == [0.0, 4.0, 2.0])
