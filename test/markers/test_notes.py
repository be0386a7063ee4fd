"""Texts beside handles in RViz."""

from types import SimpleNamespace

from rosslt.markers.geometry import IDENTITY
from rosslt.markers.rviz.notes import WIDTH, Notes


def note(text):
    """The lines of a note."""
    inserted = []
    server = SimpleNamespace(insert=lambda marker, _feedback: inserted.append(marker), erase=None)
    notes = Notes(0.2)
    notes.put(SimpleNamespace(name='thing', frame='world', pose=(0.0, 0.0, 0.0, *IDENTITY), size=0.5), text)
    assert notes.update(server)
    (marker,) = inserted
    return marker.controls[0].markers[0].text.split('\n')


def test_the_lines_of_a_note_are_short_so_that_the_window_does_not_cut_them():
    reason = 'cannot be changed: 7.5 is above the maximum 5.0 that the node has given it'
    assert ' '.join(note(reason)) == reason
    assert max(map(len, note(reason))) <= WIDTH


def test_a_path_of_a_file_is_broken_into_lines_too():
    path = '/home/somebody/workspaces/robot/src/planner/scripts/planner.py:48:24'
    assert ''.join(note(path)) == path
    assert max(map(len, note(path))) <= WIDTH
