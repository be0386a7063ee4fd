"""What a state began with, once it has been stepped: no change of it reaches the state in this run."""

import pytest
import rospy
from geometry_msgs.msg import PointStamped

from rosslt import node, values
from support.programs import run_rewritten
from support.shell import failure, lines, rosslt
from support.unmodified import Listener, Unmodified

HOMER = """\
import numpy as np
import rospy
from geometry_msgs.msg import PointStamped

HOME = 0.5
START_X = 3.5
LINE = 4.5

class Place:
    __slots__ = ['x']

class Robot:
    def __init__(self):
        self.x = HOME
        self.__hidden = HOME
        self.slot = Place()
        self.slot.x = HOME
        self.message = PointStamped()
        self.message.point.z = HOME
        self.row = [HOME, HOME]
        self.table = {'x': HOME}
        self.array = self.same = np.array([HOME, HOME])
        self.cells = np.array([HOME, HOME])
        self.alone, self.line = START_X, np.array([LINE, 1.5])
        names = 'place', 'more', 'arrays', 'home'
        self.publishers = [rospy.Publisher(name, PointStamped, queue_size=1) for name in names]

    def send(self, *points):
        for publisher, point in zip(self.publishers, points):
            message = PointStamped()
            message.header.frame_id = 'map'
            message.point.x, message.point.y, message.point.z = point
            publisher.publish(message)

    def step(self):
        if self.x < 1.4:
            self.x += 0.1
        self.__hidden += 0.1
        self.slot.x += 0.1
        self.message.point.z += 0.1
        self.row[0] += 0.1
        self.table['x'] += 0.1
        self.array += np.array([0.1, 0.1])
        self.cells[0] += 0.1
        self.alone += 0.1
        self.line += np.array([0.1, 0.1])

    def run(self):
        rate = rospy.Rate(20)
        while not rospy.is_shutdown():
            if rospy.has_param('/is_on'):
                self.step()
            home = self.row[1] + self.cells[1], HOME, self.alone + self.line[0]
            more = self.message.point.z, self.row[0], self.table['x']
            self.send((self.x, self.__hidden, self.slot.x), more, (*self.same, self.cells[0]), home)
            rate.sleep()

rospy.init_node('homer')
Robot().run()
"""


def named(*numbers):
    sources = values.sources(numbers)
    node.directory().learn(sources, 10.0)
    return {node.directory().of(source).local_name for source in sources}


def point_of(message):
    return message.point.x, message.point.y, message.point.z


@pytest.mark.rostest
def test_a_state_leaves_its_start_when_it_is_stepped(master, tmp_path):
    with Unmodified(tmp_path, 'homer', HOMER), Listener('place', PointStamped) as place, Listener(
        'more', PointStamped
    ) as more, Listener('arrays', PointStamped) as arrays, Listener('home', PointStamped) as home:
        place.comes(lambda message: values.is_tracked(message.point.x))
        assert rosslt('set', '/homer/HOME', '0.75').stderr == ''
        for heard in place, more, arrays:  # nothing has been stepped yet
            assert named(*point_of(heard.comes(lambda message: set(point_of(message)) == {0.75}))) == {'HOME'}
        rospy.set_param('/is_on', True)
        for heard in place, more, arrays:
            message = heard.comes(lambda message: min(point_of(message)) > 1.4)
            assert not values.is_tracked(point_of(message))
        assert named(*point_of(home.comes(lambda message: values.is_tracked(message.point.y)))) == {
            'HOME',
            'START_X',
            'LINE',
        }
        before = lines('log', '/homer')
        assert 'nothing in it has a source' in failure('force', '/place/point/x', '2')
        assert lines('log', '/homer') == before
        refused = failure('force', '/home/point/z', '1')
        assert '/homer/START_X takes effect at the next start' in refused
        line = 1 + HOMER.splitlines().index('            self.x += 0.1')
        found = rosslt('doctor', '/place/point/x', '--time', '1').stdout
        assert f'homer.py:{line}: self.x += 0.1' in found
        assert rosslt('set', '/homer/HOME', '0.25').stderr == ''
        assert home.comes(lambda message: message.point.y == 0.25).point.x == 0.5
        assert place.next().point.x > 1.4


OWNERS = """\
class Meta(type):
    __hash__ = None

class Asked(metaclass=Meta):
    def __init__(self):
        self.said = []
        self.gone = 2.5

    @property
    def x(self):
        self.said.append('get')
        return 1.5

    @x.setter
    def x(self, value):
        self.said.append(value)

    def __getattr__(self, name):
        self.said.append(name)
        return 1.5

    def step(self, speed):
        self.x += speed
        self.other += speed
        self.kind += speed

class Numbers(list):
    def __getitem__(self, index):
        asked.said.append(index)
        return list.__getitem__(self, index)

asked = Asked()
asked.kind = numbers = Numbers([1.5, 2.5])
asked.kind = asked.gone
for speed in 0.5, 0.25:
    asked.step(speed)
    for i in 0, -1:
        numbers[i] += speed
x = [float(one) if type(one) is not str else one for one in asked.said], list(numbers)
"""


def test_only_the_statement_runs_code_of_the_node(monkeypatch):
    monkeypatch.setattr(node.MEMORY, 'has_begun', True)
    plain = {}
    exec(OWNERS, plain)
    assert repr(values.untracked(run_rewritten(OWNERS)['x'])) == repr(plain['x'])
