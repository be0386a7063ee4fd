"""Values of <param> tags are written where they stand, or not at all."""

import pytest

from rosslt import files

LAUNCH = """<launch>
  <param name="gain" value="1.50"/>
  <node name="a" pkg="p" type="t"><param name="x" value="2.50"/></node>
  <node name="b" pkg="p" type="t"><param name="x" value="2.50"/></node>
</launch>
"""


def edited(content, nth, name, text, said, value):
    """The launch file afterwards, and why not where it is the same."""
    change = files.ParamChange(nth, 3, name, text, said, value, float, 'it')
    edits, left = files.param_edits('a.launch', content.encode(), [change])
    for edit in edits:
        content = content[: edit.start] + edit.new.decode() + content[edit.end :]
    return content, left[0][1] if left else ''


def test_of_several_of_one_name_the_one_that_was_loaded_is_written_again_and_again():
    saved, _ = edited(LAUNCH, 1, 'x', '2.50', [2.5], 3.25)
    assert saved == LAUNCH.replace('2.50', '3.25', 1)
    again, _ = edited(saved, 1, 'x', '2.50', [2.5, 3.25], 4.75)
    assert again == saved.replace('3.25', '4.75')
    assert edited(again, 1, 'x', '2.50', [2.5, 3.25, 4.75], 2.5) == (LAUNCH, '')


@pytest.mark.parametrize('more', ['<param name="x" value="2.50"/>', '<param name="y" value="7"/>'])
def test_of_several_of_one_name_none_is_written_where_tags_came_or_went(more):
    content = LAUNCH.replace('<launch>', '<launch>' + more)
    assert edited(content, 1, 'x', '2.50', [2.5], 3.25) == (
        content,
        'it is not certain which <param name="x"> of a.launch it is since that was edited',
    )


def test_the_only_one_of_its_name_is_found_where_it_has_moved():
    content = LAUNCH.replace('<launch>', '<launch>\n  <param name="y" value="7"/>')
    assert edited(content, 0, 'gain', '1.50', [1.5], 2.25)[0] == content.replace('1.50', '2.25')


def test_what_somebody_has_edited_is_left():
    content = LAUNCH.replace('1.50', '9.0')
    assert edited(content, 0, 'gain', '1.50', [1.5, 2.25], 4.0) == (
        content,
        'it was edited since it was loaded: a.launch:2 says 9.0 instead of 1.50',
    )
