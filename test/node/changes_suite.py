#!/usr/bin/env python3
"""What holds for changes: acknowledged, all or nothing, in time, whatever happens to the source's owner."""

import itertools
import json
import signal
import subprocess
import threading
import time
import unittest

import rospy
from rosslt.msg import AppliedChange
from rosslt.srv import ChangeSources, GetValues, ListLocations

import rosslt
from support.processes import Node, wait_until, wait_until_hears

OWNER = """
    rosslt.location(2.0, name='gain', minimum=0.0, maximum=10.0)
    rosslt.location(1.0, name='offset')
    rosslt.location(3, name='count')
    rosslt.location('map', name='frame')
    rosslt.location(True, name='on')
    rosslt.location(5.0, name='fixed', read_only=True)
    rospy.spin()
    """


def tracked(node, *names):
    """The values of locations of another node, tracked; a list where there are several names."""
    list_locations = rospy.ServiceProxy(node.name + '/rosslt/list_locations', ListLocations)

    def listed():
        try:
            by_name = {location.name: location for location in list_locations().locations}
        except rospy.ServiceException:  # it was restarted, and does not offer all yet
            return None
        return by_name if by_name.keys() >= set(names) else None

    by_name = wait_until(listed, '{} has {}'.format(node.name, names))
    found = [
        rosslt.track(json.loads(by_name[name].value), rosslt.Source(node.name, by_name[name].id)) for name in names
    ]
    return found if len(found) > 1 else found[0]


def change(node, *pairs):
    """Ask the service itself: [(tracked value, JSON text), ...]."""
    service = rospy.ServiceProxy(node.name + '/rosslt/change_sources', ChangeSources)
    return service(
        requester='a test',
        location_ids=[rosslt.sources(value)[0].location_id for value, _ in pairs],
        values=[text for _, text in pairs],
    )


class Changes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.owner = Node('owner', OWNER)

    @classmethod
    def tearDownClass(cls):
        cls.owner.stop()

    def current(self, *names):
        return rosslt.untracked(rosslt.reevaluate(tracked(self.owner, *names)))

    def test_a_forced_value_is_what_its_owner_has_then(self):
        gain = tracked(self.owner, 'gain')
        changed = rosslt.force_value(3 * gain + 1, 10.0)
        self.assertEqual(changed, {rosslt.sources(gain)[0]: (gain, 3.0)})
        self.assertEqual(self.current('gain'), 3.0)
        self.assertEqual(rosslt.reevaluate(3 * gain + 1), 10.0)

    def test_every_type_is_changed_as_that_type(self):
        count, frame, on = tracked(self.owner, 'count', 'frame', 'on')
        rosslt.force_value([count, 'base_' + frame, on], [7, 'base_link', False])
        self.assertEqual(self.current('count', 'frame', 'on'), [7, 'link', False])

    def test_a_change_to_an_unknown_location_is_refused_with_the_reason(self):
        unknown = rosslt.track(1.0, rosslt.Source('/owner', 12345))
        with self.assertRaisesRegex(rosslt.ChangeRejected, '/owner has no location 12345'):
            rosslt.force_value(unknown, 2.0)

    def test_what_the_owner_does_not_take_is_refused_with_the_reason(self):
        gain, count, frame, on, fixed = tracked(self.owner, 'gain', 'count', 'frame', 'on', 'fixed')
        before = self.current('gain', 'count', 'frame', 'on', 'fixed')
        for value, text, reason in (
            (gain, '10.5', 'above its maximum 10.0'),
            (gain, '-1', 'below its minimum 0.0'),
            (gain, 'NaN', 'not a finite number'),
            (gain, '1e999', 'not a finite number'),
            (gain, '"text"', 'is a float'),
            (gain, 'true', 'is a float'),
            (gain, '[1.0]', 'not a JSON scalar'),
            (gain, '', 'not a JSON scalar'),
            (gain, '[' * 100000, 'not a JSON scalar'),
            (gain, '9' * 400, 'too large for a float'),
            (count, '9' * 400, 'too large for a float'),
            (gain, '9' * 10000, 'refuse'),
            (count, '1.5', 'is an int'),
            (frame, '3', 'is a str'),
            (on, '1', 'is a bool'),
            (fixed, '6.0', 'is read-only'),
        ):
            answer = change(self.owner, (value, text))
            self.assertEqual(answer.state, 'refused', text)
            if reason != 'refuse':
                self.assertIn(reason, answer.reasons[0])
        self.assertEqual(self.current('gain', 'count', 'frame', 'on', 'fixed'), before)

    def test_an_int_takes_a_float_without_a_fraction(self):
        answer = change(self.owner, (tracked(self.owner, 'count'), '4.0'))
        self.assertEqual((answer.state, [one.new_value for one in answer.changes]), ('applied', ['4']))

    def test_an_unknown_location_has_no_value_and_says_so(self):
        gain = tracked(self.owner, 'gain')
        service = rospy.ServiceProxy('/owner/rosslt/get_values', GetValues)
        answer = service([rosslt.sources(gain)[0].location_id, 12345])
        self.assertEqual(answer.reasons, ['', '/owner has no location 12345'])
        self.assertEqual(json.loads(answer.values[0]), gain)
        with self.assertRaisesRegex(rosslt.SourceUnreachable, 'has no location 12345'):
            rosslt.reevaluate(rosslt.track(1.0, rosslt.Source('/owner', 12345)))

    def test_a_plain_rostopic_pub_changes_a_source(self):
        offset = tracked(self.owner, 'offset')
        target = self.current('offset') + 1
        change = '{{node: /owner, location_id: {}, value: "{}"}}'.format(rosslt.sources(offset)[0].location_id, target)
        subprocess.run(
            ['rostopic', 'pub', '-1', '/rosslt/source_change', 'rosslt/SourceChange', change],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        wait_until(lambda: self.current('offset') == target, 'the change is applied')

    def test_what_was_applied_is_told_with_who_asked(self):
        told = []
        subscriber = rospy.Subscriber('/owner/rosslt/changes', AppliedChange, told.append)
        wait_until_hears(subscriber, '/owner')
        offset = tracked(self.owner, 'offset')
        rosslt.force_value(offset, 11.0)
        wait_until(lambda: told, 'it is told')
        subscriber.unregister()
        self.assertEqual((told[0].name, told[0].requester), ('offset', '/changes'))
        self.assertEqual((json.loads(told[0].old_value), told[0].new_value), (offset, '11.0'))
        self.assertEqual(told[0].location_id, rosslt.sources(offset)[0].location_id)

    def test_a_locked_node_refuses_every_change_until_it_is_unlocked(self):
        gain = tracked(self.owner, 'gain')
        rospy.set_param('/owner/rosslt/change_locks', [['', 'ada', 'it runs']])

        def refused():
            try:
                rosslt.force_value(gain, gain + 1)
            except rosslt.ChangeRejected as error:
                return str(error)
            return None

        try:
            self.assertIn(
                '/owner is locked by ada: it runs',
                wait_until(refused, 'the node is locked'),
            )
            before = self.current('offset')
            rospy.set_param('/owner/rosslt/offset', before + 1)
            wait_until(lambda: rospy.get_param('/owner/rosslt/offset') == before, 'it is taken back')
        finally:
            rospy.set_param('/owner/rosslt/change_locks', [])
        wait_until(lambda: not refused(), 'the node is unlocked')

    def test_a_source_that_is_known_to_be_read_only_is_passed_over(self):
        fixed, offset = tracked(self.owner, 'fixed', 'offset')
        changed = rosslt.force_value(fixed + offset, fixed + 30.0)
        self.assertEqual(changed, {rosslt.sources(offset)[0]: (offset, 30.0)})
        with self.assertRaisesRegex(rosslt.Error, 'read-only'):
            rosslt.force_value(fixed + offset, 40.0, source=rosslt.sources(fixed)[0])

    def test_a_bound_of_another_node_that_stands_in_the_way_is_named_with_its_place(self):
        gain = tracked(self.owner, 'gain')
        with self.assertRaisesRegex(rosslt.NotInvertible, r'owner.py:\d+:\d+.* 10'):
            rosslt.force_value(3 * gain, 33.0)

    def test_it_works_in_a_callback_in_threads_and_on_own_locations(self):
        own = rosslt.location(1.0, name='own')
        done, errors = [], []

        def force(_event):
            try:
                rosslt.force_value([tracked(self.owner, 'offset'), own], [21.0, 22.0])
                done.append(True)
            except rosslt.Error as error:
                errors.append(error)

        rospy.Timer(rospy.Duration(0.01), force, oneshot=True)
        threads = [threading.Thread(target=force, args=(None,)) for _ in range(5)]
        for thread in threads:
            thread.start()
        wait_until(lambda: len(done) + len(errors) == 6, 'all are done')
        self.assertEqual(errors, [])
        self.assertEqual(rosslt.reevaluate(own), 22.0)


class Failures(unittest.TestCase):
    def test_a_node_that_never_was_is_unreachable(self):
        nobody = rosslt.track(1.0, rosslt.Source('/nobody', 1))
        with self.assertRaisesRegex(rosslt.SourceUnreachable, 'cannot reach /nobody'):
            rosslt.force_value(nobody, 2.0)
        with self.assertRaisesRegex(rosslt.SourceUnreachable, 'cannot reach /nobody'):
            rosslt.reevaluate(nobody)

    def test_a_node_that_hangs_is_unreachable_within_the_timeout(self):
        with Node('hanging', OWNER) as node:
            gain = tracked(node, 'gain')
            node.process.send_signal(signal.SIGSTOP)
            with self.assertRaisesRegex(rosslt.SourceUnreachable, r'/hanging: no answer within the timeout'):
                rosslt.force_value(gain, 1.0, timeout=0.5)
            node.process.send_signal(signal.SIGCONT)
            self.assertEqual(rosslt.force_value(gain, 2.5, timeout=5.0)[rosslt.sources(gain)[0]].new, 2.5)

    def test_ctrl_c_ends_a_node_that_waits_for_an_answer(self):
        waiting = """
            gain = rosslt.track(2.0, rosslt.Source('/hanging', {}))
            print('waiting', flush=True)
            rosslt.force_value(gain, 3.0, timeout=60.0)
            """
        with Node('hanging', OWNER) as hanging:
            location_id = rosslt.sources(tracked(hanging, 'gain'))[0].location_id
            hanging.process.send_signal(signal.SIGSTOP)
            with Node('waiting', waiting.format(location_id)) as node:
                self.assertEqual(node.read_line(), 'waiting')
                time.sleep(0.3)  # into the call: nothing outside shows that it has begun
                self.assertNotEqual(node.stop(signal.SIGINT), -signal.SIGKILL, 'it ended by itself')


class Crowd(unittest.TestCase):
    CLIENTS, TIMES = 8, 60
    CLIENT = """
        offset = rosslt.track(1.0, rosslt.Source('/crowded', {location_id}))
        print('ready', flush=True)
        while not rospy.has_param('/go'):
            time.sleep(0.05)
        acknowledged = []
        for turn in range({times}):
            (change,) = rosslt.force_value(offset, {first} + turn, timeout=30.0).values()
            acknowledged.append(change)
        print(json.dumps(acknowledged), flush=True)
        """

    def test_every_acknowledged_change_happened_in_the_order_acknowledged_and_none_is_lost(self):
        with Node('crowded', OWNER) as node:
            location_id = rosslt.sources(tracked(node, 'offset'))[0].location_id
            told = []
            subscriber = rospy.Subscriber('/crowded/rosslt/changes', AppliedChange, told.append)
            wait_until_hears(subscriber, '/crowded')
            clients = [
                Node(
                    'client{}'.format(number),
                    self.CLIENT.format(location_id=location_id, times=self.TIMES, first=1000.0 * (number + 1)),
                )
                for number in range(self.CLIENTS)
            ]
            try:
                for client in clients:
                    self.assertEqual(client.read_line(), 'ready')
                rospy.set_param('/go', True)
                acknowledged = [json.loads(client.read_line()) for client in clients]
            finally:
                for client in clients:
                    client.stop(signal.SIGKILL)
            changes = [
                (json.loads(change.old_value), json.loads(change.new_value))
                for change in wait_until(lambda: len(told) == self.CLIENTS * self.TIMES and told, 'all are told')
            ]
            self.assertEqual(sorted(changes), sorted(map(tuple, itertools.chain(*acknowledged))))
            for (_, new), (old, _) in zip(changes, changes[1:]):
                self.assertEqual(new, old)
            order = {pair: index for index, pair in enumerate(changes)}
            for own in acknowledged:
                positions = [order[tuple(pair)] for pair in own]
                self.assertEqual(positions, sorted(positions))
            self.assertEqual(rospy.get_param('/crowded/rosslt/offset'), changes[-1][1])


if __name__ == '__main__':
    import rostest

    rosslt.init_node('changes')
    rostest.rosrun('rosslt', 'changes', '__main__')
