"""A subscriber that hears of its publisher several times in one moment connects to it once, and hears it, with its
provenance."""

import json

import pytest

from support.processes import Node

pytestmark = pytest.mark.rostest

TOPICS = 30

#: Publishes on each topic once, latched, and prints how many connections were made to each whenever it is asked.
SPEAKER = f"""
    class Counting(rospy.SubscribeListener):
        def __init__(self):
            self.count = 0

        def peer_subscribe(self, *_):
            self.count += 1

    counting = [Counting() for _ in range({TOPICS})]
    publishers = [
        rospy.Publisher(f'topic{{number}}', Float64, one, latch=True, queue_size=1)
        for number, one in enumerate(counting)
    ]
    for publisher in publishers:
        publisher.publish(1.5)
    for _ in sys.stdin:
        print(json.dumps([one.count for one in counting]), flush=True)
    """

#: Subscribes to each topic while it is told of the publisher, as the master tells of it, by four at once.
LISTENER = f"""
    import threading, xmlrpc.client
    import rosgraph
    speaker = rosgraph.Master(rospy.get_name()).lookupNode('/speaker')
    heard = [threading.Event() for _ in range({TOPICS})]
    for number, one in enumerate(heard):
        def tell(topic):
            for _ in range(5):
                xmlrpc.client.ServerProxy(rospy.get_node_uri()).publisherUpdate('/master', topic, [speaker])
        threads = [threading.Thread(target=tell, args=(f'/topic{{number}}',)) for _ in range(4)]
        for thread in threads:
            thread.start()
        rosslt.Subscriber(f'topic{{number}}', Float64, lambda _, one=one: one.set())
        for thread in threads:
            thread.join()
    print(json.dumps([one.wait(60) for one in heard]), flush=True)
    rospy.spin()
    """


def test_each_subscriber_connects_once_and_hears(master):
    with Node('speaker', SPEAKER) as speaker, Node('listener', LISTENER) as listener:
        assert json.loads(listener.read_line()) == [True] * TOPICS
        speaker.process.stdin.write('\n')
        speaker.process.stdin.flush()
        assert json.loads(speaker.read_line()) == [1] * TOPICS


#: Publishes what it was asked for, with a source.
TRACKED_SPEAKER = """
    publisher = rosslt.Publisher('topic', Float64, queue_size=1)
    while not rospy.is_shutdown():
        publisher.publish(rosslt.location(1.5, name='x'))
        time.sleep(0.05)
    """

#: Subscribes as rospy does, and with provenance while that is connecting: the connection is made, but not known yet.
LATE_LISTENER = """
    import threading
    from rospy.impl.tcpros_base import TCPROSTransport
    plain, tracked, heard = threading.Event(), threading.Event(), threading.Event()
    set_endpoint_id = TCPROSTransport.set_endpoint_id
    def set_endpoint_id_late(transport, endpoint_id):
        set_endpoint_id(transport, endpoint_id)
        if transport.name == '/topic':
            plain.set()
            tracked.wait(60)
    TCPROSTransport.set_endpoint_id = set_endpoint_id_late
    found = []
    def hear(message):
        found.append(message.data)
        heard.set()
    rospy.Subscriber('topic', Float64, lambda _: None)
    plain.wait(60)
    rosslt.Subscriber('topic', Float64, hear)
    tracked.set()
    heard.wait(60)
    print(json.dumps([source.node for source in rosslt.sources(found[0])]), flush=True)
    rospy.spin()
    """


def test_a_connection_that_was_being_made_by_plain_rospy_is_read_with_provenance(master):
    with Node('speaker', TRACKED_SPEAKER), Node('listener', LATE_LISTENER) as listener:
        assert json.loads(listener.read_line()) == ['/speaker']
