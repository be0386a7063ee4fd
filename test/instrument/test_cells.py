"""The locations of literals: made known while others are changed, and read in a file that is loaded again."""

import threading

import pytest

from rosslt import node, values
from rosslt.instrument import cells
from rosslt.instrument.tree_rewriting import CELLS
from support.programs import run_rewritten
from support.shell import rosslt as command


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
    assert cell[0] == 2.5
    result = command(verb, *(['/test' + '/' + location.name] if verb == 'reset' else []))
    assert (result.returncode, result.stderr) == (0, '')
    assert (type(values.untracked(cell[0])), cell[0]) == (int, 2)
    node.force_value(cell[0] * 1.0, 4.5)
    assert cell[0] == 4.5


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


def test_an_edited_module_that_is_loaded_again_says_what_its_file_says_and_the_first_one_keeps_its_changes(
    master, tmp_path
):
    path = str(tmp_path / 'settings_of_it.py')
    first = run_rewritten('SPEED = 1.5\n', path)
    assert run_rewritten('SPEED = 1.5\n', path)[CELLS] is first[CELLS]
    node.force_value(first['SPEED'], 1.75)
    again = run_rewritten('OTHER = 9.5\nSPEED = 1.625\n', path)
    assert (again['OTHER'], again['SPEED'], first[CELLS][0]) == (9.5, 1.625, 1.75)
    assert not values.is_tracked([again['OTHER'], again['SPEED']])
