"""`rosslt set` says what became of a change once the callbacks of the node were called with it."""

import pytest

from support.processes import Node, wait_until
from support.shell import failure, rosslt

pytestmark = pytest.mark.rostest

SCALING = """
    import message_filters

    def scale(message):
        publisher.publish(message.data / rosslt.location(2.0, name='width') + rosslt.location(1.0, name='offset'))

    publisher = rosslt.Publisher('scaled', Float64, queue_size=1)
    reader = rosslt.Subscriber('unscaled', Float64)
    filtered = message_filters.Subscriber('unscaled', Float64)
    filtered.registerCallback(scale)
    unscaled = rosslt.Publisher('unscaled', Float64, queue_size=1)
    while not rospy.is_shutdown():
        unscaled.publish(6.0)
        rospy.sleep(0.02)
    """


def test_a_number_that_makes_a_callback_raise_is_refused(master):
    with Node('scaling', SCALING):
        wait_until(lambda: '/scaling/offset' in rosslt('list', '/scaling').stdout, 'it scales')
        told = failure('set', '/scaling/width', '0')
        assert told.startswith('rosslt set: /scaling raises ZeroDivisionError: float division by zero (scaling.py:')
        assert told.endswith('; taken back')
        assert rosslt('get', '/scaling/width').stdout == '2.0\n'
        assert rosslt('set', '/scaling/width', '3').returncode == 0
        assert rosslt('set', '/scaling/offset', '0').returncode == 0
        assert rosslt('get', '/scaling/width').stdout == '3.0\n'
