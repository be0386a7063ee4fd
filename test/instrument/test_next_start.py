"""What a node read once, and keeps nothing of, changes at its next start: whoever asks is told so."""

import pytest
from geometry_msgs.msg import Point

from rosslt import node, values
from support.processes import Node, wait_until
from support.shell import failure, lines, rosslt
from support.unmodified import Listener, Unmodified

pytestmark = pytest.mark.rostest

LATE = 'takes effect at the next start, or when {} runs again: nothing that the node keeps came of it'

OWNER = """
    rate = rospy.Rate(rosslt.get_param('~rate', 20))
    kept = rosslt.location(3.0, name='kept')
    place = rosslt.location(0.0, name='start')
    where = rosslt.location({'x': 1.0}, name='where')
    gone = list(rosslt.location({'x': 1.0}, name='gone'))
    publisher = rosslt.Publisher('~place', Point, queue_size=1)
    while not rospy.is_shutdown():
        publisher.publish(kept, rosslt.location(1.0, name='read') * rosslt.get_param('~gain', 2.0), place)
        place = place + rosslt.location({'x': 0.5}, name='step')['x']
        rate.sleep()
    """

UNMODIFIED = """\
import rospy
from geometry_msgs.msg import Point

def said(number):
    return '%.1f' % number

SPEED = 2.0
said(7.5)
rospy.init_node('unmodified')
rate = rospy.Rate(rospy.get_param('~rate', 20))
limit = rospy.get_param('~limit', 3.0)
pub = rospy.Publisher('~place', Point, queue_size=1)
TIMES = 2
while not rospy.is_shutdown():
    if limit > 1.0:
        for _ in range(TIMES):
            pub.publish(SPEED / 4.0, rospy.get_param('~y', 1.0), 0.0)
    rate.sleep()
"""


PARTLY = """\
import rospy
from geometry_msgs.msg import Point

PAUSE = 0.5
rospy.init_node('partly')
ONCE = rospy.Duration(PAUSE * 2.0)

class Partly:
    def __init__(self):
        rate = rospy.get_param('~rate', 20.0)
        self.rate = rospy.Rate(rate)
        self.dt = 1.0 / rate
        self.period = rospy.get_param('~period', 0.05)
        self.start()
        self.pub = rospy.Publisher('~place', Point, queue_size=1)

    def start(self):
        self.wait = rospy.Duration(self.period)

    def run(self):
        while not rospy.is_shutdown():
            self.start()
            self.pub.publish(self.dt, self.period, PAUSE)
            self.rate.sleep()

rospy.Timer(rospy.Duration(1.0 / rospy.get_param('~watch', 2)), lambda event: None)
Partly().run()
"""

CONTROLLER = """\
import rospy
from geometry_msgs.msg import Point

class Pid:
    def __init__(self, gain):
        self.gain = gain
        self.offset = 0.5
        self.last = 0.25

    def update(self, error):
        self.last = error
        return self.gain * error + self.offset

class Controller:
    def __init__(self):
        self.pid = Pid(2.0)
        self.pub = rospy.Publisher('~place', Point, queue_size=1)

    def step(self):
        self.pub.publish(self.pid.update(4.0), self.pid.last, 0.0)

def main():
    rospy.init_node('controller')
    rate, controller = rospy.Rate(20), Controller()
    while not rospy.is_shutdown():
        controller.step()
        rate.sleep()

if __name__ == '__main__':
    main()
"""

COUNTED = """\
from collections import deque
import numpy as np
import rospy
from geometry_msgs.msg import Point

SHELVES = 3
EARLY = 2
COLUMNS = 4
ZEROS = 5
GRID = 6
LINE = 7
FILLED = 8
MODE = 2
ROUNDS = 9
BOTH = 2
AGAIN = 3
OTHER = 6
PHASES = 5
WINDOW = 20
LIMIT = 0.5

early = [i * 1.0 for i in range(EARLY)]

def doubled(count):
    return [2.0 * i for i in range(count)]

class Counted:
    def __init__(self):
        self.shelves = []
        for i in range(SHELVES + 1):
            self.shelves.append(i)
        self.row = [0.0] * COLUMNS
        self.zeros = np.zeros(ZEROS)
        self.grid = np.zeros((GRID, 2))
        self.line = np.linspace(0.0, 1.0, LINE)
        self.filled = []
        while len(self.filled) < FILLED:
            self.filled.append(0.0)
        if MODE == 2:
            self.gain = 2.0
        self.both = [0 for _ in range(BOTH)]
        self.window = deque(maxlen=WINDOW)
        self.again, self.other = doubled(AGAIN), doubled(OTHER)
        self.pub = rospy.Publisher('~place', Point, queue_size=1)

    def step(self, phase):
        count = sum(1 for _ in range(ROUNDS))
        if phase == 0:
            for _ in range(PHASES):
                pass
        both = len([0 for _ in range(BOTH)])
        doubled(AGAIN)
        if self.gain < LIMIT:
            count = 0
        self.pub.publish(self.gain * BOTH, count, len(self.shelves))

def main():
    rospy.init_node('counted')
    counted, rate, phase = Counted(), rospy.Rate(20), 0
    while True:
        counted.step(phase)
        phase += 1
        rate.sleep()

main()
"""


def late(name, *options):
    """{name of a location: the last column of `rosslt list`}."""
    return {line[0].split('/', 2)[2]: line[9] for line in lines('list', name, *options)}


def place(owner, name):
    return next(line[6] for line in lines('list', owner) if line[0].endswith('/' + name)).rsplit('/', 1)[-1]


def test_what_nothing_came_of_is_listed_as_such(master):
    with Node('late', OWNER):
        wait_until(lambda: 'step/x' in late('/late'), 'the first round')
        wait_until(lambda: late('/late')['start'], 'the start to have become a state')
        assert {name for name, why in late('/late').items() if why} == {'~rate', 'start', 'gone/x'}
        assert late('/late')['start'] == LATE.format(place('/late', 'start'))
        asked = rosslt('set', '/late/~rate', '30')
        assert asked.returncode == 0
        rated = f', but for rospy.Rate at {place("/late", "~rate").rsplit(":", 1)[0]}'
        assert asked.stderr == 'rosslt set: it ' + LATE.format(place('/late', '~rate')) + rated + '\n'
        assert rosslt('set', '/late/kept', '4').stderr == ''
        assert (
            'a change of /late/start ' + LATE.format(place('/late', 'start')) in rosslt('doctor', '/late/place').stdout
        )
        refused = failure('force', '/late/place/z', '1', '--source', '/late/start')
        assert LATE.format(place('/late', 'start')) in refused
        assert 'by now' not in refused


def test_a_drag_and_a_force_leave_it_alone(master):
    with Node('late', OWNER), Listener('late/place', Point) as heard:
        wait_until(lambda: late('/late').get('start'), 'the start to have become a state')
        limits = node.limits(values.sources(heard.next().z))
        assert {node.directory().of(source).local_name for source in limits['read_only']} == {'start'}


def test_an_unmodified_node_says_so_too(master, tmp_path):
    with Unmodified(tmp_path, 'unmodified', UNMODIFIED), Listener('unmodified/place', Point) as heard:
        heard.next()
        wait_until(lambda: '~y' in late('/unmodified'), 'the first round')
        found = late('/unmodified')
        assert {name for name, why in found.items() if why} == {'~rate', 'said'}
        assert found['~limit'] == found['SPEED'] == found['TIMES'] == found['~y'] == ''


def test_what_keeps_a_plain_copy_is_named_beside_the_rest(master, tmp_path):
    with Unmodified(tmp_path, 'partly', PARTLY), Listener('partly/place', Point) as heard:
        heard.next()
        said = 'rospy.{} at partly.py:{} takes it at the next start, or when that line runs again'.format
        of_rate, of_pause = said('Rate', 11), said('Duration', 6)
        wait_until(lambda: late('/partly').get('~rate') == of_rate, 'the first round')
        found = late('/partly')
        assert (found['PAUSE'], found['~period']) == (of_pause, '')  # the Duration of the period is made again
        assert 'nothing that the node keeps came of it, but for rospy.Duration at partly.py:26' in found['~watch']
        assert rosslt('set', '/partly/~period', '0.1').stderr == ''
        assert rosslt('set', '/partly/~rate', '10').stderr == f'rosslt set: {of_rate}; what else uses it follows\n'
        heard.comes(lambda message: message.x == 0.1)
        examined = rosslt('doctor', '/partly/place', '--time', '1').stdout
        assert f'of a change of /partly/~rate, {of_rate}' in examined
        assert '/partly/~rate' in next(line for line in examined.splitlines() if 'it comes from' in line)


BEHIND = """\
import rospy
from geometry_msgs.msg import Point

SPEED = 1.5
rospy.init_node('behind')
speed = rospy.get_param('~speed', SPEED)
pub = rospy.Publisher('~place', Point, queue_size=1)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    pub.publish(speed, 0.0, 0.0)
    rate.sleep()
"""


def test_a_default_of_a_parameter_that_is_set_has_no_effect(master, tmp_path):
    with Unmodified(tmp_path, 'behind', BEHIND):
        wait_until(lambda: 'SPEED' in rosslt('list', '/behind').stdout, 'it has begun')
        wait_until(lambda: 'takes effect at the next start' in late('/behind').get('SPEED', ''), 'the first round')
        rosslt('set', '/behind/~speed', '2.5')
        said = 'has no effect while the parameter /behind/speed is set, whose default it is'
        wait_until(lambda: late('/behind')['SPEED'] == said, 'the parameter to be set')
    with Unmodified(tmp_path, 'behind', BEHIND):
        wait_until(lambda: 'SPEED' in rosslt('list', '/behind').stdout, 'it has begun again')
        wait_until(lambda: late('/behind').get('SPEED') == said, 'the first round of another run')
        assert rosslt('set', '/behind/SPEED', '3').stderr == f'rosslt set: it {said}\n'


HOLDING = """\
import collections, functools, itertools, queue
import rospy
from geometry_msgs.msg import Point

STOPS = [(0.5, 0.25), (1.5, 1.25)]
LISTS = [[2.5, 2.25], [3.5, 3.25]]
SPEED = 4.5
ALONE = 5.5

@functools.lru_cache(maxsize=None)
def limit():
    return 2.0 * SPEED

class Holding:
    def __init__(self):
        self.stops = itertools.cycle(STOPS)
        self.todo = queue.Queue()
        self.todo.put({ALONE})
        self.lists = itertools.cycle(LISTS)
        self.turns = collections.deque(LISTS)
        self.passed = queue.Queue()

    def step(self):
        for drawn in STOPS:
            self.passed.put(drawn)
            pub.publish(*drawn, 0.0)
        gone.publish(*next(self.stops), limit())
        pub.publish(*next(self.lists), self.turns[0][0] + SPEED)

rospy.init_node('holding')
pub, gone = [rospy.Publisher(name, Point, queue_size=1) for name in ('~place', '~gone')]
rate, holding = rospy.Rate(20), Holding()
while not rospy.is_shutdown():
    holding.step()
    rate.sleep()
"""


def test_what_others_hold_is_named_if_it_follows_no_change(master, tmp_path):
    with Unmodified(tmp_path, 'holding', HOLDING):
        said = '{} holds values of it that follow no change'.format
        stops = said('stops (itertools.cycle)')
        wait_until(lambda: late('/holding').get('STOPS_1_0') == stops, 'the second stop has been gone to')
        found = late('/holding')
        assert found['STOPS_0_1'] == stops
        assert found['SPEED'] == said('limit (functools.lru_cache_wrapper)')
        assert 'nothing that the node keeps came of it, but for todo (queue.Queue)' in found['ALONE']
        assert found['LISTS_0_0'] == found['LISTS_1_1'] == ''
        result = rosslt('set', '/holding/STOPS_1_0', '1.75')
        assert result.stderr == f'rosslt set: {stops}; what else uses it follows\n'
        old = ['x', '1.5', '1.75']  # as the message has it, and its source now
        wait_until(lambda: old in [[*line[:2], line[4]] for line in lines('explain', '/holding/gone')], 'an old stop')


def test_what_a_set_up_has_counted_or_decided_is_named(master, tmp_path):
    with Unmodified(tmp_path, 'counted', COUNTED), Listener('counted/place', Point) as heard:
        heard.next()

        def said(taker, text):
            line = next(number for number, one in enumerate(COUNTED.splitlines(), 1) if text in one)
            return f'{taker} at counted.py:{line} takes it at the next start, or when that line runs again'

        def said_alone(name, taker, text):
            taken = said(taker, text).split(' takes')[0]
            return f'{LATE.format(place("/counted", name))}, but for {taken}'

        of_both = said('range', 'self.both =')
        expected = {
            'SHELVES': said_alone('SHELVES', 'range', 'range(SHELVES'),
            'EARLY': said_alone('EARLY', 'range', 'early ='),
            'COLUMNS': said_alone('COLUMNS', 'the length of a list', 'self.row'),
            'ZEROS': said_alone('ZEROS', 'numpy.zeros', 'self.zeros'),
            'GRID': said_alone('GRID', 'numpy.zeros', 'self.grid'),
            'LINE': said('numpy.linspace', 'self.line'),
            'FILLED': said('while', 'while len'),
            'MODE': said_alone('MODE', 'if', 'if MODE'),
            'WINDOW': said_alone('WINDOW', 'collections.deque', 'self.window'),
            'BOTH': of_both,
            'OTHER': said_alone('OTHER', 'range', 'range(count)'),
            'ROUNDS': '',  # counted by it in each round
            'AGAIN': '',  # the line counts by it again in each round
            'PHASES': '',  # it may run again: it is in the loop
            'LIMIT': '',
        }
        wait_until(lambda: late('/counted').get('AGAIN') == '', 'the second round')
        found = late('/counted')
        assert {name: found[name] for name in expected} == expected
        follows = 'what else uses it follows\n'
        assert rosslt('set', '/counted/SHELVES', '4').stderr == f'rosslt set: it {expected["SHELVES"]}\n'
        assert rosslt('set', '/counted/FILLED', '9').stderr == f'rosslt set: {expected["FILLED"]}; {follows}'
        assert rosslt('set', '/counted/ROUNDS', '10').stderr == ''
        message = heard.comes(lambda message: message.y == 10.0)
        assert message.z == 4.0
        assert f'of a change of /counted/BOTH, {of_both}' in rosslt('doctor', '/counted/place', '--time', '1').stdout
        forced = rosslt('force', '/counted/place/x', '6', '--source', '/counted/BOTH')
        assert (forced.returncode, forced.stderr) == (
            0,
            f'rosslt force: of a change of /counted/BOTH, {of_both}; {follows}',
        )


def test_what_an_init_has_set_and_others_have_set_since_says_so(master, tmp_path):
    with Unmodified(tmp_path, 'controller', CONTROLLER), Listener('controller/place', Point) as heard:
        heard.next()
        wait_until(lambda: late('/controller').get('last'), 'the first round')
        assert {name for name, why in late('/controller').items() if why} == {'last'}
        assert LATE.format('controller.py:8:21') in rosslt('set', '/controller/last', '3').stderr
        for name in 'offset', 'pid':
            assert rosslt('set', '/controller/' + name, '1.0').stderr == ''
        heard.comes(lambda message: message.x == 5.0)


def test_numbers_that_shape_a_formula_are_listed_on_request(master, tmp_path):
    with Unmodified(tmp_path, 'unmodified', UNMODIFIED), Listener('unmodified/place', Point) as heard:
        heard.next()
        wait_until(lambda: '~y' in late('/unmodified'), 'the first round')
        more = late('/unmodified', '--all').keys() - late('/unmodified').keys()
        assert more == {'publish_0'}
        assert rosslt('set', '/unmodified/publish_0', '8').returncode == 0
        heard.comes(lambda message: message.x == 0.25)
        assert 'publish_0' in late('/unmodified')
