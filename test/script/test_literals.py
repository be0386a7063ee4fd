"""Which numbers there are in a script's text, how one is rewritten, and which is which after an edit."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rosslt.script import ScriptError
from rosslt.script.literals import followed, parse, rewritten

PRECISION = 0.001


def found(text):
    return [text[literal.start : literal.end] for literal in parse(text, 'x.script').literals]


def rewrite(text, index, value, precision=PRECISION):
    return rewritten(parse(text, 'x.script'), index, value, precision, 'x.script').text


@pytest.mark.parametrize(
    ('text', 'numbers'),
    [
        ('goto(2.0, 1, -1.5)', ['2.0', '1', '-1.5']),
        ('a - 1', ['1']),
        ('a -1', ['1']),
        ('- 2.5', ['- 2.5']),
        ('-(2.5)', ['2.5']),
        ('--2', ['-2']),
        ('+2', ['2']),
        ('-2 ** 2', ['2', '2']),
        ('-(  # low\n  3)', ['3']),
        ('1e3 + 0x10 + 1_000 + .5 + 2.', ['1e3', '0x10', '1_000', '.5', '2.']),
        ('x = "1.5"  # 2.5', []),
        ('True, None, 2j, 1e999', []),
        ("f'{1.5} {x:3}'; 4", ['4']),
        ('p = "äöü€𝄞"; goto(1.25, 2, 3)', ['1.25', '2', '3']),
        ('a = 1\r\nb = 2\rc = 3\n', ['1', '2', '3']),
        ('\ufeffa = 1\nb = 2', ['1', '2']),
        ('def f(x=1, *, y: 2 = 3): return x[4] if x else -5', ['1', '2', '3', '4', '-5']),
    ],
)
def test_every_number_is_found_with_its_sign_and_nothing_else(text, numbers):
    assert found(text) == numbers


def test_a_place_is_a_line_and_a_column_in_characters():
    literals = parse('a = 1\nä = "€", 25\n', 'x.script').literals
    assert [(literal.line, literal.column) for literal in literals] == [(1, 5), (2, 10)]


@pytest.mark.parametrize(
    ('text', 'index', 'value', 'expected'),
    [
        ('goto(2.0, 1)', 0, 2.34567, 'goto(2.346, 1)'),
        ('goto(2.0, 1)', 0, 3, 'goto(3.0, 1)'),
        ('goto(2, 1)', 0, 3.0, 'goto(3, 1)'),
        ('goto(2, 1)', 0, 3.25, 'goto(3.25, 1)'),
        ('goto(2, 1)', 0, 2.0004, 'goto(2, 1)'),
        ('goto(2.500, 1)', 0, 2.5, 'goto(2.500, 1)'),
        ('goto(-1.5, 1)', 0, 1.5, 'goto(1.5, 1)'),
        ('goto(1.5, 1)', 0, -1.5, 'goto(-1.5, 1)'),
        ('goto(- 1.5, 1)', 0, -0.5, 'goto(-0.5, 1)'),
        ('goto(1.5, 1)', 0, -0.0001, 'goto(0.0, 1)'),
        ('goto(1, 1)', 0, -0.0001, 'goto(0, 1)'),
        ('a - 1.5', 0, -2, 'a - -2.0'),
        ('a-1.5', 0, -2, 'a--2.0'),
        ('2.0 ** 2', 0, -3, '(-3.0) ** 2'),
        ('2 ** 3', 1, -3, '2 ** -3'),
        ('-2 ** 2', 0, -3, '-(-3) ** 2'),
        ('--2', 0, 3, '-(3)'),
        ('x = 1 if a else-1', 1, 1, 'x = 1 if a else(1)'),
        ('x = 0x10  # sixteen', 0, 17, 'x = 17  # sixteen'),
        ('x = 1e3', 0, 1e30, 'x = 1e30'),
        ('x = 2.50', 0, 3.25, 'x = 3.25'),
        ('x = 2.50', 0, 3.5, 'x = 3.50'),
        ('a = 1\r\nb = 2  \r\n\r\n', 1, 5, 'a = 1\r\nb = 5  \r\n\r\n'),
        ('\ufeffa = "ä"; b = 2', 0, 5, '\ufeffa = "ä"; b = 5'),
    ],
)
def test_one_number_is_rewritten_and_every_other_character_stays(text, index, value, expected):
    assert rewrite(text, index, value) == expected


@pytest.mark.parametrize(
    ('precision', 'expected'), [(0.1, '2.3'), (0.25, '2.25'), (1, '2.0'), (10, '0.0'), (1e-6, '2.345679')]
)
def test_numbers_are_rounded_to_the_precision(precision, expected):
    assert rewrite('1.5', 0, 2.3456789, precision) == expected


NUMBERS = st.one_of(st.integers(-2000, 2000).map(str), st.floats(-1e3, 1e3).map('{:.4f}'.format))
PIECES = st.lists(
    st.tuples(
        st.sampled_from(
            [
                'goto({}, {}, {})',
                'x = {} ** {} - {}',
                'wait({})  # 7 and {}{}',
                'y = x if x else-{}{}{}',
                'for i in range({}): z = -{}, [{}][-1]',
            ]
        ),
        NUMBERS,
        NUMBERS,
        NUMBERS,
    ).map(lambda line: line[0].format(*line[1:])),
    max_size=6,
)


@given(PIECES, st.data(), st.floats(-1e4, 1e4))
def test_whatever_the_script_a_rewritten_number_reads_as_asked_and_no_other_has_changed(lines, data, value):
    text = '\n'.join(lines)
    try:
        before = parse(text, 'x.script')
    except ScriptError:  # two numbers have run together
        assume(False)
    assume(before.literals)
    index = data.draw(st.integers(0, len(before.literals) - 1))
    after = rewritten(before, index, value, PRECISION, 'x.script')
    assert after.skeleton == before.skeleton
    assert abs(after.literals[index].value - value) <= 0.5001 * PRECISION
    for number, (old, new) in enumerate(zip(before.literals, after.literals)):
        if number != index:
            assert (old.value, text[old.start : old.end]) == (new.value, after.text[new.start : new.end])


@pytest.mark.parametrize(
    ('text', 'line', 'column', 'reason'),
    [
        ('goto(1, 2, 3)\nwait(1\n', 2, 5, "'(' was never closed"),
        ('a = 1\n  b = 2\n', 2, 2, 'unexpected indent'),
        ('a = 1 +* 2', 1, 8, 'invalid syntax'),
        ('a\x00b', 1, 1, 'null'),
        ('(' * 1000, 1, 201, 'too many nested parentheses'),
    ],
)
def test_a_syntax_error_names_file_line_and_column(text, line, column, reason):
    with pytest.raises(ScriptError) as caught:
        parse(text, '/tour/x.script')
    assert reason in caught.value.reason
    assert str(caught.value).startswith('/tour/x.script:{}:{}: '.format(line, column))


def follow(old, new):
    before, after = parse(old, 'x.script'), parse(new, 'x.script')
    return {
        old[before.literals[i].start : before.literals[i].end] + '@%d' % before.literals[i].line: '%d:%d'
        % after.literals[j][2:4]
        for i, j in followed(before, after).items()
    }


A, B, C = 'goto(1, 2, 3)\n', 'goto(4, 5, 6)\n', 'wait(7)\n'


def test_numbers_are_followed_past_lines_that_were_put_in_or_taken_out():
    assert follow(B + C, '# tour\n' + B + C) == {'4@1': '2:6', '5@1': '2:9', '6@1': '2:12', '7@2': '3:6'}
    assert follow(A + B + C, A + C) == {'1@1': '1:6', '2@1': '1:9', '3@1': '1:12', '7@3': '2:6'}
    assert follow(A + C, A + B + C)['7@2'] == '3:6'


def test_numbers_in_a_line_that_was_edited_are_not_followed():
    assert follow('goto(1, 2, 3)\nwait(7)\n', 'goto(1, 2, 8)\nwait(7)\n') == {'7@2': '2:6'}
    assert follow('goto(1, 2, 3)', 'goto(1, 2, 31)') == {}
    assert follow('x = 1', 'x = 11') == {}
    assert follow('x = 1', 'xx = 1') == {}


def test_numbers_that_could_be_either_of_two_are_not_followed():
    assert follow(A + A, A + A + A) == {}
    assert follow(A + C, A + A + C) == {'7@2': '3:6'}
    assert follow('wait(1)\nwait(1)', 'wait(1)\nwait(1)\nwait(1)') == {}


@given(PIECES, PIECES, PIECES, PIECES)
def test_whatever_the_edit_a_number_is_followed_to_the_same_line_of_text(before, old, new, after):
    texts = ['\n'.join(before + middle + after) for middle in (old, new)]
    try:
        first, second = (parse(text, 'x.script') for text in texts)
    except ScriptError:
        assume(False)
    for index, other in followed(first, second).items():
        old_line = texts[0].split('\n')[first.literals[index].line - 1]
        assert texts[1].split('\n')[second.literals[other].line - 1] == old_line
        assert first.literals[index].column == second.literals[other].column
