"""Values of <param> tags are written where they stand, or not at all."""

import functools
from xml.dom import minidom

import pytest
from roslaunch.loader import convert_value

from rosslt import files
from rosslt.node.locations.saving import _read_param

LAUNCH = """<launch>
  <param name="gain" value="1.50"/>
  <node name="a" pkg="p" type="t"><param name="x" value="2.50"/></node>
  <node name="b" pkg="p" type="t"><param name="x" value="2.50"/></node>
</launch>
"""


def edited(content, nth, name, said, value):
    """The launch file afterwards, and why not where it is the same."""
    change = files.AttributeChange(nth, 3, name, said, value, float, 'it')
    edits, left = files.attribute_edits('a.launch', content.encode(), [change])
    for edit in edits:
        content = content[: edit.start] + edit.new.decode() + content[edit.end :]
    return content, left[0][1] if left else ''


def test_of_several_of_one_name_the_one_that_was_loaded_is_written_again_and_again():
    saved, _ = edited(LAUNCH, 1, 'x', [2.5], 3.25)
    assert saved == LAUNCH.replace('2.50', '3.25', 1)
    again, _ = edited(saved, 1, 'x', [2.5, 3.25], 4.75)
    assert again == saved.replace('3.25', '4.75')
    assert edited(again, 1, 'x', [2.5, 3.25, 4.75], 2.5) == (LAUNCH, '')


@pytest.mark.parametrize('more', ['<param name="x" value="2.50"/>', '<param name="y" value="7"/>'])
def test_of_several_of_one_name_none_is_written_where_tags_came_or_went(more):
    content = LAUNCH.replace('<launch>', '<launch>' + more)
    assert edited(content, 1, 'x', [2.5], 3.25) == (
        content,
        'it is not certain which <param name="x"> of a.launch it is since that was edited',
    )


def test_the_only_one_of_its_name_is_found_where_it_has_moved():
    content = LAUNCH.replace('<launch>', '<launch>\n  <param name="y" value="7"/>')
    assert edited(content, 0, 'gain', [1.5], 2.25)[0] == content.replace('1.50', '2.25')


def test_what_somebody_has_edited_is_left():
    content = LAUNCH.replace('1.50', '9.0')
    assert edited(content, 0, 'gain', [1.5, 2.25], 4.0) == (
        content,
        'it was edited since it was loaded: a.launch:2 says 9.0 instead of 1.5',
    )


def with_word(attributes, text, value, kind='auto', head=''):
    """A launch file with another text or truth value, and why not where it is the same."""
    content = f'{head}<launch>\n  <!-- ä --><param name="f" {attributes}/> <!-- "{text}" -->\n</launch>\n'.encode()
    read = functools.partial(_read_param, convert_value, kind)
    said = minidom.parseString(content).getElementsByTagName('param')[0].getAttribute('value')
    change = files.AttributeChange(0, 1, 'f', [read(said)], value, read, 'it')
    edits, left = files.attribute_edits('a.launch', content, [change])
    after = files.replaced(content, edits)
    assert bool(edits) != bool(left)
    if edits:
        assert read(minidom.parseString(after).getElementsByTagName('param')[0].getAttribute('value')) == value
        (edit,) = edits
        assert content[edit.start - 1 : edit.end + 1].strip(b'\'"') == edit.old
        return edit.new.decode()
    return left[0][1]


@pytest.mark.parametrize(
    ('attributes', 'kind', 'value', 'expected'),
    [
        ('value="map"', 'auto', 'odom', 'odom'),
        ("value = 'map'", 'auto', 'it\'s "ä"', 'it&apos;s "ä"'),
        ('value="map"', 'auto', 'it\'s "ä"', "it's &quot;ä&quot;"),
        ('value="map"', 'auto', 'a<b & c>d', 'a&lt;b &amp; c&gt;d'),
        ('value="a&amp;b"', 'auto', 'b', 'b'),
        ('value="map"', 'auto', '', ''),
        ('type="str" value="map"', 'str', '5', '5'),
        ('type="str" value="map"', 'str', 'a\nb\tc', 'a&#10;b&#9;c'),
        ('type="yaml" value="map"', 'yaml', 'odom', 'odom'),
        ('type="yaml" value="map"', 'yaml', '5', "'5'"),
        ('type="yaml" value="map"', 'yaml', "a: b: 'c", "'a: b: ''c'"),
        ('value="true"', 'auto', False, 'false'),
        ('type="bool" value="1"', 'bool', False, '0'),
        ('type="boolean" value="FALSE"', 'boolean', True, 'TRUE'),
        ('type="yaml" value="on"', 'yaml', False, 'off'),
    ],
)
def test_texts_and_truth_values_are_written_as_roslaunch_reads_them(attributes, kind, value, expected):
    assert with_word(attributes, '', value, kind) == expected


@pytest.mark.parametrize(
    ('kind', 'value'),
    [
        ('auto', '5'),
        ('auto', ' map'),
        ('str', 'map\n'),
        ('auto', '$(env HOME)'),
        ('auto', 'a\0'),
        ('auto', '\ud800'),
    ],
)
def test_a_text_that_roslaunch_would_read_as_something_else_is_left(kind, value):
    assert with_word('value="map"', 'map', value, kind) == (
        f'{value!r} cannot be written in a.launch:2 so that roslaunch reads just that'
    )


@pytest.mark.parametrize(
    ('text', 'kind', 'value'),
    [('map', 'auto', 5), ('5', 'int', True), ('true', 'auto', 1), ('[1]', 'yaml', 'a'), ('[1]', 'yaml', 5)],
)
def test_a_value_of_another_kind_is_left(text, kind, value):
    assert 'is of another kind than' in with_word(f'value="{text}"', '', value, kind)


def test_in_a_file_of_another_encoding_other_characters_are_written_as_references():
    head = '<?xml version="1.0" encoding="iso-8859-1"?>'
    assert with_word('value="map"', '', 'ä☃', 'auto', head) == '&#228;&#9731;'


EDITED = 'it is not certain which <node name="c"> of a.launch it is since that was edited'


@pytest.mark.parametrize(
    ('args', 'word', 'after', 'why'),
    [
        ('1.50 0 0 0 0 0 base camera', 0, '4.50 0 0 0 0 0 base camera', ''),
        ('1.50 0 0.25 0 0 0 base camera', 0, '4.50 0 0.25 0 0 0 base camera', ''),
        ('1.50  0 0&#32;0 0 0 base camera', 1, '1.50  4.5 0&#32;0 0 0 base camera', ''),
        ('1.50 0 0 0 0 0 1 base camera', 3, None, EDITED),
        ('1.50 0 0 0 0 0 base laser', 0, None, EDITED),
        ('1.50 0 $(arg z) 0 0 0 base camera', 0, None, EDITED),
        (
            '1.50&#32;0&#32;0&#32;0 0 0 base camera',
            5,
            None,
            'the blanks in the arguments of a.launch:1 are written as entities',
        ),
    ],
)
def test_a_number_of_arguments_is_written_where_it_means_the_same(args, word, after, why):
    content = f'<launch><node name="c" args="{args}"/></launch>'
    change = files.AttributeChange(0, 1, 'c', [0.0, 1.5], 4.5, float, 'it', word, '1.50 0 0 0 0 0 base camera')
    edits, left = files.attribute_edits('a.launch', content.encode(), [change])
    assert files.replaced(content.encode(), edits).decode() == content.replace(args, after or args)
    assert [reason for _, reason in left] == [why][: after is None]


ARGS = """<launch>
  <include file="b.launch"><arg name="gain" value="2.50"/></include>
  <arg doc="default='2.50'" name="gain" default = '2.50'/>
</launch>
"""


@pytest.mark.parametrize(
    ('attribute', 'nth', 'content', 'after', 'why'),
    [
        ('value', 0, ARGS, ARGS.replace('"2.50"', '"4.50"'), ''),
        ('default', 1, ARGS, ARGS.replace(" = '2.50'", " = '4.50'"), ''),
        ('default', 0, ARGS, ARGS.replace(" = '2.50'", " = '4.50'"), ''),
        ('default', 1, ARGS.replace(" default = '2.50'", ''), None, 'it is not certain which <arg name="gain">'),
        ('value', 0, ARGS.replace('"2.50"', '"$(arg k)"'), None, '$(arg k)'),
    ],
)
def test_an_argument_of_a_launch_file_is_written_in_its_tag(attribute, nth, content, after, why):
    change = files.AttributeChange(nth, 2, 'gain', [2.5], 4.5, float, 'it', arg=attribute)
    edits, left = files.attribute_edits('a.launch', content.encode(), [change])
    assert files.replaced(content.encode(), edits).decode() == (after or content)
    assert [why in reason for _, reason in left] == [True][: after is None]
    standing = files.attribute_places('a.launch', content.encode(), [change])[0]
    if after:
        assert content[standing.start : standing.end] == '2.50'


def test_values_are_found_where_they_stand():
    content = LAUNCH.encode()

    def found(nth, name, **word):
        change = files.AttributeChange(nth, 3, name, [], 0.0, float, 'it', **word)
        return files.attribute_places('a.launch', content, [change])[0]

    start = content.rindex(b'2.50')
    assert found(2, 'x') == (start, start + 4, 2.5)
    assert found(0, 'gain').start == content.index(b'1.50')
    assert found(1, 'y') is None
    content = b'<launch><node name="a" args="1 0.5 base"/><node name="b"/><node name="c"/></launch>'
    start = content.index(b'0.5')
    assert found(0, 'a', word=1, args='1 0.5 base') == (start, start + 3, 0.5)
    assert found(0, 'a', word=1, args='1 0.5 other') is None
    content = b'<launch><node name="a" args="1&#32;0.5"/><node name="b"/><node name="c"/></launch>'
    assert found(0, 'a', word=1, args='1 0.5') is None
