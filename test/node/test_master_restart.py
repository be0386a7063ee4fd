"""What holds when the ROS master is killed and started again: it has forgotten everything."""

import json
import os
import signal

import pytest
import rosgraph

from support.processes import Node, wait_until

OWNER = """
    publisher = rosslt.Publisher('value', Float64, queue_size=1)
    rosslt.Subscriber('input', Float64, lambda message: print('heard', message.data, flush=True))
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        publisher.publish(2 * rosslt.location(1.5, name='half'))
        rate.sleep()
    """

ASKER = """
    value = rosslt.wait_for_message('value', Float64, timeout=60.0).data
    publisher = rosslt.Publisher('input', Float64, queue_size=1, latch=True)
    publisher.publish(value)
    (change,) = rosslt.force_value(value, {target}, timeout=5.0).values()
    print(json.dumps(change), flush=True)
    rospy.spin()
    """


@pytest.mark.rostest
def test_a_node_is_reached_and_heard_again_after_the_master_was_killed_and_restarted(master):
    with Node('owner', OWNER) as owner:
        with Node('before', ASKER.format(target=5.0)) as asker:
            assert owner.read_line() == 'heard 3.0'
            assert asker.read_line() == '[1.5, 2.5]'
        master.kill()
        assert owner.process.poll() is None
        master.start()
        wait_until(lambda: owner.offers('rosslt/change_sources'), 'the owner is registered again')
        with Node('after', ASKER.format(target=8.0)) as asker:
            assert owner.read_line() == 'heard 5.0'
            assert asker.read_line() == '[2.5, 4.0]'
        parameter = wait_until(lambda: rosgraph.Master('/test').getParam('/owner/rosslt/half'), 'it is mirrored')
        assert parameter == 4.0
        assert owner.stop(signal.SIGINT) == 0


@pytest.mark.rostest
def test_a_node_without_a_master_keeps_its_values_and_ends_when_told_to(master):
    code = """
        values = [rosslt.location(1.0, name='kept')]
        print('ready', flush=True)
        sys.stdin.readline()
        try:
            rosslt.force_value(rosslt.track(1.0, rosslt.Source('/nobody', 1)), 2.0)
        except rosslt.SourceUnreachable as error:
            print(error, flush=True)
        print(rosslt.force_value(values[0], 3.0), rosslt.location(0.0, name='later'), flush=True)
        """
    with Node('alone', code) as node:
        assert node.read_line() == 'ready'
        master.kill()
        os.write(node.process.stdin.fileno(), b'\n')
        assert node.read_line().startswith('cannot reach /nobody: ')
        line = node.read_line()
        assert 'Change(old=1.0, new=3.0)' in line
        assert line.endswith('0.0')
        assert node.process.wait(60) == 0


READER = """
    rosslt.get_param('~unset', 0.5)
    rosslt.force_value([rosslt.get_param('~speed', 1.0), rosslt.get_param('/fleet')['limit']], [5.0, 3.0])
    print('changed', flush=True)
    while sys.stdin.readline():
        print(json.dumps([rosslt.get_param('~speed', 1.0), rosslt.get_param('/fleet')]), flush=True)
    """


@pytest.mark.rostest
def test_a_new_master_is_told_the_parameters_that_a_node_has_read_and_the_node_what_it_says_otherwise(master):
    told = rosgraph.Master('/test')
    told.setParam('/fleet', {'limit': 2.0, 'size': 4})
    with Node('reader', READER) as reader:
        assert reader.read_line() == 'changed'
        master.kill()
        master.start()
        told.setParam('/fleet/size', 6)
        wait_until(
            lambda: told.hasParam('/reader/speed') and told.hasParam('/fleet/limit'), 'the parameters are there again'
        )
        assert (told.getParam('/reader/speed'), told.getParam('/fleet')) == (5.0, {'limit': 3.0, 'size': 6})
        assert not told.hasParam('/reader/unset')
        wait_until(lambda: asked(reader) == [5.0, {'limit': 3.0, 'size': 6}], 'the node says the same')
        told.setParam('/fleet/limit', 2.5)
        wait_until(lambda: asked(reader)[1]['limit'] == 2.5, 'it is told of changes')


def asked(reader):
    """What the node reads now."""
    reader.process.stdin.write('\n')
    reader.process.stdin.flush()
    return json.loads(reader.read_line())


RELAY = """
    rospy.init_node('relay')
    publisher = rosslt.Publisher('out', Float64, queue_size=1)
    rosslt.Subscriber('in', Float64, publisher.publish)
    rospy.spin()
    """


@pytest.mark.rostest
def test_a_node_of_rospy_with_tracked_topics_is_registered_again_too(master):
    def is_registered():
        publishers, subscribers, _ = rosgraph.Master('/test').getSystemState()
        return ['/out', ['/relay']] in publishers and ['/in', ['/relay']] in subscribers

    with Node('relay', RELAY, wait_for=None, calls_init_node=True):
        wait_until(is_registered, 'it is registered')
        master.kill()
        master.start()
        wait_until(is_registered, 'it is registered again')
