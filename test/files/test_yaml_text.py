"""Other numbers in a YAML file, and everything else in it as it was."""

import pytest
import yaml
from hypothesis import assume, given
from hypothesis import strategies as st

from rosslt.files import FileError, YamlChange, replaced, yaml_edits, yaml_places


def with_word(text, path, value, said=None):
    """A YAML file with another text or truth value, or why not."""
    present = yaml.safe_load(text)
    for step in path:
        present = present[step]
    change = YamlChange(path, [present if said is None else said], value, 'it')
    edits, left = yaml_edits('a.yaml', text.encode(), [change])
    if left:
        assert edits == []
        return left[0][1]
    (edit,) = edits
    after = replaced(text.encode(), edits).decode()
    assert edit.old == text.encode()[edit.start : edit.end]
    assert edit.new
    now = yaml.safe_load(after)
    for step in path:
        now = now[step]
    assert (now, type(now)) == (value, type(value))
    return after


@pytest.mark.parametrize(
    ('old', 'value', 'new'),
    [
        ('map', 'odom', 'odom'),
        ('map', 'base link', 'base link'),
        ("'map'", 'odom', "'odom'"),
        ('"map"', 'odom', '"odom"'),
        ('map', 'true', "'true'"),
        ('map', '5', "'5'"),
        ('map', '', "''"),
        ('map', 'a: b', "'a: b'"),
        ('map', "it's", "it's"),
        ("'map'", "it's", "'it''s'"),
        ('"map"', 'a "b" \\', '"a \\"b\\" \\\\"'),
        ('map', 'a\nb', '"a\\nb"'),
        ('map', 'ä☃', 'ä☃'),
        ('map', '\0\x85', '"\\0\\N"'),
        ('map', 'rad(pi)', "'rad(pi)'"),
        ('&a map', 'odom', '&a odom'),
        ('!!str map', '5', '!!str 5'),
        ('true', False, 'false'),
        ('Yes', False, 'No'),
        ('OFF', True, 'ON'),
        ('!!bool "yes"', False, '!!bool false'),
    ],
)
def test_texts_and_truth_values_are_written_so_that_they_read_back(old, value, new):
    import rosparam  # noqa: F401 - teaches yaml to read angles

    text = '# {} ä\nother: {} x\nframe: {}   # in\nlast: [1, on]\n'
    assert with_word(text.format('map', 'a', old), ['frame'], value) == text.format('map', 'a', new)


@pytest.mark.parametrize(('value', 'new'), [('odom', 'odom'), ('a, b', "'a, b'"), ('a]', "'a]'"), ('{', "'{'")])
def test_a_text_in_a_list_in_one_line_stays_one(value, new):
    assert with_word('a: [map, {b: map}]\n', ['a', 1, 'b'], value) == f'a: [map, {{b: {new}}}]\n'


@pytest.mark.parametrize(
    'text', ['a: |\n  map\n', 'a: >-\n  map\n', 'a: map\n  of all\n', "a: 'map\n\n  b'\n", 'a: "map \\\n  b"\n']
)
def test_a_text_of_several_lines_is_left(text):
    assert with_word(text, ['a'], 'odom') == 'what is written in several lines is not rewritten'


def test_whatever_stands_there_is_rewritten_where_it_is_not_said_what_stood_there():
    text = '# A tour.\na:\n  - [2.0, 1.0, &low 0.50]  # up\n  - {x: -1.5,\n     z: 1.0e-1}\nb: [*low, 7]\n'
    wanted = {('a', 0, 0): 2.25, ('a', 0, 1): 1, ('a', 0, 2): 0.5, ('a', 1, 'x'): 3, ('a', 1, 'z'): -0.1, ('b', 1): 7}
    made, left = yaml_edits(
        'a.yaml', text.encode(), [YamlChange(path, [], value, '') for path, value in wanted.items()]
    )
    after = text.replace('2.0', '2.25').replace('-1.5', '3').replace('1.0e-1', '-1.0e-1')
    assert (replaced(text.encode(), made).decode(), left) == (after, [])


def test_a_file_that_is_no_yaml_is_refused():
    with pytest.raises(FileError, match=r'a\.yaml: it cannot be read'):
        yaml_edits('a.yaml', b'a: [1,\n', [])
    with pytest.raises(FileError, match=r'a\.yaml: it cannot be read: maximum recursion depth'):
        yaml_edits('a.yaml', b'[' * 10000 + b']' * 10000, [])


def test_a_text_that_somebody_has_edited_or_that_is_used_twice_is_left():
    assert with_word('a: map\n', ['a'], 'odom', 'base') == (
        "it was edited since it was loaded: a.yaml says map instead of 'base'"
    )
    assert with_word('a: &x map\nb: *x\n', ['a'], 'odom').startswith('it is one value in several places')
    assert 'is of another kind' in with_word('a: map\n', ['a'], 5)
    assert 'is of another kind' in with_word('a: 1\n', ['a'], True)


@given(
    st.sampled_from(['a: {} # c\nb: 1\n', '[{}, 1]\n', '{{a: {}, b: on}}\n', '- x\n- {}\n', '{}']),
    st.sampled_from(['map', "'map'", '"map"', '&m map', '!!str map']),
    st.text(),
)
def test_every_text_reads_back_and_all_else_stays(template, old, value):
    text = template.format(old)
    path = {'a': ['a'], '[': [0], '{': ['a'], '-': [1]}.get(template[0]) if template != '{}' else []
    expected = yaml.safe_load(text)
    if path:
        expected[path[0]] = value
    else:
        expected = value
    assume(value != 'map')
    assert yaml.safe_load(with_word(text, path, value)) == expected


@pytest.mark.parametrize(
    ('text', 'value', 'expected'),
    [
        ('\ufeffa: 1.5\nb: 2\n', 2.25, '\ufeffa: 2.25\nb: 2\n'),
        ('\ufeffb: "ä"\r\na: 1.5\r\n', -3.0, '\ufeffb: "ä"\r\na: -3.0\r\n'),
        ('\ufeffa: map', 'world', '\ufeffa: world'),
    ],
)
def test_a_byte_order_mark_stays_and_moves_nothing(text, value, expected):
    said = yaml.safe_load(text)['a']
    made, left = yaml_edits('file.yaml', text.encode(), [YamlChange(['a'], [said], value, 'a')])
    assert (replaced(text.encode(), made).decode(), left) == (expected, [])


@pytest.mark.parametrize(
    ('old', 'value', 'new'),
    [
        ('!!float 1', 2.5, '!!float 2.5'),
        ('&x 1', 2, '&x 2'),
        ('rad(0.5)', 0.25, '0.25'),
        ('!!float "1.5"', 2.5, '!!float 2.5'),
        ('!!int "1"', 2, '!!int 2'),
    ],
)
def test_a_number_behind_a_tag_is_written_as_the_tag_reads_it(old, value, new):
    import rosparam  # noqa: F401 - teaches yaml to read angles

    text = f'a: {old} # there\nb: 2\n'
    said = yaml.safe_load(text)['a']
    made, left = yaml_edits('file.yaml', text.encode(), [YamlChange(['a'], [said], value, 'a')])
    after = replaced(text.encode(), made).decode()
    assert (after, left) == (f'a: {new} # there\nb: 2\n', [])
    assert yaml.safe_load(after) == {'a': value, 'b': 2}


@pytest.mark.parametrize(
    ('text', 'value'), [('a: !!int 1\nb: 2\n', 2.5), ('a: !!float >\n  1.5\nb: 2\n', 2.5), ('a: !!float |\n  1\n', 2.0)]
)
def test_a_number_that_its_tag_or_its_lines_do_not_allow_is_left(text, value):
    said = yaml.safe_load(text)['a']
    made, left = yaml_edits('file.yaml', text.encode(), [YamlChange(['a'], [said], value, 'a')])
    assert (made, [what for what, _ in left]) == ([], ['a'])


def test_single_values_are_found_where_they_stand():
    text = 'ä: &a 1.50\nlist: [1, "two",\n  .5]\nsame: *a\nanchored: !!float 3\n'
    paths = (['ä'], ['list', 1], ['list', 2], ['same'], ['anchored'], ['list'], ['list', 3], ['none'])
    found = yaml_places('a.yaml', text.encode(), paths)
    said = [one and (text.encode()[one.start : one.end].decode(), one.value) for one in found]
    same = ('1.50', 1.5)
    assert said == [same, ('"two"', 'two'), ('.5', 0.5), same, ('3', 3.0), None, None, None]
    with pytest.raises(FileError, match='it cannot be read'):
        yaml_places('a.yaml', b'a: [', [['a']])
