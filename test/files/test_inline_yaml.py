"""Numbers in the YAML within launch files are written where they stand, or not at all."""

import pytest
import yaml

from rosslt import files

LAUNCH = """<launch><!-- <rosparam>gain: 1.50</rosparam> -->
  <rosparam file="other.yaml" command="load"/>
  <node name="ä" pkg="a" type="b"><rosparam ns='x>y'>gain: 1.50</rosparam></node>
  <node name="c" pkg="a" type="b"><rosparam param="list">
    [1, 2.50,  # 2.50
     3]
  </rosparam></node>
</launch>
"""


def edited(content, nth, text, path, said, value):
    """The launch file afterwards, and what could not be written."""
    edits, left = files.inline_edits('a.launch', content, nth, 3, text, [files.YamlChange(path, [said], value, 'it')])
    for edit in edits:
        assert edit.digest == files.digest_of(content)
        assert content[edit.start : edit.end] == edit.old
        content = content[: edit.start] + edit.new + content[edit.end :]
    return content, left


def within(text, nth):
    """What roslaunch reads in one <rosparam>."""
    return text.split('<rosparam')[nth + 2].split('>', 2 if nth == 1 else 1)[-1].split('</rosparam')[0]


def test_only_the_number_changes():
    content = LAUNCH.encode()
    assert within(LAUNCH, 1) == 'gain: 1.50'
    after, left = edited(content, 1, 'gain: 1.50', ['gain'], 1.5, 3.25)
    assert (after, left) == (content.replace(b"'x>y'>gain: 1.50", b"'x>y'>gain: 3.25"), [])
    text = within(LAUNCH, 2)
    assert yaml.safe_load(text) == [1, 2.5, 3]
    after, left = edited(content, 2, text, [1], 2.5, 4.75)
    assert (after, left) == (content.replace(b'[1, 2.50,', b'[1, 4.75,'), [])


def test_line_ends_of_other_systems_stay():
    content = LAUNCH.replace('\n', '\r\n').encode()
    after, left = edited(content, 2, within(LAUNCH, 2), [2], 3, 7)
    assert (after, left) == (content.replace(b'     3]', b'     7]'), [])


def test_a_text_that_has_moved_is_found_where_it_is_certain():
    moved = LAUNCH.replace('<rosparam file="other.yaml" command="load"/>', '').encode()
    assert edited(moved, 1, 'gain: 1.50', ['gain'], 1.5, 2.25)[0] == moved.replace(b"y'>gain: 1.50", b"y'>gain: 2.25")


def test_of_several_with_the_same_text_the_one_that_was_read_is_written_or_none():
    again = '<node><rosparam>gain: 1.50</rosparam></node></launch>'
    twice = LAUNCH.replace('<rosparam file="other.yaml" command="load"/>', '').replace('</launch>', again).encode()
    after, _ = edited(twice, 2, 'gain: 1.50', ['gain'], 1.5, 2.25)
    assert after == twice.replace(b'<node><rosparam>gain: 1.50', b'<node><rosparam>gain: 2.25')
    thrice = twice.replace(b'<launch>', b'<launch><rosparam>other: 1</rosparam>')
    after, left = edited(thrice, 2, 'gain: 1.50', ['gain'], 1.5, 2.25)
    assert after == thrice
    assert 'was edited since it was loaded' in left[0][1]


@pytest.mark.parametrize(
    'now', ['gain: 1.75', 'gain: 1.50 # &lt;', '<![CDATA[gain: 1.50]]>', 'gain: <!-- b -->1.50', '', 'other: 1.50']
)
def test_a_text_that_was_edited_or_is_written_in_another_way_is_left(now):
    content = LAUNCH.replace("'x>y'>gain: 1.50", f"'x>y'>{now}").encode()
    after, left = edited(content, 1, 'gain: 1.50', ['gain'], 1.5, 3.25)
    assert after == content
    assert [what for what, _ in left] == ['it']


def test_what_is_no_launch_file_any_more_is_an_error():
    with pytest.raises(files.FileError, match=r'a\.launch:1'):
        edited(b'<launch><rosparam>a: 1</launch>', 0, 'a: 1', ['a'], 1, 2)


WORDS = """<launch>
  <rosparam>frame: map  # 1.50
    # ä
gain: 1.50
on: [yes, "map"]</rosparam>
</launch>
"""


def test_texts_and_truth_values_are_written_again_and_again():
    text, content = WORDS.split('<rosparam>')[1].split('</rosparam>')[0], WORDS.encode()
    changes = [
        files.YamlChange(['frame'], ['map', 'odom', 'ä'], 'odom', 'frame'),
        files.YamlChange(['on', 0], [True, False], False, 'on/0'),
        files.YamlChange(['on', 1], ['map', 'it is'], 'it is', 'on/1'),
    ]
    edits, left = files.inline_edits('a.launch', content, 0, 1, text, changes)
    saved = files.replaced(content, edits)
    expected = WORDS.replace('frame: map', 'frame: odom').replace('yes, "map"', 'no, "it is"')
    assert (saved.decode(), left) == (expected, [])
    again = [files.YamlChange(['frame'], ['map', 'odom'], 'ä', 'frame'), *changes[1:]]
    edits, left = files.inline_edits('a.launch', saved, 0, 1, text, again)
    assert (files.replaced(saved, edits).decode(), left) == (expected.replace('odom', 'ä'), [])
    # What is not to be changed is not to have been edited.
    edits, left = files.inline_edits('a.launch', saved, 0, 1, text, changes[:1])
    assert edits == []
    assert 'was edited since it was loaded' in left[0][1]


def test_a_text_may_have_what_xml_takes_as_it_is():
    content = b'<launch><rosparam>frame: "map"</rosparam></launch>'
    change = files.YamlChange(['frame'], ['map'], 'a > b', 'frame')
    edits, left = files.inline_edits('a.launch', content, 0, 1, 'frame: "map"', [change])
    assert (files.replaced(content, edits), left) == (content.replace(b'map', b'a > b'), [])


@pytest.mark.parametrize(
    ('head', 'value'), [('', 'a<b'), ('', 'a & b'), ('', ']]>'), ('<?xml version="1.0" encoding="iso-8859-1"?>', 'ä')]
)
def test_a_text_that_xml_would_read_as_something_else_is_left(head, value):
    content = f'{head}<launch><rosparam>frame: map</rosparam></launch>'.encode()
    change = files.YamlChange(['frame'], ['map'], value, 'frame')
    edits, left = files.inline_edits('a.launch', content, 0, 1, 'frame: map', [change])
    assert edits == []
    assert 'would need a notation of XML' in left[0][1]
