"""Two masters, and a program that registers the nodes of each at the other, as multimaster_fkie does."""

import contextlib
import os
import threading

import pytest
import rosgraph

from support.processes import Master, Node, wait_until
from support.shell import rosslt

pytestmark = [pytest.mark.rostest, pytest.mark.slow]

TALKER = """
    publisher = rosslt.Publisher('place', Float64, queue_size=1)
    while not rospy.is_shutdown():
        publisher.publish(2 * rosslt.location(1.5, name='x'))
        time.sleep(0.05)
    """

LISTENER = """
    publisher = rosslt.Publisher('seen', Float64, queue_size=1)
    def seen(place):
        publisher.publish(place.data + rosslt.location(0.5, name='shift'))
    rosslt.Subscriber('place', Float64, seen)
    rospy.spin()
    """


class Relay:
    """Registers at each of two masters, again and again, the publishers, subscribers and services of the other."""

    def __init__(self, first, second):
        self._masters = first, second
        self._known = set()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._work)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._end.set()
        self._thread.join()

    def _work(self):
        while not self._end.wait(0.2):
            for here, there in (self._masters, self._masters[::-1]):
                # a node that ends is known at one moment and not at the next
                with contextlib.suppress(rosgraph.MasterError):
                    self._copy(rosgraph.Master('/relay', here.uri), there.uri)

    def _copy(self, here, uri):
        publishers, subscribers, services = here.getSystemState()
        types = dict(here.getTopicTypes())
        for kind, entries in (('Publisher', publishers), ('Subscriber', subscribers)):
            for topic, nodes in entries:
                for node in nodes:
                    if not topic.startswith('/rosout') and node not in ('/rosout', '/relay'):
                        address = here.lookupNode(node)
                        there = rosgraph.Master(node, uri)
                        self._once(getattr(there, 'register' + kind), uri, topic, types.get(topic, '*'), address)
        for service, nodes in services:
            for node in nodes:
                there = rosgraph.Master(node, uri)
                self._once(there.registerService, uri, service, here.lookupService(service), here.lookupNode(node))

    def _once(self, register, uri, name, *rest):
        """What a master has been told is copied back by nobody: it is known at both."""
        key = register.__name__, name, rest[-1]
        if key not in self._known:
            self._known.add(key)
            register(name, *rest)


@pytest.fixture
def masters(master):
    other = Master()
    yield master, other
    other.kill()


def test_a_field_that_is_seen_at_one_master_changes_a_location_of_a_node_at_the_other(masters):
    here, there = masters
    with Node('talker', TALKER), Relay(here, there):
        os.environ['ROS_MASTER_URI'] = there.uri  # which the fixture sets back
        with Node('listener', LISTENER, ROS_MASTER_URI=there.uri):
            at_there = {'ROS_MASTER_URI': there.uri}
            wait_until(lambda: '/talker/x' in rosslt('list', **at_there).stdout, 'the other node is listed')
            forced = wait_until(
                lambda: rosslt('force', '/seen/data', '8.5', **at_there).stdout, 'a message, and that it is changed'
            )
            assert forced.split('\t')[:3] == ['/talker/x', '1.5', '4.0']
            assert rosslt('get', '/talker/x', ROS_MASTER_URI=here.uri).stdout == '4.0\n'
            assert rosslt('set', '/listener/shift', '1.5', ROS_MASTER_URI=here.uri).returncode == 0
            assert rosslt('get', '/listener/shift', **at_there).stdout == '1.5\n'
            # parameters stay at the node's own master
            assert rosgraph.Master('/test', here.uri).getParam('/talker/rosslt/x') == 4.0
            assert not rosgraph.Master('/test', there.uri).hasParam('/talker/rosslt/x')
