#!/usr/bin/env python3
"""What a node remembers: who changed what, what is taken back as one, what an earlier run left, and what it tells."""

import json
import signal
import subprocess
import sys
import textwrap
import unittest

import rosgraph
import rospy
from geometry_msgs.msg import Point
from rosslt.msg import LocationList
from rosslt.srv import ChangeSources, GetHistory, ListLocations

import rosslt
from rosslt import node as rosslt_node
from rosslt import srv
from support.processes import Node, wait_until

OWNER = """
    rosslt.location(2.0, name='gain', maximum=10.0)
    rosslt.location(1.0, name='offset', weight=3.0)
    rosslt.get_param('~speed', 0.5)
    rospy.spin()
    """


def service(node, name, kind):
    return rospy.ServiceProxy('{}/rosslt/{}'.format(node.name, name), kind)


def listed(node):
    """{name: rosslt/Location}, once the node has created the last one of OWNER."""
    list_locations = service(node, 'list_locations', ListLocations)

    def found():
        try:
            by_name = {one.name: one for one in list_locations().locations}
        except rospy.ServiceException:  # it was killed, and its service at the master is still the one before
            return None
        return by_name if node.name + '/speed' in by_name else None

    return wait_until(found, 'all locations are there')


def tracked(node, name):
    one = listed(node)[name]
    return rosslt.track(json.loads(one.value), rosslt.Source(node.name, one.id))


def value(node, name):
    return json.loads(listed(node)[name].value)


def undo(node, request_id=''):
    """The answer of a node that is asked to take a request back."""
    return service(node, 'change_sources', ChangeSources)(srv.ChangeSourcesRequest(undo=True, request_id=request_id))


def reset(node, *names):
    """Restore what the code says, of all literals where none is named."""
    places = [place for place in places_of(node) if not names or place.location.name in names]
    return rosslt_node.request_values(rosslt_node.values_in_code(places))


def places_of(node):
    return rosslt_node.Directory().ask([node.name])[0][node.name]


class Histories(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.owner = Node('owner', OWNER)

    @classmethod
    def tearDownClass(cls):
        cls.owner.stop()

    def history(self, request_id='', limit=0):
        return service(self.owner, 'get_history', GetHistory)(request_id, limit).changes

    def test_all_calls_of_a_drag_are_one_change_and_taken_back_as_one(self):
        before, drag = value(self.owner, 'gain'), rosslt_node.new_request_id()
        for step in range(1, 6):
            rosslt.force_value(tracked(self.owner, 'gain'), before + step, request_id=drag)
        (entry,) = self.history(drag)
        self.assertEqual((json.loads(entry.change.old_value), json.loads(entry.change.new_value)), (before, before + 5))
        self.assertEqual(undo(self.owner).state, 'applied')
        self.assertEqual(value(self.owner, 'gain'), before)
        (entry,) = self.history(drag)
        self.assertTrue(entry.undone)

    def test_the_history_says_who_changed_what_from_what_and_when(self):
        start, before = rospy.Time.now(), value(self.owner, 'offset')
        rosslt.force_value(tracked(self.owner, 'offset'), before + 1)
        rospy.set_param('/owner/rosslt/offset', before + 2)
        wait_until(lambda: value(self.owner, 'offset') == before + 2, 'the parameter is taken')
        forced, by_parameter = self.history(limit=2)
        self.assertEqual((forced.change.name, forced.change.requester), ('offset', '/history'))
        self.assertEqual((forced.change.old_value, forced.change.new_value), (str(before), str(before + 1)))
        self.assertGreaterEqual(forced.change.stamp, start)
        self.assertEqual(by_parameter.change.requester, 'parameter server')
        self.assertNotEqual(forced.request_id, by_parameter.request_id)

    def test_a_change_of_a_parameter_that_is_read_as_a_source_is_in_the_history(self):
        before = value(self.owner, '/owner/speed')
        rospy.set_param('/owner/speed', before + 1)
        wait_until(lambda: value(self.owner, '/owner/speed') == before + 1, 'the parameter is taken')
        self.assertEqual(self.history(limit=1)[0].change.name, '/owner/speed')
        self.assertEqual(undo(self.owner).state, 'applied')
        wait_until(lambda: rospy.get_param('/owner/speed') == before, 'it is as before')

    def test_a_request_over_two_nodes_is_taken_back_in_both(self):
        with Node('second', OWNER) as second:
            pair = [tracked(self.owner, 'offset'), tracked(second, 'offset')]
            rosslt.force_value(pair, [7.5, 8.5], request_id='both')
            rosslt.force_value(tracked(second, 'gain'), 5.0)
            undone = rosslt_node.undo_request('both', ['/owner', '/second'], '/somebody', 5.0)
            self.assertEqual(undone.reasons, {})
            self.assertEqual([change.requester for change in undone.changes['/second']], ['/somebody'])
            self.assertEqual([value(self.owner, 'offset'), value(second, 'offset')], rosslt.untracked(pair))
            self.assertEqual(value(second, 'gain'), 5.0)

    def test_what_was_changed_since_by_another_is_not_taken_back(self):
        rosslt.force_value(tracked(self.owner, 'offset'), 31.0, request_id='first')
        rosslt.force_value(tracked(self.owner, 'offset'), 32.0, request_id='later')
        answer = undo(self.owner, 'first')
        self.assertEqual(answer.state, 'refused')
        self.assertIn('offset has been changed since by /history', answer.reasons[0])
        self.assertEqual(value(self.owner, 'offset'), 32.0)

    def test_there_is_nothing_to_take_back_of_an_unknown_request(self):
        answer = undo(self.owner, 'no such request')
        self.assertEqual((answer.state, answer.reasons), ('refused', ['there is no change to take back']))

    def test_a_node_goes_back_to_what_its_code_says(self):
        rosslt.force_value([tracked(self.owner, 'gain'), tracked(self.owner, 'offset')], [6.0, 60.0])
        self.assertEqual(list(reset(self.owner, 'gain').values()), [(6.0, 2.0)])
        self.assertEqual((value(self.owner, 'gain'), value(self.owner, 'offset')), (2.0, 60.0))
        reset(self.owner)
        self.assertEqual(value(self.owner, 'offset'), 1.0)
        self.assertEqual(undo(self.owner).state, 'applied')
        self.assertEqual(value(self.owner, 'offset'), 60.0)


class Killed(unittest.TestCase):
    """A node that is killed comes back with what it was changed to, and that can be taken back."""

    def drag(self, node, gain, speed):
        """A step of a drag."""
        wanted = {'gain': gain, node.name + '/speed': speed}
        changes = {rosslt.sources(tracked(node, name))[0]: one for name, one in wanted.items()}
        rosslt_node.request_values(changes, 5.0, 'drag')

    def kill(self, node):
        node.stop(signal.SIGKILL)
        node.start()
        listed(node)

    def values(self, node):
        return value(node, 'gain'), value(node, node.name + '/speed')

    def test_half_a_drag_is_taken_back_after_the_node_was_killed(self):
        with Node('killed', OWNER) as node:
            self.drag(node, 3.0, 0.75)
            self.drag(node, 4.0, 1.0)
            self.kill(node)
            self.assertEqual(self.values(node), (4.0, 1.0))
            self.assertEqual(undo(node).state, 'applied')
            self.assertEqual(self.values(node), (2.0, 0.5))
            self.kill(node)
            self.assertEqual(self.values(node), (2.0, 0.5))
            self.assertEqual(undo(node).reasons, ['there is no change to take back'])

    def test_a_drag_that_goes_on_after_the_node_was_killed_is_one(self):
        with Node('going_on', OWNER) as node:
            self.drag(node, 3.0, 0.75)
            self.kill(node)
            self.drag(node, 4.0, 1.0)
            self.kill(node)
            self.assertEqual(undo(node).state, 'applied')
            self.assertEqual(self.values(node), (2.0, 0.5))

    def test_what_was_set_while_the_node_was_not_there_stays(self):
        with Node('set_meanwhile', OWNER) as node:
            self.drag(node, 3.0, 0.75)
            node.stop(signal.SIGKILL)
            rospy.set_param(node.name + '/speed', 1.5)
            node.start()
            listed(node)
            self.assertEqual(undo(node).state, 'applied')
            self.assertEqual(self.values(node), (2.0, 1.5))

    def test_the_change_before_the_last_one_is_left_where_that_was_taken_back(self):
        with Node('taken_back', OWNER) as node:
            rosslt.force_value(tracked(node, 'offset'), 5.0)
            self.drag(node, 3.0, 0.75)
            undo(node)
            self.kill(node)
            self.assertEqual(undo(node).state, 'applied')
            self.assertEqual((*self.values(node), value(node, 'offset')), (2.0, 0.5, 1.0))


class Told(unittest.TestCase):
    def test_what_an_earlier_run_left_is_said_and_listed(self):
        with Node('remembering', OWNER) as node:
            rosslt.force_value(tracked(node, 'gain'), 3.0)
            self.assertFalse(listed(node)['gain'].remembered)
            node.stop()
            node.start()
            gain = listed(node)['gain']
            self.assertEqual((gain.remembered, gain.value, gain.literal), (True, '3.0', '2.0'))
            self.assertFalse(listed(node)['offset'].remembered)
            reset(node)
            self.assertFalse(listed(node)['gain'].remembered)
            node.process.terminate()
            log = node.process.stdout.read()
            self.assertRegex(log, r'gain is 3\.0, from an earlier run; the code says 2\.0 \(remembering\.py:7:1\)')

    def test_nobody_reads_the_literal_of_a_location_whose_value_is_remembered(self):
        code = """
            from rosslt.node.parameters import mirror
            kept = mirror.Parameters._kept
            def slowly(self, location):
                print('taking over', flush=True)
                sys.stdin.readline()
                return kept(self, location)
            mirror.Parameters._kept = slowly
            """ + textwrap.dedent(OWNER).replace('\n', '\n            ')
        with Node('early', OWNER) as node:
            gain = tracked(node, 'gain')
            rosslt.force_value(gain, 3.0)
            node.stop(signal.SIGKILL)
            node.write(code)
            node.start()
            self.assertEqual(node.read_line(), 'taking over')
            with self.assertRaisesRegex(rosslt.SourceUnreachable, 'has no location'):
                rosslt.reevaluate(gain)
            node.process.stdin.write('go on\n' * 2)
            node.process.stdin.flush()
            wait_until(lambda: value(node, 'gain') == 3.0, 'it is remembered')

    def test_names_and_places_of_locations_are_latched_on_a_topic(self):
        with Node('named', OWNER):
            told = rospy.wait_for_message('/named/rosslt/locations', LocationList, 10.0)
            self.assertEqual(told.node, '/named')
            wait_until(
                lambda: [one.name for one in rospy.wait_for_message('/named/rosslt/locations', LocationList).locations]
                == ['gain', 'offset', '/named/speed'],
                'all are told',
            )

    def test_another_node_explains_a_value_by_name_without_having_asked(self):
        with Node('explained', OWNER) as node:
            gain = rosslt.track(2.0, rosslt.Source('/explained', listed(node)['gain'].id))
            self.assert_explained(2 * gain, '2 * 2.0 [gain, explained.py:7:1]')

    def test_the_node_is_named_where_two_have_the_location(self):
        with Node('twin', OWNER) as first:
            gain = rosslt.track(2.0, rosslt.Source('/twin', listed(first)['gain'].id))
            self.assert_explained(gain, '2.0 [gain, twin.py:7:1]')
            second = subprocess.Popen([sys.executable, first.file, '__name:=other'], stdout=subprocess.DEVNULL)
            try:
                rospy.wait_for_service('/other/rosslt/change_sources', 30.0)
                other = rosslt.track(2.0, rosslt.Source('/other', rosslt.sources(gain)[0].location_id))
                self.assert_explained(other, '2.0 [/other: gain, twin.py:7:1]')
                self.assert_explained(gain, '2.0 [/twin: gain, twin.py:7:1]')
            finally:
                second.terminate()
                second.wait()

    def assert_explained(self, value, text):
        """An explanation waits for owners for a moment only, and says what it knows."""
        wait_until(lambda: rosslt.explain(value) == text, text)

    def test_weights_are_told(self):
        with Node('weighted', OWNER) as node:
            self.assertEqual((listed(node)['offset'].weight, listed(node)['gain'].weight), (3.0, 0.0))
            offset, gain = tracked(node, 'offset'), tracked(node, 'gain')
            stiff, other = rosslt.sources([offset, gain])
            # the stiff one last, although it is the first one
            self.assertEqual(list(rosslt.force_value(offset + gain, float(offset + gain) + 1.0)), [other])
            offset, gain = tracked(node, 'offset'), tracked(node, 'gain')
            both = rosslt.force_value([offset + gain, 2 * offset + 2 * gain], [6.0, 12.0])
            moved = {source: change.new - change.old for source, change in both.items()}
            self.assertAlmostEqual(moved[other], 9 * moved[stiff])
            # but where it is chosen
            self.assertEqual(list(rosslt.force_value(offset + gain, 20.0, sources=[stiff])), [stiff])

    def test_an_anonymous_node_leaves_no_parameters(self):
        code = """
            rosslt.init_node('passing', anonymous=True)
            print(rosslt.location(1.0, name='gain'), flush=True)
            while not rospy.has_param('~rosslt/gain'):
                time.sleep(0.01)
            print('there', flush=True)
            rospy.spin()
            """

        def left():
            return [name for name in rosgraph.Master('/test').getParamNames() if name.startswith('/passing_')]

        node = Node('passing', code, calls_init_node=True, wait_for=None)
        self.assertEqual(node.read_line(), '1.0')
        self.assertEqual(node.read_line(), 'there')
        self.assertTrue(left())
        node.stop()
        self.assertEqual(left(), [])


class Callbacks(unittest.TestCase):
    def test_on_change_is_called_with_the_new_value(self):
        heard = []
        rate = rosslt.location(2.0, name='pace', on_change=heard.append)
        rosslt.force_value(rate, 3.0)
        wait_until(lambda: heard == [3.0], 'it is called')
        self.assertTrue(rosslt.is_tracked(heard[0]))
        rospy.set_param('~rosslt/pace', 4.0)
        wait_until(lambda: heard == [3.0, 4.0], 'it is called again')

    def test_on_change_is_called_once_for_a_whole_message(self):
        heard = []
        goal = rosslt.location(Point(1.0, 2.0, 3.0), name='place', on_change=heard.append)
        rosslt.force_value(goal, Point(4.0, 5.0, 6.0))
        wait_until(lambda: heard, 'it is called')
        rosslt.force_value(goal.x, 7.0)
        wait_until(lambda: len(heard) == 2, 'it is called again')
        self.assertEqual([(one.x, one.z) for one in heard], [(4.0, 6.0), (7.0, 6.0)])

    def test_a_callback_may_change_locations_itself_and_may_raise(self):
        follower = rosslt.location(1.0, name='follower')

        def follow(value):
            rosslt.force_value(follower, 10 * value)
            raise RuntimeError('after that')

        leader = rosslt.location(1.0, name='leader', on_change=follow)
        for target in (2.0, 3.0):
            rosslt.force_value(leader, target)
            wait_until(lambda target=target: rosslt.reevaluate(follower) == 10 * target, 'it followed')


class Limits(unittest.TestCase):
    def test_bounds_that_make_no_sense_are_refused_with_the_reason(self):
        for limits, kind, reason in (
            ({'maximum': '3'}, TypeError, "maximum='3' is not a number"),
            ({'minimum': True}, TypeError, 'minimum=True is not a number'),
            ({'minimum': 3.0, 'maximum': 2.0}, ValueError, r'minimum=3\.0 is above maximum=2\.0'),
            ({'maximum': float('nan')}, ValueError, 'maximum=nan is not a finite number'),
            ({'minimum': float('-inf')}, ValueError, 'minimum=-inf is not a finite number'),
            ({'weight': 0}, ValueError, 'weight=0 has to be above 0'),
        ):
            with self.assertRaisesRegex(kind, reason):
                rosslt.location(2.5, name='limited', **limits)
        with self.assertRaisesRegex(ValueError, 'nan is not a finite number'):
            rosslt.location(float('nan'), name='limited')

    def test_the_same_name_with_the_same_literal_is_the_same_location(self):
        waypoints = [[0.0, 1.0], [2.0, 3.0]]
        first = rosslt.location(waypoints, name='waypoints')
        second = rosslt.location(waypoints, name='waypoints')
        self.assertEqual(rosslt.sources(first), rosslt.sources(second))
        rosslt.force_value(first[0], [5.0, 6.0])
        third = rosslt.location(waypoints, name='waypoints')
        self.assertEqual(third, [[5.0, 6.0], [2.0, 3.0]])
        with self.assertRaisesRegex(ValueError, 'give one of them another'):
            rosslt.location([[9.0, 1.0], [2.0, 3.0]], name='waypoints')

    def test_an_int_parameter_is_read_as_a_float_on_request(self):
        count = rosslt.get_param('/counts/int', as_float=True)
        self.assertIs(type(rosslt.untracked(count)), float)
        rosslt.force_value(0.5 * count, 1.25)
        self.assertEqual(rospy.get_param('/counts/int'), 2.5)
        rospy.set_param('/counts/int', 7)
        wait_until(lambda: rosslt.get_param('/counts/int') == 7, 'it is seen')
        self.assertIs(type(rosslt.untracked(rosslt.get_param('/counts/int'))), float)


if __name__ == '__main__':
    import rostest

    rosslt.init_node('history')
    rosslt_node.MEMORY.begin()  # what tests keep of callbacks is not what a node sets up
    rostest.rosrun('rosslt', 'history', '__main__')
