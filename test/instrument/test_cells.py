"""The locations of literals: made known while others are changed, and read in a file that is loaded again."""

import threading

import pytest
from geometry_msgs.msg import Point, PointStamped

from rosslt import node, values
from rosslt.instrument import cells
from rosslt.instrument.tree_rewriting import CELLS
from rosslt.node import refresh
from support.programs import run_rewritten
from support.shell import rosslt as command
from support.unmodified import Listener, Unmodified


def test_one_literal_is_made_known_while_another_one_is_changed(master, tmp_path, monkeypatch):
    names = run_rewritten('unread = 1.5\nsent = 2.5\n', str(tmp_path / 'both.py'))
    location = names[CELLS].location(0)
    is_made_known, is_changed = threading.Event(), threading.Event()
    add, put = node.add_literal, cells.CellLocation.put

    def add_slowly(added):
        is_made_known.set()
        is_changed.wait(1.0)  # it cannot be, where both take turns
        return add(added)

    def put_noticed(changed, value):
        if changed is location:
            is_changed.set()
        put(changed, value)

    def change():
        is_made_known.wait(30)
        node.reread(location, 1.75)

    monkeypatch.setattr(node, 'add_literal', add_slowly)
    monkeypatch.setattr(cells.CellLocation, 'put', put_noticed)
    known = []
    threads = [
        threading.Thread(target=change, daemon=True),
        threading.Thread(target=lambda: known.extend(values.sources(names['sent'])), daemon=True),
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
        assert not thread.is_alive()
    assert (location.value, len(known)) == (1.75, 1)


@pytest.mark.parametrize('verb', ['undo', 'reset'])
def test_an_int_that_is_what_the_code_says_again_is_read_as_such_and_takes_fractions_again(master, tmp_path, verb):
    names = run_rewritten(f'{verb}_one = 2\n', str(tmp_path / 'whole.py'))
    read, cell = names[verb + '_one'], names[CELLS]
    location = cell.location(0)
    node.force_value(read * 1.0, 2.5)
    assert (cell[0], refresh.Refresher().fresh(Point(x=read)).x) == (2.5, 2.5)
    result = command(verb, *(['/test' + '/' + location.name] if verb == 'reset' else []))
    assert (result.returncode, result.stderr) == (0, '')
    assert (type(values.untracked(cell[0])), cell[0]) == (int, 2)
    for again, target in ((refresh.Refresher().fresh(Point(x=read)).x, 3.5), (cell[0], 4.5)):
        node.force_value(again * 1.0, target)
        assert cell[0] == target


def test_literals_of_one_name_at_the_same_position_of_several_files_are_all_locations(master, tmp_path):
    read = [run_rewritten('pace = 1.5\n', str(tmp_path / f'{name}.py'))['pace'] for name in ('one', 'two', 'three')]
    for number, one in enumerate(read):
        (change,) = node.force_value(one, 2.0 + number).values()
        assert change.new == 2.0 + number


def test_an_edit_that_was_taken_in_does_not_undo_what_was_changed_since(master, tmp_path):
    names = run_rewritten('sent = 1.5\n', str(tmp_path / 'edited.py'))
    location = names[CELLS].location(0)
    assert node.reread(location, 1.75)
    node.force_value(names['sent'], 2.0)
    assert not node.reread(location, 1.75)
    assert location.value == 2.0
    assert node.reread(location, 1.5)
    assert location.value == 1.5


RELOADING = """
import importlib
import os
import rospy
from geometry_msgs.msg import PointStamped
import settings_of_it
rospy.init_node('reloading')
pub = rospy.Publisher('reloading', PointStamped, queue_size=1)
held = settings_of_it.SPEED
other = settings_of_it.OTHER
while not rospy.is_shutdown():
    if os.path.exists('again'):
        os.remove('again')
        importlib.reload(settings_of_it)
        other = settings_of_it.OTHER
    p = PointStamped()
    p.point.x = settings_of_it.SPEED
    p.point.y = held
    p.point.z = other
    pub.publish(p)
    rospy.sleep(0.03)
"""


def test_what_was_changed_holds_and_changes_take_effect_in_a_module_that_is_loaded_again(master, tmp_path):
    settings = tmp_path / 'settings_of_it.py'
    settings.write_text('SPEED = 1.5\nOTHER = 2.5\n')
    with Unmodified(tmp_path, 'reloading', RELOADING), Listener('reloading', PointStamped) as heard:

        def comes(*point):
            return heard.comes(lambda message: (message.point.x, message.point.y, message.point.z) == point).point

        def set_speed(value):
            result = command('set', '/reloading/SPEED', str(value))
            assert result.returncode == 0, result.stderr

        comes(1.5, 1.5, 2.5)
        set_speed(1.75)
        comes(1.75, 1.75, 2.5)
        settings.write_text('# Edited.\nOTHER = 9.5\nNEW = 0.5\nSPEED = 1.5\n')
        (tmp_path / 'again').touch()
        comes(1.75, 1.75, 9.5)
        set_speed(4.25)
        comes(4.25, 4.25, 9.5)
        settings.write_text('OTHER = 7.5\nSPEED = 1.625\n')
        (tmp_path / 'again').touch()
        point = comes(1.625, 1.625, 7.5)
        node.force_value(point.x, 2.0)
        node.force_value(point.z, 8.0)
        comes(2.0, 2.0, 8.0)
