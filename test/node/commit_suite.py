#!/usr/bin/env python3
"""What holds for changes of several nodes: all or none, whoever refuses, dies, hangs or comes too late."""

import json
import signal
import threading
import unittest
from concurrent.futures import ThreadPoolExecutor

import rospy
from rosslt.msg import AppliedChange
from rosslt.srv import ChangeSources, GetHistory, ListLocations, LockLocations

import rosslt
from rosslt import node as rosslt_node
from support.processes import Node, wait_until, wait_until_hears

OWNER = """
    rosslt.location(2.0, name='gain', minimum=0.0, maximum=10.0)
    rosslt.location(1.0, name='offset')
    rospy.spin()
    """

#: Its location has a setter of the test's making, which is told the value on a line of its standard input.
SETTER = """
    held = [1.0]
    def put(value):
        print('changing', flush=True)
        order = sys.stdin.readline().strip()
        if order == 'refuse':
            raise ValueError('the motor is hot')
        if order == 'die':
            os.kill(os.getpid(), 9)
        held[0] = value
    rosslt.location(getter=lambda: held[0], setter=put, name='slow')
    rospy.spin()
    """


def location_id(node, name):
    list_locations = rospy.ServiceProxy(node + '/rosslt/list_locations', ListLocations)

    def listed():
        try:
            return {one.name: one.id for one in list_locations().locations}.get(name)
        except rospy.ServiceException:  # it was just started
            return None

    return wait_until(listed, f'{node} has {name}')


def tracked(node, name, value=1.0):
    return rosslt.track(value, rosslt.Source(node, location_id(node, name)))


def present(node, name):
    return rosslt.untracked(rosslt.reevaluate(tracked(node, name), timeout=5.0))


def change_sources(node):
    return rospy.ServiceProxy(node + '/rosslt/change_sources', ChangeSources)


def source(value):
    return rosslt.sources(value)[0]


class Both:
    """A request of two nodes, by their services: for what a requester does that dies or is slow."""

    def __init__(self, transaction_id, *pairs, lease=5.0):
        self.transaction_id = transaction_id
        self.nodes = [node for node, _, _ in pairs]
        self.lease = lease
        for node, name, value in pairs:
            answer = self.prepare(node, name, value)
            assert answer.state == 'prepared', answer

    def prepare(self, node, name, value):
        return change_sources(node)(
            request_id=self.transaction_id,
            requester='/hand',
            location_ids=[location_id(node, name)],
            values=[str(value)],
            phase='prepare',
            transaction_id=self.transaction_id,
            nodes=self.nodes,
            lease=self.lease,
        )

    def decide(self, node, phase):
        return change_sources(node)(transaction_id=self.transaction_id, phase=phase)


class Commits(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.nodes = [Node('left', OWNER), Node('right', OWNER)]

    @classmethod
    def tearDownClass(cls):
        for node in cls.nodes:
            node.stop()

    def setUp(self):
        for node in ('/left', '/right'):
            rosslt.force_value(tracked(node, 'offset'), 1.0, timeout=5.0)

    def offsets(self):
        return [present('/left', 'offset'), present('/right', 'offset')]

    def pair(self):
        return [tracked('/left', 'offset'), tracked('/right', 'offset')]

    def test_all_nodes_change_and_it_is_one_request(self):
        changed = rosslt.force_value(self.pair(), [3.0, 4.0], request_id='one')
        self.assertEqual(
            {(one.node, change) for one, change in changed.items()}, {('/left', (1, 3)), ('/right', (1, 4))}
        )
        self.assertEqual(self.offsets(), [3.0, 4.0])
        for node in ('/left', '/right'):
            (entry,) = rospy.ServiceProxy(node + '/rosslt/get_history', GetHistory)('one', 0).changes
            self.assertEqual((entry.change.requester, entry.undone), ('/commit', False))

    def test_where_one_node_refuses_none_changes_and_nothing_is_told(self):
        told = []
        subscriber = rospy.Subscriber('/left/rosslt/changes', AppliedChange, told.append)
        wait_until_hears(subscriber, '/left')
        unknown = rosslt.track(1.0, rosslt.Source('/right', 12345))
        with self.assertRaisesRegex(rosslt.ChangeRejected, '/right has no location 12345; nothing has changed') as one:
            rosslt.force_value([tracked('/left', 'offset'), unknown], [3.0, 4.0])
        self.assertEqual((one.exception.changed, one.exception.taken_back), ({}, {}))
        self.assertEqual(list(one.exception.reasons), [source(unknown)])
        rosslt.force_value(tracked('/left', 'offset'), 7.0)
        wait_until(lambda: told, 'the next change is told')
        subscriber.unregister()
        self.assertEqual([change.new_value for change in told], ['7.0'])

    def test_where_one_node_is_gone_none_changes(self):
        nobody = rosslt.track(1.0, rosslt.Source('/nobody', 1))
        with self.assertRaisesRegex(rosslt.SourceUnreachable, 'cannot reach /nobody.*; nothing has changed') as one:
            rosslt.force_value([tracked('/left', 'offset'), nobody], [3.0, 4.0])
        self.assertEqual((one.exception.nodes, one.exception.changed), (['/nobody'], {}))
        self.assertEqual(present('/left', 'offset'), 1.0)

    def test_where_one_node_hangs_none_changes_then_or_later(self):
        with Node('zhanging', OWNER) as node:
            pair = [tracked('/left', 'offset'), tracked('/zhanging', 'offset')]
            node.process.send_signal(signal.SIGSTOP)
            with self.assertRaisesRegex(rosslt.SourceUnreachable, '/zhanging: no answer within the timeout; nothing'):
                rosslt.force_value(pair, [3.0, 4.0], timeout=0.5)
            rosslt.force_value(tracked('/left', 'offset'), 8.0)  # it is free again
            node.process.send_signal(signal.SIGCONT)
            self.assertEqual((present('/left', 'offset'), present('/zhanging', 'offset')), (8.0, 1.0))

    def test_where_a_setter_refuses_the_others_are_taken_back_and_the_error_says_so(self):
        with Node('setter', SETTER) as node:
            pair = [tracked('/left', 'offset'), tracked('/setter', 'slow')]
            node.process.stdin.write('refuse\n')
            node.process.stdin.flush()
            with self.assertRaisesRegex(
                rosslt.ChangeRejected, '/setter: ValueError: the motor is hot; taken back: /left/offset$'
            ) as one:
                rosslt.force_value(pair, [3.0, 4.0], timeout=20.0, request_id='hot')
            self.assertEqual(one.exception.changed, {})
            self.assertEqual(one.exception.taken_back, {source(pair[0]): (3.0, 1.0)})
            self.assertEqual((present('/left', 'offset'), present('/setter', 'slow')), (1.0, 1.0))
            (entry,) = rospy.ServiceProxy('/left/rosslt/get_history', GetHistory)('hot', 0).changes
            self.assertTrue(entry.undone)

    def test_a_step_of_a_drag_that_is_refused_leaves_the_drag_to_be_taken_back(self):
        with Node('stepped', SETTER) as node:
            for order, target in (('go', 2.0), ('refuse', 3.0)):
                node.process.stdin.write(order + '\n')
                node.process.stdin.flush()
                pair = [tracked('/left', 'offset', target - 1), tracked('/stepped', 'slow', target - 1)]
                try:
                    rosslt.force_value(pair, [target, target], timeout=20.0, request_id='drag')
                except rosslt.ChangeRejected:
                    self.assertEqual(order, 'refuse')
            self.assertEqual((present('/left', 'offset'), present('/stepped', 'slow')), (2.0, 2.0))
            node.process.stdin.write('go\n')
            node.process.stdin.flush()
            undone = rosslt_node.undo_request('drag', ['/left', '/stepped'], '/hand', 5.0)
            self.assertEqual(undone.reasons, {})
            self.assertEqual((present('/left', 'offset'), present('/stepped', 'slow')), (1.0, 1.0))

    def test_where_one_node_dies_while_it_changes_the_others_are_taken_back(self):
        with Node('dying', SETTER) as node:
            pair = [tracked('/left', 'offset'), tracked('/dying', 'slow')]
            node.process.stdin.write('die\n')
            node.process.stdin.flush()
            with self.assertRaisesRegex(
                rosslt.SourceUnreachable, 'taken back: /left/offset; not known: whether /dying has changed its part'
            ):
                rosslt.force_value(pair, [3.0, 4.0])
            self.assertEqual(present('/left', 'offset'), 1.0)

    def test_what_another_has_changed_since_stays_and_the_error_says_so(self):
        with Node('late', SETTER) as node:
            pair = [tracked('/left', 'offset'), tracked('/late', 'slow')]
            caught = []

            def force():
                try:
                    rosslt.force_value(pair, [3.0, 4.0], timeout=10.0)
                except rosslt.ChangeRejected as error:
                    caught.append(error)

            thread = threading.Thread(target=force)
            thread.start()
            self.assertEqual(node.read_line(), 'changing')
            wait_until(lambda: present('/left', 'offset') == 3.0, 'the first node has applied its part')
            rosslt.force_value(tracked('/left', 'offset', 3.0), 9.0)
            node.process.stdin.write('refuse\n')
            node.process.stdin.flush()
            thread.join(10)
            self.assertRegex(str(caught[0]), r'not taken back: /left/offset = 3.0 \(offset has been changed since\)')
            self.assertEqual(list(caught[0].changed), [source(pair[0])])
            self.assertEqual(present('/left', 'offset'), 9.0)

    def test_a_requester_that_dies_before_anything_is_applied_leaves_nothing(self):
        request = Both('dead', ('/left', 'offset', 3.0), ('/right', 'offset', 4.0), lease=0.3)
        wait_until(lambda: request.decide('/left', 'state').state == 'aborted', 'it ends by itself')
        wait_until(lambda: request.decide('/right', 'state').state == 'aborted', 'it ends by itself')
        self.assertEqual(self.offsets(), [1.0, 1.0])
        rosslt.force_value(self.pair(), [5.0, 6.0])
        self.assertEqual(self.offsets(), [5.0, 6.0])

    def test_what_a_requester_that_dies_has_begun_is_finished_by_the_nodes(self):
        request = Both('half', ('/left', 'offset', 3.0), ('/right', 'offset', 4.0), lease=0.3)
        self.assertEqual(request.decide('/left', 'commit').state, 'applied')
        wait_until(lambda: self.offsets() == [3.0, 4.0], 'the other node follows')
        undone = rosslt_node.undo_request('half', ['/left', '/right'], '/hand', 5.0)
        self.assertEqual((undone.reasons, self.offsets()), ({}, [1.0, 1.0]))

    def test_what_a_requester_that_dies_has_begun_is_not_finished_where_it_was_taken_back_meanwhile(self):
        request = Both('gone', ('/left', 'offset', 3.0), ('/right', 'offset', 4.0), lease=0.3)
        self.assertEqual(request.decide('/left', 'commit').state, 'applied')
        undone = rosslt_node.undo_request('gone', ['/left'], '/hand', 5.0)
        self.assertEqual(undone.reasons, {})
        wait_until(lambda: request.decide('/right', 'state').state != 'prepared', 'the other node has asked')
        self.assertEqual(request.decide('/right', 'state').state, 'aborted')
        self.assertEqual(self.offsets(), [1.0, 1.0])

    def test_what_waits_for_a_reserved_location_is_refused_where_it_is_locked_meanwhile(self):
        """Whoever locks is told that nothing changes any more."""
        lock = rospy.ServiceProxy('/left/rosslt/lock_locations', LockLocations)
        ids = [location_id('/left', 'offset'), location_id('/left', 'gain')]
        wanted = {'requester': '/hand', 'location_ids': ids, 'values': ['7.0', '7.0']}
        prepared = {'phase': 'prepare', 'transaction_id': 'waiting', 'request_id': 'waiting', 'lease': 5.0}
        change = change_sources('/left')
        calls = {
            'at once': lambda: change(**wanted),
            'prepared': lambda: change(nodes=['/left'], **wanted, **prepared),
        }
        self.addCleanup(lock, 'unlock', ids[:1], 'ada', '')
        for is_done, call in calls.items():
            request = Both('before ' + is_done, ('/left', 'gain', 3.0))
            answers = []
            waiting = threading.Thread(target=lambda call=call, answers=answers: answers.append(call()))
            waiting.start()
            waiting.join(0.1)  # it waits by then, or is refused at once when it comes
            lock('lock', ids[:1], 'ada', 'the robot is running')
            request.decide('/left', 'abort')
            waiting.join()
            self.assertEqual(answers[0].state, 'refused', answers[0])
            self.assertEqual(present('/left', 'offset'), 1.0)
            lock('unlock', ids[:1], 'ada', '')

    def test_a_decision_that_comes_too_late_changes_nothing(self):
        request = Both('late', ('/left', 'offset', 3.0), lease=1e-6)
        answer = request.decide('/left', 'commit')
        self.assertEqual((answer.state, answer.reasons), ('prepared', ['the time for it was over']))
        wait_until(lambda: request.decide('/left', 'commit').state == 'aborted', 'it ends by itself')
        self.assertEqual(request.decide('/left', 'abort').state, 'aborted')
        self.assertEqual(request.decide('/right', 'commit').state, '')

    def test_two_requesters_never_wait_for_each_other_and_never_mix(self):
        def force(first):
            for turn in range(15):
                value = float(first + turn)
                pair = self.pair() if first else self.pair()[::-1]
                rosslt.force_value(pair, [value, value], timeout=20.0, request_id=f'mix {value}')

        with ThreadPoolExecutor(3) as pool:
            self.assertEqual(len([*pool.map(force, (50, 100, 200))]), 3)
        left, right = self.offsets()
        self.assertEqual(left, right)
        orders = []
        for node in ('/left', '/right'):
            changes = rospy.ServiceProxy(node + '/rosslt/get_history', GetHistory)('', 0).changes
            orders.append([entry.request_id for entry in changes if entry.request_id.startswith('mix')])
        self.assertEqual(len(orders[0]), 45)
        self.assertEqual(orders[0], orders[1])

    def test_a_request_is_taken_back_in_all_nodes_or_in_none(self):
        rosslt.force_value(self.pair(), [3.0, 4.0], request_id='whole')
        rosslt.force_value(tracked('/right', 'offset', 4.0), 5.0)
        undone = rosslt_node.undo_request('whole', ['/left', '/right'], '/hand', 5.0)
        self.assertEqual((undone.changes, list(undone.reasons)), ({}, ['/right']))
        self.assertIn('offset has been changed since by /commit', undone.reasons['/right'])
        self.assertEqual(self.offsets(), [3.0, 5.0])

    def test_own_locations_take_part(self):
        own = rosslt.location(1.0, name='own')
        rosslt.force_value([own, tracked('/left', 'offset')], [5.0, 6.0])
        self.assertEqual((rosslt.reevaluate(own), present('/left', 'offset')), (5.0, 6.0))
        unknown = rosslt.track(1.0, rosslt.Source('/left', 12345))
        with self.assertRaisesRegex(rosslt.ChangeRejected, 'nothing has changed'):
            rosslt.force_value([own, unknown], [7.0, 8.0])
        self.assertEqual(rosslt.reevaluate(own), 5.0)

    def test_requests_that_make_no_sense_are_refused(self):
        service, one = change_sources('/left'), location_id('/left', 'offset')
        sound = {
            'phase': 'prepare',
            'transaction_id': 't',
            'request_id': 'r',
            'nodes': ['/left'],
            'lease': 1.0,
            'location_ids': [one],
            'values': ['1'],
        }
        for fault in (
            {'transaction_id': ''},
            {'values': []},
            {'request_id': '', 'location_ids': [], 'values': []},
            {'lease': float('nan')},
            {'lease': -1.0},
            {'nodes': ['left']},
            {'nodes': ['/le ft']},
            {'nodes': ['/left'] * 101},
            {'phase': 'perhaps'},
        ):
            with self.assertRaises(rospy.ServiceException):
                service(**{**sound, **fault})
        for text in ('[1]', '"text"', '1e999', ''):
            answer = service(**{**sound, 'transaction_id': 't' + text, 'values': [text]})
            self.assertEqual(answer.state, 'refused')
        self.assertEqual(json.loads(str(present('/left', 'offset'))), 1.0)


if __name__ == '__main__':
    import rostest

    rosslt.init_node('commit')
    rostest.rosrun('rosslt', 'commit', '__main__')
