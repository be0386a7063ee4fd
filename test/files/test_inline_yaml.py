"""Numbers in the YAML within launch files are written where they stand, or not at all."""

import pytest

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


def edited(content, nth, path, said, value):
    """The launch file afterwards, and what could not be written."""
    edits, left = files.inline_edits('a.launch', content, nth, 3, [files.YamlChange(path, [said], value, 'it')])
    for edit in edits:
        assert edit.digest == files.digest_of(content)
        assert content[edit.start : edit.end] == edit.old
        content = content[: edit.start] + edit.new + content[edit.end :]
    return content, left


def test_only_the_number_changes():
    content = LAUNCH.encode()
    after, left = edited(content, 1, ['gain'], 1.5, 3.25)
    assert (after, left) == (content.replace(b"'x>y'>gain: 1.50", b"'x>y'>gain: 3.25"), [])
    after, left = edited(content, 2, [1], 2.5, 4.75)
    assert (after, left) == (content.replace(b'[1, 2.50,', b'[1, 4.75,'), [])


def test_line_ends_of_other_systems_stay():
    content = LAUNCH.replace('\n', '\r\n').encode()
    after, left = edited(content, 2, [2], 3, 7)
    assert (after, left) == (content.replace(b'     3]', b'     7]'), [])


def test_where_one_came_or_went_none_is_written():
    content = LAUNCH.replace('<rosparam file="other.yaml" command="load"/>', '').encode()
    after, left = edited(content, 1, ['gain'], 1.5, 2.25)
    assert after == content
    assert 'it is not certain which <rosparam> of a.launch' in left[0][1]


@pytest.mark.parametrize(
    'now', ['gain: 1.75', 'gain: 1.50 # &lt;', '<![CDATA[gain: 1.50]]>', 'gain: <!-- b -->1.50', '', 'other: 1.50']
)
def test_a_text_that_was_edited_or_is_written_in_another_way_is_left(now):
    content = LAUNCH.replace("'x>y'>gain: 1.50", f"'x>y'>{now}").encode()
    after, left = edited(content, 1, ['gain'], 1.5, 3.25)
    assert after == content
    assert [what for what, _ in left] == ['it']


def test_what_is_no_launch_file_any_more_is_an_error():
    with pytest.raises(files.FileError, match=r'a\.launch:1'):
        edited(b'<launch><rosparam>a: 1</launch>', 0, ['a'], 1, 2)


WORDS = """<launch>
  <rosparam>frame: map  # 1.50
    # ä
gain: 1.50
on: [yes, "map"]</rosparam>
</launch>
"""


def test_texts_and_truth_values_are_written():
    content = WORDS.encode()
    changes = [
        files.YamlChange(['frame'], ['map'], 'odom', 'frame'),
        files.YamlChange(['on', 0], [True], False, 'on/0'),
        files.YamlChange(['on', 1], ['map'], 'it is', 'on/1'),
    ]
    edits, left = files.inline_edits('a.launch', content, 0, 1, changes)
    expected = WORDS.replace('frame: map', 'frame: odom').replace('yes, "map"', 'no, "it is"')
    assert (files.replaced(content, edits).decode(), left) == (expected, [])


def test_a_text_may_have_what_xml_takes_as_it_is():
    content = b'<launch><rosparam>frame: "map"</rosparam></launch>'
    change = files.YamlChange(['frame'], ['map'], 'a > b', 'frame')
    edits, left = files.inline_edits('a.launch', content, 0, 1, [change])
    assert (files.replaced(content, edits), left) == (content.replace(b'map', b'a > b'), [])


@pytest.mark.parametrize(
    ('head', 'value'), [('', 'a<b'), ('', 'a & b'), ('', ']]>'), ('<?xml version="1.0" encoding="iso-8859-1"?>', 'ä')]
)
def test_a_text_that_xml_would_read_as_something_else_is_left(head, value):
    content = f'{head}<launch><rosparam>frame: map</rosparam></launch>'.encode()
    change = files.YamlChange(['frame'], ['map'], value, 'frame')
    edits, left = files.inline_edits('a.launch', content, 0, 1, [change])
    assert edits == []
    assert 'would need a notation of XML' in left[0][1]


def test_a_number_is_found_where_it_stands():
    content = LAUNCH.encode()
    (found,) = files.inline_places('a.launch', content, 1, 3, [['gain']])
    assert found == (content.index(b"'x>y'>gain: 1.50") + 12, content.index(b"'x>y'>gain: 1.50") + 16, 1.5)
    assert files.inline_places('a.launch', content, 2, 3, [[1], [7]])[1] is None
    assert files.inline_places('a.launch', content, 1, 4, [['gain'], ['gain']]) == [None, None]
