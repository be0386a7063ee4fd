"""The interactive marker server: poses that it is told are sent, and it ends quietly with its node."""

import json
import signal

import pytest

from support.processes import Node

ENDING = """
    from rosslt.markers.rviz.server import Server

    server = Server('handles')
    server.keepAlive(None)
    rospy.signal_shutdown('the test ends it')
    server.keepAlive(None)
    print('quiet', flush=True)
    """


@pytest.mark.rostest
def test_a_timer_that_finds_the_topic_closed_raises_nothing(master):
    with Node('ending', ENDING, wait_for=None) as node:
        assert node.read_line() == 'quiet', node.logged()


MOVING = """
    from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerInit, InteractiveMarkerUpdate
    from rosslt.markers.rviz.server import Server

    updates = []
    subscriber = rospy.Subscriber('handles/update', InteractiveMarkerUpdate, updates.append)
    server = Server('handles')
    while not server.update_pub.get_num_connections():
        time.sleep(0.01)

    def places(them):
        return [[one.name, one.pose.position.x] for one in them]

    def sent():
        of_changes = [update for update in updates if update.type == InteractiveMarkerUpdate.UPDATE]
        return [[update.seq_num, places(update.markers), places(update.poses)] for update in of_changes]

    def pose(x):
        return Pose(position=Point(x, 0.0, 0.0))

    server.insert(InteractiveMarker(name='one'), print)
    server.insert(InteractiveMarker(name='other'), print)
    server.applyChanges()
    server.setPose('one', pose(1.0))
    server.setPose('one', pose(2.0))
    server.setPose('unknown', pose(2.0))
    server.applyChanges()
    server.setPose('one', pose(3.0))
    server.setPose('other', pose(3.0))
    server.insert(InteractiveMarker(name='one', pose=pose(4.0)), print)
    server.erase('other')
    server.applyChanges()
    server.applyChanges()
    full = rospy.wait_for_message('handles/update_full', InteractiveMarkerInit)
    while len(sent()) < 3:
        time.sleep(0.01)
    print(json.dumps([sent(), full.seq_num, places(full.markers)]), flush=True)
    """


@pytest.mark.rostest
def test_poses_are_sent_and_those_who_come_later_get_them(master):
    with Node('moving', MOVING, wait_for=None) as node:
        updates, number, present = json.loads(node.read_line())
    assert updates == [[1, [['one', 0.0], ['other', 0.0]], []], [2, [], [['one', 2.0]]], [3, [['one', 4.0]], []]]
    assert (number, present) == (3, [['one', 4.0]])


NUMBERED = """
    import sys, threading
    from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerUpdate
    from rosslt.markers.rviz.server import Server

    class Sent(list):
        def publish(self, update):
            time.sleep(0)  # the other thread may go on here, as while a message is written to a socket
            self.append([update.type == InteractiveMarkerUpdate.KEEP_ALIVE, update.seq_num])

    server = Server('handles')
    server.insert(InteractiveMarker(name='one'), print)
    server.applyChanges()
    server.update_pub, is_over = Sent([[False, server.seq_num]]), threading.Event()

    def keep_alive():
        while not is_over.is_set():
            server.keepAlive(None)

    sys.setswitchinterval(1e-6)
    thread = threading.Thread(target=keep_alive)
    thread.start()
    for index in range(500):
        server.setPose('one', Pose(position=Point(index, 0.0, 0.0)))
        server.applyChanges()
    is_over.set()
    thread.join()
    print(json.dumps(server.update_pub), flush=True)
    """


@pytest.mark.rostest
def test_numbers_of_updates_and_keep_alives_are_in_order(master):
    """RViz drops all markers for more than a second if one is not."""
    with Node('numbered', NUMBERED, wait_for=None) as node:
        sent = json.loads(node.read_line())
    pairs = zip(sent, sent[1:])
    assert [(last, one) for (_, last), (is_alive, one) in pairs if one != last + (not is_alive)] == []


INTERRUPTED = """
    from visualization_msgs.msg import InteractiveMarker
    from rosslt.markers.rviz.server import Server

    server = Server('handles')
    server.insert(InteractiveMarker(name='one'), print)
    server.applyChanges()

    def clear():
        server.clear()
        server.applyChanges()
        print(len(server.marker_contexts), flush=True)

    rospy.on_shutdown(clear)
    with server.mutex:
        os.kill(os.getpid(), {})
        while not rospy.is_shutdown():
            time.sleep(0.01)
    server.insert(InteractiveMarker(name='other'), print)
    server.applyChanges()
    print('quiet', flush=True)
    """


@pytest.mark.rostest
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_in_the_middle_of_a_change_ends_the_node(master, number):
    with Node('interrupted', INTERRUPTED.format(int(number)), wait_for=None) as node:
        assert [node.read_line(), node.read_line()] == ['0', 'quiet'], node.logged()
