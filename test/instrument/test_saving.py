"""Changed values are written back into the files that they were read from, and edits of these files are taken in."""

import random
import re

import pytest
import rospy
from geometry_msgs.msg import PointStamped

import rosslt
from rosslt import files, node
from support.processes import wait_until
from support.shell import rosslt as command
from support.unmodified import Unmodified

ORBIT = '''#!/usr/bin/env python3
# -*- coding: utf-8 -*-
"""A point, written in many manners."""
import math
import rospy
from geometry_msgs.msg import PointStamped

radius = 2.50   # in m, 2.50 ä
heights = [1e-3, .5, -2, 5.]


def offset(scale):
    lift = 0.25
    return scale * lift + 1


class Orbit:
    def __init__(self):
        self.gain = -1.25
        self.pub = rospy.Publisher('orbit', PointStamped, queue_size=1)
        self.far = rospy.get_param('~far', 7.5)

    def step(self):
        p = PointStamped()
        p.point.x = radius * self.gain
        p.point.y = sum(heights) + offset(3.0)
        p.point.z = self.far * 2 - 4
        self.pub.publish(p)


rospy.init_node('orbit')
orbit = Orbit()
while not rospy.is_shutdown():
    orbit.step()
    rospy.sleep(0.03)
'''


class Hearing:
    """What arrives on a topic."""

    def __init__(self, topic, kind):
        self.messages = []
        self._subscriber = rosslt.Subscriber(topic, kind, self.messages.append, queue_size=10)

    def next(self, condition=lambda message: True):
        """The next message that begins after now and for which a condition holds."""
        del self.messages[:]
        found = []

        def look():
            found.extend(message for message in list(self.messages[1:]) if condition(message))
            return found

        wait_until(look, 'a message', 60)
        return found[0]

    def stop(self):
        self._subscriber.unregister()


@pytest.fixture
def hearing(master):
    made = []

    def hear(topic, kind):
        made.append(Hearing(topic, kind))
        return made[-1]

    yield hear
    for one in made:
        one.stop()


def point(message):
    return [float(value) for value in (message.point.x, message.point.y, message.point.z)]


def save(name, *options):
    result = command('save', *options, name)
    assert result.returncode == 0, result.stderr
    return result.stdout


def forget(name):
    """Have nothing of a node outlive it but its files, as after a restart of the master."""
    for key in ('rosslt', 'rosslt_literals', 'far'):
        if rospy.has_param(f'{name}/{key}'):
            rospy.delete_param(f'{name}/{key}')


def places(name):
    found, silent = node.Directory().ask([name])
    assert not silent
    return found[name]


def change(name, values):
    """Set locations of a node at once: {id: value}."""
    from rosslt import srv

    request = srv.ChangeSourcesRequest(list(values), [node.to_json(value) for value in values.values()], 'test')
    answer = rospy.ServiceProxy(name + '/rosslt/change_sources', srv.ChangeSources)(request)
    assert answer.applied, answer.reasons


def numbers_blanked(content, path):
    """All bytes of a file but those of its numbers."""
    made, parts, place = files.SourceText(str(path), content), [], 0
    for number in made.numbers:
        start, end = (len(made.text[:one].encode()) for one in (number.start, number.end))
        parts.append(content[place:start])
        place = end
    return [*parts, content[place:]]


def test_what_was_dragged_is_written_where_it_was_read_and_published_again(master, hearing, tmp_path):
    heard = hearing('orbit', PointStamped)
    with Unmodified(tmp_path, 'orbit', ORBIT) as started:
        before = started.file.read_bytes()
        message = heard.next()
        rosslt.force_value(message.point.x, -6.25)
        rosslt.force_value(message.point.z, 21.0)
        wanted = point(heard.next(lambda message: point(message)[0] == -6.25 and point(message)[2] == 21.0))
        diff = save('/orbit', '--diff')
        assert started.file.read_bytes() == before
        assert re.findall(r'^[-+] *(\w.*)$', diff, re.MULTILINE) == [
            'radius = 2.50   # in m, 2.50 ä',
            'radius = 5.00   # in m, 2.50 ä',
            "self.far = rospy.get_param('~far', 7.5)",
            "self.far = rospy.get_param('~far', 12.5)",
        ]
        assert save('/orbit').splitlines() == [
            f'/orbit/radius\t2.50\t5.00\t{started.file}',
            f'/orbit/~far\t7.5\t12.5\t{started.file}',
        ]
        expected = before.replace(b'radius = 2.50', b'radius = 5.00').replace(b'7.5', b'12.5')
        assert started.file.read_bytes() == expected
        assert save('/orbit') == ''
        started.stop()
    forget('/orbit')
    with Unmodified(tmp_path, 'orbit', expected.decode()):
        assert point(heard.next()) == wanted


def test_a_thousand_changes_leave_every_other_byte_and_are_published_after_a_restart(master, hearing, tmp_path):
    heard, chance = hearing('orbit', PointStamped), random.Random(16)
    text, changes = ORBIT, 0
    for _ in range(4):
        with Unmodified(tmp_path, 'orbit', text) as started:
            heard.next()
            for _ in range(25):
                content = started.file.read_bytes()
                numbers = [place for place in places('/orbit') if place.location.type == 'float']
                assert len(numbers) >= 10
                drawn = {
                    place.location.id: chance.choice(
                        [chance.uniform(-9, 9), round(chance.uniform(-9, 9), 2), float(chance.randint(-9, 9))]
                    )
                    for place in chance.sample(numbers, 10)
                }
                change('/orbit', drawn)
                changes += len(drawn)
                save('/orbit')
                assert numbers_blanked(started.file.read_bytes(), started.file) == numbers_blanked(content, started.file)
                assert save('/orbit', '--diff') == ''
            heard.next()
            wanted = point(heard.next())
            text = started.file.read_text(encoding='utf-8')
            started.stop()
        forget('/orbit')
        with Unmodified(tmp_path, 'orbit', text) as started:
            assert point(heard.next()) == pytest.approx(wanted, rel=1e-15)
            started.stop()
        forget('/orbit')
    assert changes == 1000
