#!/usr/bin/env python3
"""What holds for the locations of a node: identity, current values, the parameters behind them."""

import json
import math
import os
import re
import subprocess
import textwrap
import threading
import unittest
import unittest.mock
import xmlrpc.client
from collections import OrderedDict, namedtuple

import rosgraph
import rospy
from geometry_msgs.msg import Point, PoseStamped
from rosslt.msg import LocationList
from rosslt.srv import ChangeSources, GetHistory, GetValues, ListLocations, LockLocations

import rosslt
from rosslt.node.api import _BY_CALL, _owner
from rosslt.node.parameters.server import ParameterServer
from support.processes import Node, wait_until

SHOW = """
for source in rosslt.sources(values):
    print(source.location_id, flush=True)
print(json.dumps(rosslt.untracked(values)), flush=True)
rospy.spin()
"""


Gains = namedtuple('Gains', ['p', 'rest'])


def rosparam(*arguments):
    subprocess.run(['rosparam', *arguments], check=True, stdout=subprocess.DEVNULL)


def listed(name):
    for location in rospy.ServiceProxy('~rosslt/list_locations', ListLocations)().locations:
        if location.name == name:
            return location
    raise AssertionError('list_locations does not list ' + name)


class Literals(unittest.TestCase):
    def test_the_same_call_again_gives_the_current_value(self):
        def read():
            return rosslt.location(0.25)

        first = read()
        self.assertEqual(first, 0.25)
        self.assertEqual(rosslt.force_value(first, 0.5), {rosslt.sources(first)[0]: (0.25, 0.5)})
        self.assertEqual(read(), 0.5)
        self.assertEqual(rosslt.sources(read()), rosslt.sources(first))

    def test_a_key_tells_the_turns_of_a_loop_apart(self):
        turns = [rosslt.location(turn, key=turn) for turn in range(3)]
        self.assertEqual(turns, [0, 1, 2])
        self.assertEqual(len(set(rosslt.sources(turns))), 3)

    def test_a_list_tells_where_it_stands_and_what_it_takes(self):
        rosslt.location(3, name='listed/here', minimum=1, maximum=5)
        location = listed('listed/here')
        self.assertEqual(os.path.basename(location.file), 'locations_suite.py')
        with open(location.file) as file:
            line = file.readlines()[location.line - 1]
        self.assertTrue(line[location.column - 1 :].startswith("rosslt.location(3, name='listed/here'"), line)
        self.assertEqual((location.type, location.value, location.minimum, location.maximum), ('int', '3', '1', '5'))

    def test_each_leaf_of_a_message_is_a_location(self):
        def read():
            return rosslt.location(PoseStamped(), name='goal')

        goal = read()
        self.assertIsInstance(goal, PoseStamped)
        self.assertEqual(len(rosslt.sources(goal)), 8)
        goal.header.stamp = rospy.Time(5)
        rosslt.force_value(goal.pose.position, Point(1.0, 2.0, 3.0))
        rosslt.force_value(goal.header.frame_id, 'map')
        again = read()
        self.assertEqual((again.pose.position.x, again.pose.position.z), (1.0, 3.0))
        self.assertEqual(again.header.frame_id, 'map')
        self.assertEqual(again.header.stamp, rospy.Time(0))

    def test_lists_and_dicts_are_given_back_as_such(self):
        value = rosslt.location(OrderedDict(gains=[1.0, 2], on=True, name='a'), name='tree')
        self.assertIs(type(value), OrderedDict)
        self.assertEqual(dict(value), {'gains': [1.0, 2], 'on': 1, 'name': 'a'})
        self.assertEqual(len(rosslt.sources(dict(value))), 4)

    def test_keys_of_every_kind_are_locations_of_their_own(self):
        keys = ['+x', '-x', 'é', 'è', 'a b', 'a-b', 'Küche', (0, 1), (0, -1), (0, True), '1', 1, 1.0, True]
        for name in (None, 'keys'):
            values = [rosslt.location(1.0, name=name, key=key) for key in keys]
            self.assertEqual(len(set(rosslt.sources(values))), len(keys))
        tree = rosslt.location({1: 1.0, '1': 2.0, 'Küche': {'a/b': 3.0}, 'Kuche/a': {'b': 4.0}}, name='odd_keys')
        self.assertEqual(tree, {1: 1.0, '1': 2.0, 'Küche': {'a/b': 3.0}, 'Kuche/a': {'b': 4.0}})
        rosslt.force_value(tree['1'], 5.0)
        self.assertEqual(rosslt.reevaluate(tree)['1'], 5.0)
        for location in rospy.ServiceProxy('~rosslt/list_locations', ListLocations)().locations:
            self.assertTrue(rosgraph.names.is_legal_name(location.name), location.name)

    def test_calls_in_code_that_is_executed_once_are_forgotten(self):
        known = len(_BY_CALL)
        for turn in range(3):
            names = {}
            exec(f"import rosslt; x = rosslt.location({turn}.0, name='executed', key={turn})", names)
            self.assertEqual(names['x'], turn)
        self.assertEqual(len(_BY_CALL), known)

    def test_a_namedtuple_is_given_back_as_such(self):
        gains = rosslt.location(Gains(0.5, {'i': (1.0, 2.0)}), name='gains')
        self.assertEqual((type(gains), gains), (Gains, Gains(0.5, {'i': (1.0, 2.0)})))
        self.assertEqual(listed('gains/p').value, '0.5')

    def test_a_text_that_no_message_can_hold_is_refused(self):
        name = rosslt.location('lamp', name='text')
        change = rospy.ServiceProxy('~rosslt/change_sources', ChangeSources)
        answer = change(location_ids=[rosslt.sources(name)[0].location_id], values=['"\\ud800"'], requester='a test')
        self.assertEqual(answer.state, 'refused')
        self.assertIn('half a surrogate pair', answer.reasons[0])
        self.assertEqual(listed('text').value, '"lamp"')
        with self.assertRaisesRegex(ValueError, 'half a surrogate pair'):
            rosslt.location('\ud800', name='half')

    def test_a_name_is_taken_once(self):
        rosslt.location(1.0, name='taken')
        with self.assertRaisesRegex(ValueError, r'taken at locations_suite.py:\d+:\d+ meets taken at'):
            rosslt.location(2.0, name='taken')
        with self.assertRaisesRegex(ValueError, 'meets taken at'):
            rosslt.location(2.0, name='taken/below')

    def test_what_is_no_name_is_refused(self):
        for name in ('', 'a b', '/a', 'a//b', 'change_locks', 'rate'):
            with self.assertRaises(ValueError):
                rosslt.location(1.0, name=name)

    def test_a_literal_out_of_its_own_bounds_is_refused(self):
        with self.assertRaisesRegex(ValueError, 'above its maximum 5'):
            rosslt.location(7, name='too_much', maximum=5)

    def test_what_cannot_be_a_location_is_refused(self):
        with self.assertRaisesRegex(TypeError, 'what is of type set cannot be a location'):
            rosslt.location({1, 2})
        with self.assertRaisesRegex(TypeError, 'either a value or a getter'):
            rosslt.location()
        with self.assertRaisesRegex(TypeError, 'bounds are for numbers'):
            rosslt.location('text', minimum=1)


class External(unittest.TestCase):
    def setUp(self):
        self.held = {'value': 2.0}

    def set(self, value):
        if value > 10:
            raise RuntimeError('the file is full')
        self.held['value'] = value

    def test_a_getter_and_a_setter_read_and_write_it(self):
        def read():
            return rosslt.location(getter=lambda: self.held['value'], setter=self.set, name='external')

        self.assertEqual(read(), 2.0)
        rosslt.force_value(read() * 2, 6.0)
        self.assertEqual(self.held['value'], 3.0)
        self.held['value'] = 4.0
        self.assertEqual(read(), 4.0)
        self.assertEqual(rosslt.reevaluate(2 * read()), 8.0)
        with self.assertRaisesRegex(rosslt.ChangeRejected, 'RuntimeError: the file is full'):
            rosslt.force_value(read(), 11.0)
        self.assertEqual(self.held['value'], 4.0)

    def test_a_setter_and_a_getter_may_wait_for_who_makes_a_location(self):
        mine, is_called, made = threading.Lock(), threading.Event(), threading.Event()

        def with_my_lock(function):
            def called(*arguments):
                is_called.set()
                with mine:
                    return function(*arguments)

            return called

        def make():
            rosslt.location(1.0, name=f'made_{len(dones)}')
            rosslt.get_param(f'~made_{len(dones)}', 1.0)
            made.set()

        dones = []
        slow = rosslt.location(
            getter=with_my_lock(lambda: self.held['value']), setter=with_my_lock(self.set), name='shares_a_lock'
        )
        both = (lambda: rosslt.force_value(slow, 5.0, timeout=30.0)), (lambda: listed('shares_a_lock'))
        for calls, call in enumerate(both, 1):
            is_called.clear(), made.clear()
            with mine:
                threading.Thread(target=lambda call=call: dones.append(call()), daemon=True).start()
                self.assertTrue(is_called.wait(10.0))
                threading.Thread(target=make, daemon=True).start()
                self.assertTrue(made.wait(10.0), 'it waits for the lock of the user')
            wait_until(lambda calls=calls: len(dones) == calls, 'the call ends')
        self.assertEqual(self.held['value'], 5.0)

    def test_a_getter_that_fails_is_listed_with_its_fault_and_all_others_with_their_values(self):
        def get():
            if isinstance(self.held['value'], Exception):
                raise self.held['value']
            return self.held['value']

        broken = rosslt.location(getter=get, setter=self.set, name='broken')
        told = []
        subscriber = rospy.Subscriber('~rosslt/locations', LocationList, told.append)
        self.addCleanup(subscriber.unregister)
        values = rospy.ServiceProxy('~rosslt/get_values', GetValues)
        for turn, (fault, text) in enumerate(
            (
                (RuntimeError('the port is closed \udc80'), 'RuntimeError: the port is closed'),
                (math.nan, 'nan is not a finite number'),
                ('\ud800', 'half a surrogate pair'),
                (None, 'None is not a float, int, str or bool'),
            )
        ):
            self.held['value'] = fault
            self.assertEqual((listed('broken').value, text in listed('broken').fault), ('', True), text)
            beside = rosslt.location(3.0, name=f'beside_{turn}')
            self.assertEqual((listed(f'beside_{turn}').value, listed(f'beside_{turn}').fault), ('3.0', ''))
            wait_until(
                lambda turn=turn, text=text: told
                and {f'beside_{turn}', 'broken'} <= {one.name for one in told[-1].locations}
                and any(text in one.fault for one in told[-1].locations),
                'the topic of locations tells it',
            )
            self.assertIn(text, values([rosslt.sources(broken)[0].location_id]).reasons[0])
            with self.assertRaisesRegex(rosslt.ChangeRejected, re.escape(text)):
                rosslt.force_value([broken, beside], [4.0, 4.0])
            self.assertEqual(rosslt.reevaluate(beside), 3.0)
        self.held['value'] = 2.0
        self.assertEqual((listed('broken').value, listed('broken').fault), ('2.0', ''))

    def test_where_a_getter_fails_after_its_setter_all_values_are_put_back(self):
        fails = []

        def set_and_fail(value):
            self.set(value)
            fails[:] = [True] * (value == 5.0)

        def get():
            if fails:
                raise RuntimeError('the port is closed')
            return self.held['value']

        other = {'value': 1.0}
        first = rosslt.location(
            getter=lambda: other['value'], name='before_it_fails', setter=lambda value: other.update(value=value)
        )
        second = rosslt.location(getter=get, setter=set_and_fail, name='fails_after_it_is_set')
        plain = rosslt.location(1.0, name='beside_it')
        changes = rospy.ServiceProxy('~rosslt/get_history', GetHistory)
        before = len(changes().changes)
        with self.assertRaisesRegex(rosslt.ChangeRejected, 'fails: RuntimeError: the port is closed'):
            rosslt.force_value([plain, first, second], [9.0, 9.0, 5.0])
        self.assertEqual((other['value'], self.held['value']), (1.0, 2.0))
        self.assertEqual(rosslt.reevaluate([plain, first, second]), [1.0, 1.0, 2.0])
        self.assertEqual(len(changes().changes), before)

    def test_without_a_setter_it_is_read_only(self):
        value = rosslt.location(getter=lambda: 1.0, name='only_read')
        with self.assertRaises(rosslt.Error):
            rosslt.force_value(value, 2.0)


class Parameters(unittest.TestCase):
    def read(self):
        return rosslt.location(1.0, name='parameter', minimum=0.0)

    def test_a_rosparam_set_of_the_whole_namespace_is_seen(self):
        def read():
            return rosslt.location([1.0, 2.0], name='pair')

        read()
        wait_until(lambda: rospy.has_param('~rosslt/pair'), 'the parameter is there')
        rosparam('set', '/locations/rosslt/pair', "{'0': 7.0, '1': 8.0}")
        wait_until(lambda: read() == [7.0, 8.0], 'rosparam set is seen')

    def test_a_rosparam_set_that_does_not_do_is_taken_back(self):
        before = self.read()
        for bad in ('-1.0', 'text', '.inf'):
            rosparam('set', '/locations/rosslt/parameter', bad)
            wait_until(lambda: rospy.get_param('~rosslt/parameter') == before, 'the parameter is put back')
            self.assertEqual(self.read(), before)

    def test_a_parameter_that_a_launch_file_sets_goes_before_the_literal(self):
        self.assertEqual(rosslt.location(1.0, name='preset'), 7.5)

    def test_a_parameter_that_is_set_before_its_location_is_created_goes_before_the_literal(self):
        self.read()
        rosparam('set', '/locations/rosslt/early', '8.5')
        rosparam('set', '/locations/rosslt/parameter', '2.5')
        wait_until(lambda: self.read() == 2.5, 'the later rosparam set is seen')
        self.assertEqual(rosslt.location(1.0, name='early'), 8.5)

    def test_a_rosparam_set_is_seen_where_the_master_could_not_send_another(self):
        location = _owner.locations.by_id[rosslt.sources(self.read())[0].location_id]
        other, get = rosgraph.Master('/another'), ParameterServer.get
        fails = [True]

        def fail_once(server, key):
            if fails and key == '/locations/rosslt/other':
                other.setParam('/locations/rosslt/parameter', 3.5)
                fails.clear()
                raise xmlrpc.client.Fault(1, 'dictionary changed size during iteration')
            return get(server, key)

        with unittest.mock.patch.object(ParameterServer, 'get', fail_once):
            with _owner.parameters._wake:  # so that one round writes the one and reads the other
                _owner.parameters.write(location)
                _owner.parameters._notice('/locations/rosslt/other')
            wait_until(lambda: self.read() == 3.5, 'the rosparam set is seen')
        self.assertFalse(fails)

    def test_private_parameters_read_as_without_tracking(self):
        rosparam('set', '/locations/plain', '5')
        self.read()
        self.assertEqual(rospy.get_param('~')['plain'], 5)

    def test_rospy_takes_tracked_values_as_parameters(self):
        rospy.set_param('~copy', [self.read(), rosslt.location(True), rosslt.location('text')])
        self.assertEqual(rospy.get_param('~copy'), [self.read(), True, 'text'])

    def test_reading_makes_no_network_call(self):
        self.read()
        rosslt.get_param('/fleet/waypoints')
        port, calls = rosgraph.Master('/t').getUri(), []
        real = rosgraph.Master.__getattribute__
        try:
            rosgraph.Master.__getattribute__ = lambda master, name: calls.append(name) or real(master, name)
            for _ in range(100):
                self.read()
                rosslt.get_param('/fleet/waypoints')
        finally:
            del rosgraph.Master.__getattribute__
        self.assertEqual((calls, bool(port)), ([], True))


class ParametersAsSources(unittest.TestCase):
    def test_a_parameter_is_a_source_and_a_change_sets_it(self):
        speed = rosslt.get_param('/fleet/speed')
        self.assertTrue(rosslt.is_tracked(speed))
        rosslt.force_value(speed * 2, 5.0)
        self.assertEqual((rosslt.get_param('/fleet/speed'), rospy.get_param('/fleet/speed')), (2.5, 2.5))

    def test_in_a_tree_each_number_is_a_source_and_a_list_stays_one_parameter(self):
        fleet = rosslt.get_param('/fleet')
        self.assertEqual(fleet['waypoints'][1][:2], [4.0, 5.0])
        rosslt.force_value(fleet['waypoints'][1], [7.0, 8.0, 6])
        self.assertEqual(rospy.get_param('/fleet/waypoints'), [[1.0, 2.0, 3], [7.0, 8.0, 6]])
        self.assertEqual(rosslt.get_param('/fleet/waypoints')[1], [7.0, 8.0, 6])

    def test_a_plain_rosparam_set_is_seen_whatever_its_type(self):
        rospy.set_param('/robot/count', 3)
        self.assertEqual(rosslt.get_param('/robot/count'), 3)
        for text, value in (('3.5', 3.5), ('[1, 2]', [1, 2]), ('7', 7)):
            rosparam('set', '/robot/count', text)
            wait_until(lambda value=value: rosslt.get_param('/robot/count') == value, 'it is seen')

    def test_a_default_becomes_the_parameter_when_it_is_changed(self):
        value = rosslt.get_param('~unset', 0.5)
        self.assertFalse(rospy.has_param('~unset'))
        rosslt.force_value(value, 0.75)
        self.assertEqual((rospy.get_param('~unset'), rosslt.get_param('~unset', 0.5)), (0.75, 0.75))

    def test_a_parameter_that_is_not_set_is_a_key_error_as_in_rospy(self):
        with self.assertRaises(KeyError):
            rosslt.get_param('~nowhere')

    def test_a_parameter_that_becomes_a_dict_and_one_again_is_a_source_each_time(self):
        rospy.set_param('/shape', {'x': 1.0})
        first = rosslt.get_param('/shape/x')
        for text, key, value, target in (
            ('2.5', '/shape', 2.5, 7.0),
            ('{x: {y: 3.5}}', '/shape/x/y', 3.5, 7.0),
            ('[4.5]', '/shape', [4.5], [7.0]),
        ):
            rosparam('set', '/shape', text)
            wait_until(lambda key=key, value=value: rosslt.get_param(key, None) == value, 'it is seen')
            rosslt.force_value(rosslt.get_param(key), target)
            self.assertEqual(rospy.get_param(key), target)
        with self.assertRaisesRegex(rosslt.ChangeRejected, 'has no location'):
            rosslt.force_value(first, 3.0)
        rosparam('set', '/shape', '{x: 5.5}')
        wait_until(lambda: rosslt.get_param('/shape') == {'x': 5.5}, 'it is seen')
        rosslt.force_value(first, 6.5)
        self.assertEqual(rospy.get_param('/shape'), {'x': 6.5})

    def test_what_another_process_sets_while_this_one_writes_is_kept(self):
        rospy.set_param('/crossed', [0.0, 0.0, 0.0])
        first, other = rosslt.get_param('/crossed')[0], rosgraph.Master('/another')
        exchange = ParameterServer.exchange

        def overtaken(server, key, value):
            if overtakes:
                other.setParam(key, overtakes.pop())
            return exchange(server, key, value)

        overtakes = [[0.0, 5.0, 0.0, 7.0], [0.0, 4.0, 0.0]]
        with unittest.mock.patch.object(ParameterServer, 'exchange', overtaken):
            rosslt.force_value(first, 1.0)
        self.assertEqual(other.getParam('/crossed'), [1.0, 5.0, 0.0, 7.0])
        self.assertEqual(rosslt.get_param('/crossed'), [1.0, 5.0, 0.0, 7.0])

    def test_one_rosparam_set_of_a_list_is_one_request_and_taken_back_as_one(self):
        rospy.set_param('/listed', [1.0, 2.0, 3.0])
        rosslt.get_param('/listed')
        before = len(self.history('/listed'))
        rospy.set_param('/listed', [4.0, 5.0, 6.0])
        wait_until(lambda: rosslt.get_param('/listed') == [4.0, 5.0, 6.0], 'it is seen')
        told = self.history('/listed')[before:]
        self.assertEqual((len(told), len({one.request_id for one in told})), (3, 1))
        rosslt.undo()
        self.assertEqual(rospy.get_param('/listed'), [1.0, 2.0, 3.0])

    def history(self, key):
        changes = rospy.ServiceProxy('~rosslt/get_history', GetHistory)('', 0).changes
        return [one for one in changes if one.change.name.startswith(key + '/')]

    def test_no_location_vanishes_while_a_list_is_set(self):
        rospy.set_param('/steady', [0.0] * 100)
        ids = [rosslt.sources(part)[0].location_id for part in rosslt.get_param('/steady')]
        get_values = rospy.ServiceProxy('~rosslt/get_values', GetValues, persistent=True)
        for number in range(1, 6):
            rospy.set_param('/steady', [float(number)] * 100)
            answer = get_values(ids)
            while json.loads(answer.values[-1]) != number:
                self.assertFalse(any(answer.reasons))
                answer = get_values(ids)

    def test_a_default_that_is_a_dict_is_set_whole_and_keeps_changes(self):
        default = {'a': 1.0, 'b': {'c': 2.0}}
        rosslt.force_value(rosslt.get_param('~tree', default)['b']['c'], 5.0)
        self.assertEqual(rospy.get_param('~tree'), {'a': 1.0, 'b': {'c': 5.0}})
        self.assertEqual(rosslt.get_param('~tree', default), {'a': 1.0, 'b': {'c': 5.0}})
        rosslt.force_value(rosslt.get_param('~tree', default)['a'], 3.0)
        self.assertEqual(rosslt.get_param('~tree', default), {'a': 3.0, 'b': {'c': 5.0}})
        self.assertEqual(rospy.get_param('~tree'), {'a': 3.0, 'b': {'c': 5.0}})

    def test_a_part_of_a_tree_that_is_deleted_or_added_is_so_for_the_node(self):
        rospy.set_param('/family', {'a': 1.0, 'b': 2.0})
        gone = rosslt.get_param('/family')['b']
        rospy.delete_param('/family/b')
        wait_until(lambda: rosslt.get_param('/family') == {'a': 1.0}, 'it is deleted')
        with self.assertRaisesRegex(rosslt.ChangeRejected, 'has no location'):
            rosslt.force_value(gone, 3.0)
        rospy.set_param('/family/c', {'d': 4.0})
        wait_until(lambda: rosslt.get_param('/family') == {'a': 1.0, 'c': {'d': 4.0}}, 'it is added')
        rosslt.force_value(rosslt.get_param('/family')['c']['d'], 5.0)
        self.assertEqual(rospy.get_param('/family'), {'a': 1.0, 'c': {'d': 5.0}})

    def test_a_deleted_parameter_is_its_default_again(self):
        rospy.set_param('/comes_and_goes', 3.0)
        self.assertEqual(rosslt.get_param('/comes_and_goes', 0.5), 3.0)
        rospy.delete_param('/comes_and_goes')
        wait_until(lambda: rosslt.get_param('/comes_and_goes', 0.5) == 0.5, 'it is deleted')
        self.assertEqual(rosslt.get_param('/comes_and_goes', 7.5), 7.5)
        with self.assertRaises(KeyError):
            rosslt.get_param('/comes_and_goes')
        rosslt.force_value(rosslt.get_param('/comes_and_goes', 0.5), 2.0)
        self.assertEqual(rospy.get_param('/comes_and_goes'), 2.0)
        self.assertEqual(rosslt.get_param('/comes_and_goes', 7.5), 2.0)

    def test_an_infinite_parameter_reads_as_such_and_is_a_source_where_it_is_finite(self):
        rospy.set_param('/unlimited', math.inf)
        self.assertEqual(rosslt.get_param('/unlimited'), math.inf)
        rospy.set_param('/limit', 1.0)
        limit = rosslt.get_param('/limit')
        rosparam('set', '/limit', '.inf')
        wait_until(lambda: rosslt.get_param('/limit') == math.inf, 'it is seen')
        listed = rospy.ServiceProxy('~rosslt/list_locations', ListLocations)
        self.assertNotIn('/limit', [one.name for one in listed(location_ids=[]).locations])
        for key in '/unlimited', '/limit':
            rospy.set_param(key, 2.0)
            wait_until(lambda key=key: rosslt.get_param(key) == 2.0, 'it is seen')
            rosslt.force_value(rosslt.get_param(key), 3.0)
        self.assertEqual([rospy.get_param('/unlimited'), rosslt.reevaluate(limit)], [3.0, 3.0])

    def test_names_that_no_parameter_can_have_are_read_as_without_tracking(self):
        default = {'a/b': 3.0, '': 4.0, 'a': {'b': 5.0}}
        read = rosslt.get_param('~odd', default)
        self.assertEqual(read, default)
        self.assertEqual([rosslt.is_tracked(read['a/b']), rosslt.is_tracked(read['a']['b'])], [False, True])

    def test_what_the_parameter_server_cannot_hold_is_refused(self):
        rospy.set_param('/held', {'text': 'a', 'count': 1})
        held = rosslt.get_param('/held')
        for value, target in ((held['text'], 'a\x01b'), (held['count'], 2**40)):
            with self.assertRaisesRegex(rosslt.ChangeRejected, 'the parameter server cannot hold'):
                rosslt.force_value(value, target)
        rosslt.force_value(held['text'], 'b\r\nc')
        self.assertEqual((rosslt.get_param('/held/text'), rospy.get_param('/held/text')), ('b\nc', 'b\nc'))
        self.assertFalse(rosslt.is_tracked(rosslt.get_param('~mask', 0xFFFF0000)))

    def test_a_locked_node_has_a_parameter_set_back(self):
        rospy.set_param('/kept', {'list': [1.0, 2.0], 'x': 1.0})
        rosslt.get_param('/kept')
        rosslt.get_param('~kept_default', 3.0)
        rospy.set_param('~rosslt/change_locks', [['', 'ada', 'it runs']])
        try:
            for value in ({'list': [1.0]}, 5.0, {'list': [1.0, 2.0], 'x': 3.0}):
                rospy.set_param('/kept', value)
                wait_until(lambda: rospy.get_param('/kept') == {'list': [1.0, 2.0], 'x': 1.0}, 'it is set back')
            rospy.set_param('~kept_default', 4.0)
            wait_until(lambda: rospy.get_param('~kept_default') == 3.0, 'it is set back')
            rospy.delete_param('/kept/list')
            wait_until(lambda: rospy.has_param('/kept/list'), 'it is set back')
        finally:
            rospy.set_param('~rosslt/change_locks', [])
            says = rospy.ServiceProxy('~rosslt/lock_locations', LockLocations)
            wait_until(lambda: not says(action='').locked_ids, 'it accepts changes again')
        self.assertEqual(rosslt.get_param('/kept'), {'list': [1.0, 2.0], 'x': 1.0})


class Restarts(unittest.TestCase):
    def test_a_changed_value_outlives_a_restart_until_the_literal_is_edited(self):
        with Node('edited', 'values = [rosslt.location(1.0)]' + SHOW) as node:
            source = rosslt.Source('/edited', int(node.read_line()))
            self.assertEqual(node.read_line(), '[1.0]')
            rosslt.force_value(rosslt.track(1.0, source), 5.0, timeout=20.0)
            node.stop()
            node.start()
            node.read_line()
            self.assertEqual(node.read_line(), '[5.0]')
            node.stop()
            node.write('values = [rosslt.location(2.0)]' + SHOW)
            node.start()
            node.read_line()
            self.assertEqual(node.read_line(), '[2.0]')
            self.assertRegex(node.log[-1], r'edited.py:7:11 now says 2.0 where it said 1.0: .* is dropped')

    def test_values_that_no_parameter_can_hold_outlive_a_restart_as_others_do(self):
        code = """
            values = [
                rosslt.location({}, name='mask'), rosslt.location('map', name='frame'), rosslt.location(2, name='count')
            ]
            """
        code = textwrap.dedent(code) + SHOW
        with Node('beyond', code.replace('{}', '0xFFFF0000')) as node:

            def shown():
                ids = [int(node.read_line()) for _ in range(3)]
                return ids, json.loads(node.read_line())

            ids, literals = shown()
            read = [rosslt.track(value, rosslt.Source('/beyond', one)) for value, one in zip(literals, ids)]
            rosslt.force_value(read, [0xFFFF00FF, 'a\x01b', 2**40])
            self.assertEqual(rospy.get_param('/beyond/rosslt/mask'), str(0xFFFF00FF))
            node.stop()
            node.start()
            self.assertEqual(shown(), (ids, [0xFFFF00FF, 'a\x01b', 2**40]))
            rosslt.force_value(read, [5, 'odom', 2**41])
            node.stop()
            rospy.set_param('/beyond/rosslt/mask', 7)
            node.start()
            self.assertEqual(shown(), (ids, [7, 'odom', 2**41]))
            node.stop()
            node.write(code.replace('{}', '0xFF'))
            node.start()
            self.assertEqual(shown(), (ids, [0xFF, 'odom', 2**41]))

    def test_a_stale_change_never_lands_on_another_literal_in_the_same_place(self):
        with Node('moved', 'values = [rosslt.location(1.0)]  # the speed' + SHOW) as node:
            stale = rosslt.track(1.0, rosslt.Source('/moved', int(node.read_line())))
            node.stop()
            node.write('heights = [rosslt.location(1.0)]\nvalues = heights' + SHOW)
            node.start()
            node.read_line()
            with self.assertRaisesRegex(rosslt.ChangeRejected, '/moved has no location'):
                rosslt.force_value(stale, 5.0)

    def test_a_node_with_two_thousand_locations_is_mirrored(self):
        code = """
            values = [rosslt.location(float(i), key=i, name='many') for i in range(2000)]
            print('ready', flush=True)
            rospy.spin()
            """
        with Node('many', code) as node:
            self.assertEqual(node.read_line(), 'ready')
            # by their names: the master cannot send a dictionary while it grows
            mirrored = re.compile(r'/many/rosslt/many/\d+$').match
            wait_until(lambda: len(list(filter(mirrored, rospy.get_param_names()))) == 2000, 'all are parameters')
            rospy.set_param('/many/rosslt/many/1999', 5.0)
            locations = rospy.ServiceProxy('/many/rosslt/list_locations', ListLocations)
            wait_until(lambda: locations().locations[1999].value == '5.0', 'the change is seen')


if __name__ == '__main__':
    import rostest

    rosslt.init_node('locations')
    rostest.rosrun('rosslt', 'locations', '__main__')
