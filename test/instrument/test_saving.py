"""Changed values are written back into the files that they were read from, and edits of these files are taken in."""

import os
import random
import re
import subprocess

import pytest
import rospy
from geometry_msgs.msg import PointStamped
from rosgraph_msgs.msg import Log as RosoutMessage

import rosslt
from rosslt import files
from rosslt.node import changes_to_save
from support.processes import wait_until
from support.saving import change, is_whole, places, point, save
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
        self.frame = rospy.get_param('~frame', 'map')  # 'map'
        self.shown = rospy.get_param('~shown', True)

    def step(self):
        p = PointStamped()
        p.header.stamp = rospy.Time.now()
        p.header.frame_id = self.frame if self.shown else ''
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


def forget(name):
    """Have nothing of a node outlive it but its files, as after a restart of the master."""
    for key in ('rosslt', 'rosslt_records', 'far', 'frame', 'shown', 'goal'):
        if rospy.has_param(f'{name}/{key}'):
            rospy.delete_param(f'{name}/{key}')


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
        message = heard.next(is_whole)
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
        again = command('save', '/orbit')
        assert (again.returncode, again.stdout) == (0, '')
        assert again.stderr == 'rosslt save: nothing to save: all is as the files say\n'
        started.stop()
    forget('/orbit')
    with Unmodified(tmp_path, 'orbit', expected.decode()):
        assert point(heard.next()) == wanted


def test_a_diff_has_the_bytes_of_a_file_in_another_encoding(master, hearing, tmp_path):
    heard = hearing('orbit', PointStamped)
    code = ORBIT.replace('coding: utf-8', 'coding: latin-1').encode('latin-1')
    with Unmodified(tmp_path, 'orbit', code.decode('utf-8', 'surrogateescape')) as started:
        assert started.file.read_bytes() == code
        rosslt.force_value(heard.next(is_whole).point.x, -6.25)
        # In most languages Python writes UTF-8 and nothing else; in the one of the tests it is lenient.
        result = subprocess.run(
            ['rosslt', 'save', '--diff', '/orbit'],
            capture_output=True,
            check=False,
            env=dict(os.environ, PYTHONIOENCODING='utf-8:strict'),
        )
        assert (result.returncode, result.stderr) == (0, b'')
        assert b'\n+radius = 5.00   # in m, 2.50 \xe4\n' in result.stdout
        started.stop()


def test_many_changes_leave_every_other_byte_and_are_published_after_a_restart(master, hearing, tmp_path):
    heard, chance = hearing('orbit', PointStamped), random.Random(16)
    text, changes = ORBIT, 0
    rounds = 4 if os.environ.get('ROSSLT_MANY_EXAMPLES') else 1
    for _ in range(rounds):
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
                edits, unsaved = changes_to_save('/orbit', 2.0)
                called = {one.local_name for one in numbers if drawn.get(one.location.id, one.value) != one.value}
                assert ({one.what for one in edits}, unsaved) == (called, [])
                files.write(edits)
                after = started.file.read_bytes()
                assert numbers_blanked(after, started.file) == numbers_blanked(content, started.file)
            assert save('/orbit', '--diff') == ''
            now = rospy.Time.now()
            wanted = point(heard.next(lambda message, now=now: message.header.stamp > now))
            text = started.file.read_text(encoding='utf-8')
            started.stop()
        forget('/orbit')
        with Unmodified(tmp_path, 'orbit', text) as started:
            assert point(heard.next()) == pytest.approx(wanted, rel=1e-15)
            started.stop()
        forget('/orbit')
    assert changes == 250 * rounds


def test_texts_and_truth_values_are_written_where_they_were_read_and_published_again(master, hearing, tmp_path):
    heard = hearing('orbit', PointStamped)
    with Unmodified(tmp_path, 'orbit', ORBIT) as started:
        assert heard.next().header.frame_id == 'map'
        ids = {place.local_name: place.location.id for place in places('/orbit')}
        log = Log('/orbit')
        change('/orbit', {ids['~frame']: "robot's ä", ids['~far']: 8.0})
        assert save('/orbit').splitlines() == [
            f'/orbit/~far\t7.5\t8.0\t{started.file}',
            f"/orbit/~frame\t'map'\t\"robot's ä\"\t{started.file}",
        ]
        expected = ORBIT.replace("'~frame', 'map'", "'~frame', \"robot's ä\"").replace("'~far', 7.5", "'~far', 8.0")
        assert started.file.read_text(encoding='utf-8') == expected
        assert save('/orbit') == ''
        change('/orbit', {ids['~frame']: 'odom', ids['~shown']: False})
        assert len(save('/orbit').splitlines()) == 2
        expected = expected.replace('"robot\'s ä"', '"odom"').replace("'~shown', True", "'~shown', False")
        assert started.file.read_text(encoding='utf-8') == expected
        # What it has written itself is no edit; that of somebody else is taken in, though it comes at once.
        edit(started.file, ('radius = 2.50', 'radius = 4.0'), ("'~shown', False", "'~shown', True"))
        assert heard.next(lambda message: message.header.frame_id).header.frame_id == 'odom'
        log.wait_for('radius = 4.0')
        assert not [line for line in log.lines if 'changed in other ways' in line]
        change('/orbit', {ids['~frame']: 'base'})
        edit(started.file, ('"odom")', '"other")'))
        log.wait_for("frame = 'other'")
        assert save('/orbit') == ''
        started.stop()
    forget('/orbit')
    with Unmodified(tmp_path, 'orbit', started.file.read_text(encoding='utf-8')):
        assert heard.next().header.frame_id == 'other'


def test_lists_and_dicts_are_written_into_the_default_and_outlive_a_restart(master, hearing, tmp_path):
    goal = "rospy.get_param('~goal', {'at': [7.5, 1e3], 'frame': 'map'})"
    code = ORBIT.replace("rospy.get_param('~far', 7.5)", f"{goal}['at'][0]")
    heard = hearing('orbit', PointStamped)
    with Unmodified(tmp_path, 'orbit', code) as started:
        rosslt.force_value(heard.next(is_whole).point.z, 21.0)
        heard.next(lambda message: message.point.z == 21.0)
        assert rospy.get_param('/orbit/goal') == {'at': [12.5, 1e3], 'frame': 'map'}
        started.stop()
    with Unmodified(tmp_path, 'orbit', code, tracked=False) as plain:
        assert heard.next().point.z == 21.0
        plain.stop()
    with Unmodified(tmp_path, 'orbit', code) as started:
        assert heard.next().point.z == 21.0
        assert save('/orbit') == f'/orbit/~goal/at/0\t7.5\t12.5\t{started.file}\n'
        assert started.file.read_text(encoding='utf-8') == code.replace('7.5', '12.5')
        assert save('/orbit') == ''
        edit(started.file, ("'at': [12.5, 1e3]", "'at': [3.0, 1e3]"))
        heard.next(lambda message: message.point.z == 2.0)
        started.stop()
    forget('/orbit')


def edit(path, *pairs):
    """Save a text as an editor does: under another name first."""
    text = path.read_text(encoding='utf-8')
    for old, new in pairs:
        assert text.count(old) == 1
        text = text.replace(old, new)
    temporary = path.with_suffix('.tmp')
    temporary.write_text(text, encoding='utf-8')
    temporary.rename(path)


class Log:
    """What a node logs."""

    def __init__(self, name):
        self.lines = []
        self._name = name
        self._subscriber = rospy.Subscriber('/rosout', RosoutMessage, self._take)

    def _take(self, message):
        if message.name == self._name:
            self.lines.append(message.msg)

    def wait_for(self, text):
        wait_until(lambda: any(text in line for line in list(self.lines)), f'a log line with {text!r}', 60)
        return next(line for line in self.lines if text in line)


def test_edited_literals_take_effect_at_once_and_other_edits_are_named(master, hearing, tmp_path):
    heard, log = hearing('orbit', PointStamped), Log('/orbit')
    with Unmodified(tmp_path, 'orbit', ORBIT) as started:
        beginning = point(heard.next())
        edit(started.file, ('radius = 2.50', 'radius = 4.0'), ('-2, 5.]', '-2, 6.]  # taller'))
        heard.next(lambda message: point(message)[:2] == [-5.0, beginning[1] + 1.0])
        assert 'changed in other ways' not in log.wait_for('radius = 4.0')
        edit(
            started.file,
            ('import math\n', 'import math, os\n'),
            ('lift = 0.25', 'lift = 0.75'),
            ("'~far', 7.5", "'~far', 8.0"),
        )
        heard.next(lambda message: point(message) == [-5.0, beginning[1] + 2.5, beginning[2] + 1.0])
        assert log.wait_for('lift = 0.75').endswith(
            'from now on; line 4 and lines that are gone changed in other ways, which needs a restart of the node'
        )
        assert not rospy.has_param('/orbit/far')
        assert save('/orbit') == ''
        edit(started.file, ('lift = 0.75', 'lift = = 0.75'))
        log.wait_for('goes on with what was read before')
        assert started.process.poll() is None


def test_an_edit_while_the_node_starts_takes_effect(master, hearing, tmp_path):
    heard, gate = hearing('orbit', PointStamped), tmp_path / 'gate'
    os.mkfifo(gate)
    starting = Unmodified(tmp_path, 'orbit', "open('gate').close()\n" + ORBIT)
    with gate.open('w'):  # once the node opens it, its file has been loaded
        edit(starting.file, ('radius = 2.50', 'radius = 4.0'))
    with starting:
        heard.next(lambda message: point(message)[0] == -5.0)


def test_bounds_in_an_edited_comment_take_effect_at_once(master, hearing, tmp_path):
    heard, log = hearing('orbit', PointStamped), Log('/orbit')
    with Unmodified(tmp_path, 'orbit', ORBIT) as started:
        heard.next()
        edit(
            started.file,
            ('  # in m, 2.50', '  # rosslt: 1.5..3  # in m, 2.50'),
            ('lift = 0.25', 'lift = 0.25  # rosslt: ..1'),
        )
        log.wait_for('radius in 1.5..3, lift in ..1 from now on')
        assert command('set', '/orbit/radius', '4').stderr.endswith('4.0 is above its maximum 3\n')
        edit(started.file, ('radius = 2.50', 'radius = 4.0'), ('1.5..3', '1.5..5'), ('lift = 0.25', 'lift = 2.0'))
        log.wait_for(
            'radius in 1.5..5, radius = 4.0 from now on; not taken: 2.0 in line 13 (2.0 is above its maximum 1)'
        )
        edit(started.file, ('  # rosslt: 1.5..5', ''))
        log.wait_for('radius without bounds from now on')
        edit(started.file, ('lift = 2.0  # rosslt: ..1', 'lift = 0.5  # rosslt: ..1e'))
        assert "'1e' in a comment `# rosslt:` is not a number" in log.wait_for(
            'lift = 0.5 from now on; not taken: bounds'
        )
        assert command('set', '/orbit/radius', '40').stderr == ''


def test_what_is_called_on_the_value_of_a_parameter_is_not_its_default(master, hearing, tmp_path):
    heard, log = hearing('orbit', PointStamped), Log('/orbit')
    code = ORBIT.replace("'~frame', 'map')", "'~frame', 'map').replace('/', '_')")
    with Unmodified(tmp_path, 'orbit', code) as started:
        assert heard.next().header.frame_id == 'map'
        edit(started.file, ("replace('/', '_')", "replace('/', '-')"))
        log.wait_for('changed in other ways')
        (frame,) = [place for place in places('/orbit') if place.local_name == '~frame']
        assert frame.value == 'map'
        edit(started.file, ("replace('/', '-')", "replace('/', '_')"))
        change('/orbit', {frame.location.id: 'odom'})
        assert save('/orbit') == f"/orbit/~frame\t'map'\t'odom'\t{started.file}\n"
        assert started.file.read_text(encoding='utf-8') == code.replace("'map')", "'odom')", 1)
        started.stop()


def test_a_default_that_is_a_name_is_set_at_its_literal(master, hearing, tmp_path):
    code = """#!/usr/bin/env python3
import rospy
from geometry_msgs.msg import PointStamped
GOAL = [3.0, 1.0]
rospy.init_node('named')
goal_x = rospy.get_param('~goal_x', GOAL[0])
publisher = rospy.Publisher('named', PointStamped, queue_size=1)
while not rospy.is_shutdown():
    message = PointStamped()
    message.point.x, message.point.y = goal_x, GOAL[1]
    publisher.publish(message)
    rospy.sleep(0.03)
"""
    heard = hearing('named', PointStamped)
    with Unmodified(tmp_path, 'named', code) as started:
        heard.next()
        assert command('set', '/named/~goal_x', '5').returncode == 0
        result = command('save', '/named')
        assert result.returncode == 1
        assert 'its default at named.py:6:10 comes from GOAL_0: set that as well' in result.stderr
        assert command('set', '/named/GOAL_0', '5').returncode == 0
        command('save', '/named')
        assert started.file.read_text() == code.replace('[3.0', '[5.0')


def test_a_number_that_somebody_has_edited_is_mapped_or_refused(master, hearing, tmp_path):
    """A node written with rosslt, which takes in no edits while it runs."""
    code = """
import rospy, rosslt
from geometry_msgs.msg import PointStamped
rosslt.init_node('tracked')
pub = rosslt.Publisher('tracked', PointStamped, queue_size=1)
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x = rosslt.location(2.50, name='x')
    p.point.y = rosslt.location(value=3, name='y') * 1.0
    p.point.z = sum(rosslt.location(.5, name='z', key=leg) for leg in 'ab')
    p.header.frame_id = rosslt.location('map', name='frame')
    frames = [rosslt.location('in ' 'two', name='two'), rosslt.location(True, name='on')]
    pub.publish(p)
    rospy.sleep(0.03)
"""
    heard = hearing('tracked', PointStamped)
    with Unmodified(tmp_path, 'tracked', code, tracked=False) as started:
        heard.next()
        ids = {place.local_name: place.location.id for place in places('/tracked')}
        change('/tracked', {ids['x']: 4.0, ids['y']: 7, ids['z/a']: 1.5, ids['frame']: 'odom'})
        change('/tracked', {ids['two']: 'in one', ids['on']: False})
        result = command('save', '/tracked')
        assert result.returncode == 1
        assert 'z/a (what stands at tracked.py:10:21 is that of several locations, with other values)' in result.stderr
        assert 'two (it is not a number, a truth value or a text in one piece on a line of its own' in result.stderr
        text = started.file.read_text()
        expected = code.replace('2.50', '4.00').replace('value=3', 'value=7')
        assert text == expected.replace("'map'", "'odom'").replace('True', 'False')
        change('/tracked', {ids['x']: 5.0, ids['y']: 9, ids['z/a']: 0.5, ids['frame']: 'base'})
        edit(started.file, ('import rospy, rosslt', 'import rosslt\n\nimport rospy'), ('value=7', 'value=8'))
        result = command('save', '/tracked')
        assert result.returncode == 1
        assert 'was edited since it was read or saved: ' in result.stderr
        assert 'says 8 now' in result.stderr
        assert 'location(5.00, name' in started.file.read_text()
        assert "location('base', name" in started.file.read_text()
        assert 'value=8' in started.file.read_text()
