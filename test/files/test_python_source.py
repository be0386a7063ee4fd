"""Numbers in Python files: written in their manner, every other byte kept, and followed through edits."""

import math
import struct
import subprocess

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosslt.files import (
    Edit,
    FileError,
    SourceText,
    changed_elsewhere,
    followed,
    in_manner_of,
    replaced,
    unified_diff,
    write,
)

PROGRAM = b"""#!/usr/bin/env python
# -*- coding: utf-8 -*-
import math

speed = 2.50  # \xc3\xa4 2.5
def f(x):
    a, b = -2, .5
    return x ** 2 + 1e-3 * b - 4
class C:
\tdef g(self):
\t\tself.h = (math.pi / 4, 1_000.0,
\t\t          -  7.25)
"""


def source(content):
    return SourceText('node.py', content)


@pytest.mark.parametrize(
    ('old', 'value', 'new'),
    [
        ('2.50', 3.0, '3.00'),
        ('2.50', 0.125, '0.125'),
        ('2.50', -1.5, '-1.50'),
        ('.5', 0.25, '.25'),
        ('-.5', -0.75, '-.75'),
        ('5.', 6.0, '6.'),
        ('1e-3', 0.0025, '2.5e-3'),
        ('1.0E+03', 2500.0, '2.5E+03'),
        ('1e-3', 12.0, '1.2e1'),
        ('-2', -7, '-7'),
        ('2', 3.0, '3'),
        ('2', -0.0, '-0.0'),
        ('2.0', 1e300, '1e+300'),
        ('1_000.0', 2000.0, '2000.0'),
        ('2.0', 0.1 + 0.2, '0.30000000000000004'),
    ],
)
def test_a_number_keeps_the_manner_in_which_the_one_before_was_written(old, value, new):
    assert in_manner_of(old, value) == new


@given(
    st.sampled_from(['2', '-2', '2.50', '.5', '5.', '1e-3', '2.5E+10', '0x10', '1_000', '+1.0']),
    st.floats(allow_nan=False, allow_infinity=False),
)
def test_what_is_written_reads_back_to_exactly_the_value(old, value):
    read = float(in_manner_of(old, value))
    assert struct.pack('d', read) == struct.pack('d', value)


@given(st.data())
def test_every_other_byte_stays_and_the_program_has_the_new_values(data):
    before = source(PROGRAM)
    values = data.draw(
        st.dictionaries(
            st.integers(0, len(before.numbers) - 1), st.floats(allow_nan=False, allow_infinity=False), min_size=1
        )
    )
    edits = before.edits(values)
    after = source(replaced(PROGRAM, edits))
    assert [number.value for number in after.numbers] == [
        values.get(index, number.value) for index, number in enumerate(before.numbers)
    ]
    assert after.skeleton == before.skeleton
    kept, place = [], 0
    for edit in sorted(edits, key=lambda one: one.start):
        kept.append(PROGRAM[place : edit.start])
        assert PROGRAM[edit.start : edit.end] == edit.old
        place = edit.end
    rest = replaced(PROGRAM, edits)
    for part in [*kept, PROGRAM[place:]]:
        assert part in rest
        rest = rest[rest.index(part) + len(part) :]


@pytest.mark.parametrize(
    ('text', 'index', 'value', 'expected'),
    [
        ('y = 2 ** x', 0, -2, 'y = (-2) ** x'),
        ('y = x - 2', 0, -3, 'y = x - -3'),
        ('def f():\n    return-1', 0, 3, 'def f():\n    return(3)'),
        ('y = 1 if x else 2', 0, -1.5, 'y = -1.5 if x else 2'),
        ('y = x-1.5', 0, -2.0, 'y = x--2.0'),
        ('y = 2 ** 3', 1, -3, 'y = 2 ** -3'),
        ('-2 ** 2', 0, -3, '-(-3) ** 2'),
        ('x = 1 if a else-1', 1, 1, 'x = 1 if a else(1)'),
        ('x = 0x10  # sixteen', 0, 17, 'x = 17  # sixteen'),
    ],
)
def test_a_number_with_another_sign_means_the_same_program(text, index, value, expected):
    made = source(text.encode())
    assert replaced(made.content, made.edits({index: value})).decode() == expected


@pytest.mark.parametrize(
    'content',
    [
        b'# coding: latin-1\nx = "\xe4", 2.5\n',
        b'\xef\xbb\xbfx = "\xc3\xa4", 2.5\n',
        b'x = "\xc3\xa4"\r\ny = 2.5\r\n',
        b'x = """\r\n\x0c"""\ny = 2.5',
    ],
)
def test_encodings_marks_and_line_ends_stay(content):
    made = source(content)
    (number,) = [index for index, number in enumerate(made.numbers) if number.value == 2.5]
    assert replaced(content, made.edits({number: 3.75})) == content.replace(b'2.5', b'3.75')


def test_a_number_that_has_its_value_already_is_not_written():
    assert source(b'x = 2.50\n').edits({0: 2.5}) == []


def values_after(old, new):
    before, after = source(old.encode()), source(new.encode())
    result = followed(before, after)
    return {before.numbers[a].value: after.numbers[b].value for a, b in result.literals.items()}


def test_numbers_are_followed_through_edits_of_other_lines_and_of_themselves():
    old = 'a = 1.5\nb = 2.5\ndef f():\n    return 3.5 + 4.5\n'
    new = 'import os\na = 1.75  # more\n\ndef f():\n    print(9)\n    return 3.5+-4.5\nb = 2.5\n'
    assert values_after(old, new) == {1.5: 1.75, 2.5: 2.5, 3.5: 3.5, 4.5: -4.5}


def test_a_number_that_could_be_another_one_is_not_followed():
    assert values_after('move(1.5)\nmove(2.5)\n', 'move(1.5)\n') == {}
    assert values_after('a = 1.5\n', 'b = 1.5\n') == {}
    assert values_after('def f():\n    return 1.5\n', 'def g():\n    return 1.5\n') == {}


def test_numbers_are_followed_beside_a_row_that_was_added():
    rows = '[\n [1.5, 2.5],\n [3.5, 4.5],\n [3.5, 5.5],\n]\n'
    assert values_after(rows, rows.replace(' [3.5, 4.5],\n', ' [3.5, 4.5],\n' * 2)) == {
        1.5: 1.5,
        2.5: 2.5,
        3.5: 3.5,
        5.5: 5.5,
    }
    assert values_after('move(1.5)\nmove(1.5)\n', 'move(1.5)\n' * 3) == {}
    before, after = source(b'move(1.5)\nmove(2.5)\n'), source(b'move(1.5)\nmove(1.5)\nmove(2.5)\n')
    assert followed(before, after).lines == [1, 2], 'either may be the one that was there'


@pytest.mark.parametrize(
    ('text', 'numbers'),
    [
        ('goto(2.0, 1, -1.5)', ['2.0', '1', '-1.5']),
        ('a -1', ['1']),
        ('- 2.5', ['- 2.5']),
        ('-(2.5)', ['2.5']),
        ('--2', ['-2']),
        ('+2', ['2']),
        ('-2 ** 2', ['2', '2']),
        ('-(  # low\n  3)', ['3']),
        ('1e3 + 0x10 + 1_000 + .5 + 2.', ['1e3', '0x10', '1_000', '.5', '2.']),
        ('x = "1.5"  # 2.5', []),
        ('True, None, 2j, 1e999, -True', []),
        ("f'{1.5} {x:3}'; 4", ['4']),
        ('p = "äöü€𝄞"; goto(1.25, 2, 3)', ['1.25', '2', '3']),
        ('a = 1\r\nb = 2\rc = 3\n', ['1', '2', '3']),
        ('\ufeffa = 1\nb = 2', ['1', '2']),
        ('def f(x=1, *, y: 2 = 3): return x[4] if x else -5', ['1', '2', '3', '4', '-5']),
    ],
)
def test_every_number_is_found_with_its_sign_and_nothing_else(text, numbers):
    made = source(text.encode())
    assert [made.text[number.start : number.end] for number in made.numbers] == numbers


def test_a_position_is_a_line_and_a_column_in_characters():
    numbers = source('a = 1\nä = "€", 25\n'.encode()).numbers
    assert [(number.line, number.column) for number in numbers] == [(1, 5), (2, 10)]


@pytest.mark.parametrize(
    ('text', 'line', 'column', 'reason'),
    [
        ('goto(1, 2, 3)\nwait(1\n', 2, 5, "'(' was never closed"),
        ('a = 1\n  b = 2\n', 2, 2, 'unexpected indent'),
        ('a = 1 +* 2', 1, 8, 'invalid syntax'),
        ('(' * 1000, 1, 201, 'too many nested parentheses'),
    ],
)
def test_a_syntax_error_names_file_line_and_column(text, line, column, reason):
    with pytest.raises(FileError) as caught:
        source(text.encode())
    assert reason in caught.value.reason
    assert str(caught.value).startswith('node.py:{}:{}: '.format(line, column))


def follow_exactly(old, new):
    before, after = source(old.encode()), source(new.encode())
    return {
        '%r@%d' % (before.literals[one].value, before.literals[one].line): '%d:%d' % after.literals[other][2:4]
        for one, other in followed(before, after, exactly=True).literals.items()
    }


A, B, C = 'goto(1, 2, 3)\n', 'goto(4, 5, 6)\n', 'wait(7)\n'


@pytest.mark.parametrize(
    ('old', 'new', 'expected'),
    [
        # lines that were put in, taken out and moved
        (B + C, '# tour\n' + B + C, {'4@1': '2:6', '5@1': '2:9', '6@1': '2:12', '7@2': '3:6'}),
        (A + B + C, A + C, {'1@1': '1:6', '2@1': '1:9', '3@1': '1:12', '7@3': '2:6'}),
        (A + C.strip(), C + A, {'1@1': '2:6', '2@1': '2:9', '3@1': '2:12', '7@2': '1:6'}),
        # lines that were edited
        (A + C, 'goto(1, 2, 8)\n' + C, {'7@2': '2:6'}),
        ('x = 1', 'x = 11', {}),
        ('x = 1', 'x = 1  # one', {}),
        ('x = 1', 'x  = 1', {}),
        # lines that could be either of two
        (A + A, A + A + A, {}),
        (A + C, A + A + C, {'7@2': '3:6'}),
    ],
)
def test_literals_are_followed_exactly_in_lines_that_read_the_same(old, new, expected):
    assert follow_exactly(old, new) == expected


def word_edited(text, value, new, encoding='utf-8'):
    """A program in which one text or truth value is another one."""
    made = source(text.encode(encoding))
    (index,) = [
        index for index, one in enumerate(made.literals) if type(one.value) is type(value) and one.value == value
    ]
    return replaced(made.content, made.edits({index: new})).decode(encoding)


@pytest.mark.parametrize(
    ('old', 'value', 'new', 'expected'),
    [
        ("'map'", 'map', 'odom', "'odom'"),
        ('"map"', 'map', 'odom', '"odom"'),
        ('"map"', 'map', "it's", '"it\'s"'),
        ("'map'", 'map', "it's", '"it\'s"'),
        ("u'map'", 'map', 'odom', "u'odom'"),
        ("r'a\\d'", 'a\\d', 'b\\d', "r'b\\d'"),
        ("r'a\\d'", 'a\\d', 'b\\', "'b\\\\'"),
        ("'map'", 'map', 'a\nb', "'a\\nb'"),
        ("'map'", 'map', 'a\tb\0', "'a\\tb\\x00'"),
        ("'map'", 'map', 'both \' and "', "'both \\' and \"'"),
        ("'map'", 'map', "' + '", '"\' + \'"'),
        ('"""map"""', 'map', 'say "odom"', '\'say "odom"\''),
        ('"""map"""', 'map', 'say "odom".', '"""say "odom"."""'),
        ("'map'", 'map', '\u202e', "'\\u202e'"),
        ('True', True, False, 'False'),
        ('False', False, True, 'True'),
    ],
)
def test_a_text_keeps_its_quotes_where_the_new_one_allows_it(old, value, new, expected):
    before = f'#  "map"\nx = f({old}, 1.50)  # ä\nreturned = lambda:{old}\n'.replace(
        'returned = lambda:' + old, 'y = 2'
    )
    assert word_edited(before, value, new) == before.replace(f'({old},', f'({expected},')


@given(
    st.sampled_from(["'map'", '"map"', "r'map'", "u'map'", "'''map'''", '"""map"""']),
    st.text(min_size=1),
    st.booleans(),
)
def test_a_text_that_is_written_reads_back_to_exactly_that(old, new, is_utf8):
    encoding = 'utf-8' if is_utf8 else 'latin-1'
    before = f'# coding: {encoding}\nx = {old}, True\n'
    after = source(word_edited(before, 'map', new, encoding).encode(encoding))
    assert [one.value for one in after.literals] == [new, True]
    assert after.text.endswith(', True\n')


@pytest.mark.parametrize(
    'text',
    [
        "'a' 'b'",
        "('a'\n 'b')",
        "f'a{1}b'",
        "b'ab'",
        '"""a\nb"""',
        "'a\\\nb'",
        "rb'ab'",
        "f'a' 'b'",
        'None',
    ],
)
def test_texts_in_several_pieces_or_lines_are_no_literals_that_are_written(text):
    assert not [one for one in source(f'x = {text}\n'.encode()).literals if type(one.value) in (str, bool)]


def test_texts_that_are_not_in_ascii_are_written_in_files_in_utf8_alone():
    assert source(b'# coding: latin-1\nx = "\xe4"\n').literals == []
    assert word_edited('# coding: latin-1\nx = "ä", "a"\n', 'a', 'ä☃', 'latin-1').endswith(", '\\xe4\\u2603'\n")


def test_texts_are_followed_where_they_are_locations_and_name_their_lines_elsewhere():
    old = source(b"get('~a', 'x')\nget('~b', 'y')\nget('~c', 1.5)\n")
    new = source(b"get('~b', 'z', )\nget('~b', 'z')\n\nget('~a', 'u')\nget('~d', 1.5)\n")
    locations = {index for index, one in enumerate(old.literals) if one.value in ('x', 'y', 1.5)}
    result = followed(old, new, locations)
    assert {old.literals[a].value: new.literals[b].value for a, b in result.literals.items()} == {'x': 'u', 'y': 'z'}
    assert (result.lines, result.has_lost_lines) == ([1, 5], True)
    assert followed(old, new).literals == {}


def test_a_text_is_not_taken_for_a_number_nor_a_truth_value_for_one():
    made = source(b"x = f(True, 'a', 1)\n")
    for index, one in enumerate(made.literals):
        for other in (True, 'a', 1):
            if type(one.value) is not type(other):
                with pytest.raises(FileError, match='cannot stand here'):
                    made.edits({index: other})


def test_lines_are_named_in_which_more_has_changed_than_locations():
    old, new = (
        source(b'a = 1.5\nfor i in range(3): pass\nb = 2\n'),
        source(b'a = 2.5\nfor i in range(4): pass\nb = 2 + a\nc = 1\n'),
    )
    result = followed(old, new)
    assert changed_elsewhere(old, new, result, {0}) == [2, 3, 4]
    assert result.has_lost_lines


@pytest.mark.parametrize(
    ('old', 'new', 'is_same'),
    [
        # numbers, texts, comments, layout and the order of functions and of a module's lines
        ('if a:\n    b = -1.5\n', 'if a:  # so\n  b = 2\n', True),
        ("get('~a', True)", "get(\n'~b', False)", True),
        ('def f(): a\ndef g(): b\n', 'def g(): b\n\ndef f(): a\n', True),
        ('class C:\n def f(): a\n def g(): 1\n', 'class C:\n def g(): 2\n def f(): a\n', True),
        # blocks, and the blanks of texts
        ('if a:\n    b\n    c\n', 'if a:\n    b\nc\n', False),
        ('for a in b:\n    c\nelse:\n    d\n', 'for a in b:\n    c\n    d\n', False),
        ('class C:\n def f(): a\ndef g(): b\n', 'class C:\n def f(): a\n def g(): b\n', False),
        ('"""a\n b"""', '"""a\n  b"""', False),
        ("f'{a} b'", "f'{a}  b'", False),
    ],
)
def test_blocks_are_the_program_without_numbers_and_layout(old, new, is_same):
    assert (source(old.encode()).blocks() == source(new.encode()).blocks()) is is_same


def test_blocks_that_are_nested_too_deeply_are_refused():
    with pytest.raises(FileError, match='nested too deeply'):
        source(b'x = ' + b' + '.join([b'a'] * 5000)).blocks()


@pytest.mark.parametrize(
    ('call', 'expected'),
    [
        ("get('~frame', 'map')", 'map'),
        ("get('~frame', 'map').replace('/', '_')", 'map'),
        ("get('~frame', MAP).replace('/', '_')", None),
        ("get('~frame', default='map').split('/', 1)", 'map'),
        ("get('~frame',\n  'map'\n).split('/', 1)[0].join(a, 'b')", 'map'),
        ('get("~frame", 1.5).__round__(2, 3)', 1.5),
        ('get("~frame")(2, 3)', None),
    ],
)
def test_the_argument_of_a_call_is_none_of_what_is_called_on_its_value(call, expected):
    source = SourceText('a.py', f'x = {call}\n'.encode())
    index = source.argument_of_call(1, 5, 1, 'default')
    assert (None if index is None else source.literals[index].value) == expected


@pytest.mark.parametrize(
    ('default', 'name'),
    [('GOAL[0]', 'GOAL[0]'), ('GOALS[1][\n    0]', 'GOALS[1][ 0]'), ('self.x', 'self.x'), ('1.5', ''), ('2 * X', '')],
)
def test_a_default_that_is_a_name_is_told(default, name):
    source = SourceText('a.py', f"x = get('~x', {default})\n".encode())
    assert source.name_of_argument(1, 5, 1, 'default') == name


def edit_of(path, old, new):
    content = path.read_bytes()
    made = SourceText(str(path), content)
    (index,) = [index for index, number in enumerate(made.numbers) if number.value == old]
    return made.edits({index: new})


@pytest.mark.parametrize(
    'content',
    [
        b'import x\n\x0c\nx = 1.0\ny = "\xe2\x80\xa8"\n# \x0b\x1c\nz = 2',
        b'x = 1.0\r\n"""a\rb"""\r\n\x0c\r\n',
        b'# -*- coding: latin-1 -*-\ny = "\xe9\x85"\nx = 1.0\n',
    ],
)
def test_a_diff_is_one_that_patch_takes(tmp_path, content):
    path = tmp_path / 'a.py'
    path.write_bytes(content)
    diff = unified_diff(edit_of(path, 1.0, 1.5))
    patched = subprocess.run(
        ['patch', '-p0', '--binary', '--force', '--directory', '/'],
        input=diff.encode('utf-8', 'surrogateescape'),
        capture_output=True,
        check=False,
    )
    assert patched.returncode == 0, patched
    assert path.read_bytes() == content.replace(b'1.0', b'1.5')


def test_what_several_nodes_have_read_in_one_place_is_written_once_or_not_at_all(tmp_path):
    path = tmp_path / 'a.py'
    path.write_text('\ny = 2; ä = 1.0\n', encoding='utf-8')
    to_one, to_other = edit_of(path, 1.0, 1.25), edit_of(path, 1.0, 10.5)
    (one,), (other,) = to_one, to_other
    with pytest.raises(FileError) as caught:
        write([one._replace(what='/a/x'), other._replace(what='/b/x')])
    assert str(caught.value) == (
        f'{path}:2:12: several values were read here, and 1.0 cannot become both 1.25 (for /a/x) and 10.5 (for /b/x)'
    )
    assert path.read_text(encoding='utf-8') == '\ny = 2; ä = 1.0\n'
    twice = [*edit_of(path, 2, 30), one._replace(what='/a/x'), one._replace(what='/b/x')]
    assert '+y = 30; ä = 1.25\n' in unified_diff(twice)
    write(twice)
    assert path.read_text(encoding='utf-8') == '\ny = 30; ä = 1.25\n'


def test_several_files_are_written_all_or_none(tmp_path, monkeypatch):
    first, second = tmp_path / 'a.py', tmp_path / 'b.py'
    first.write_text('x = 1.0\n')
    second.write_text('y = 2.0')
    edits = [*edit_of(first, 1.0, 1.5), *edit_of(second, 2.0, 2.5)]
    assert unified_diff(edits) == (
        f'--- {first}\n+++ {first}\n@@ -1 +1 @@\n-x = 1.0\n+x = 1.5\n'
        f'--- {second}\n+++ {second}\n@@ -1 +1 @@\n-y = 2.0\n\\ No newline at end of file\n'
        '+y = 2.5\n\\ No newline at end of file\n'
    )
    second.write_text('y = 3.0')
    with pytest.raises(FileError, match='edited'):
        write(edits)
    assert first.read_text() == 'x = 1.0\n'

    from rosslt.files import transaction

    second.write_text('y = 2.0')
    replace = transaction.replace_bytes

    def edited_meanwhile(path, expected, content):
        if path == str(second):
            second.write_text('y = 9.0')
        return replace(path, expected, content)

    with monkeypatch.context() as patch:
        patch.setattr(transaction, 'replace_bytes', edited_meanwhile)
        with pytest.raises(FileError, match='edited'):
            write(edits)
    assert (first.read_text(), second.read_text()) == ('x = 1.0\n', 'y = 9.0')
    second.write_text('y = 2.0')
    write(edits)
    assert (first.read_text(), second.read_text()) == ('x = 1.5\n', 'y = 2.5')
    assert isinstance(edits[0], Edit)
    assert math.isfinite(2.5)


def test_a_diff_has_as_many_lines_around_a_change_as_are_asked_for(tmp_path):
    file = tmp_path / 'a.py'
    file.write_text('a\n' * 9 + 'x = 1\n')
    source = SourceText(str(file), file.read_bytes())
    edits = source.edits({0: 2})
    assert unified_diff(edits).count('\n a') == 3
    assert unified_diff(edits, context=100).count('\n a') == 9


@pytest.mark.parametrize('exactly', [False, True])
@pytest.mark.parametrize('closing', ['\n]', ']'])
def test_the_last_row_of_a_list_stays_itself_when_it_gets_a_comma(closing, exactly):
    old = source(f'A = [\n    (1, 2),\n    (3, 4){closing}\nB = [\n    5\n]\n'.encode())
    new = source(f'A = [\n    (1, 2),\n    (3, 4),\n    (6, 7){closing}\nB = [\n    5,\n    8]\n'.encode())
    result = followed(old, new, exactly=exactly)
    pairs = [(old.literals[one].value, new.literals[other].value) for one, other in result.literals.items()]
    assert sorted(pairs) == [(number, number) for number in (1, 2, 3, 4, 5)]
