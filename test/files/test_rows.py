"""Rows of lists duplicated, deleted and moved, and every other byte as it was."""

import ast
import random
import re
from collections import Counter

import pytest

from rosslt.files import (
    Edit,
    FileError,
    SourceText,
    beside,
    digest_of,
    inline_row_edits,
    python_row_additions,
    python_row_edits,
    replaced,
    rows_of_numbers,
    taking_back,
)
from rosslt.files.rows import OPERATIONS, index_after, index_before, operate
from support.row_texts import RowText, done, in_yaml


def in_python(text, marked, operation, encoding='utf-8'):
    """A Python text after an operation with the row in which a text stands."""
    place = text.index(marked)
    before = re.split(r'\r\n|\r|\n', text[:place])
    content = text.encode(encoding)
    made = python_row_edits('a.py', content, len(before), len(before[-1]) + 1, operation)
    assert all(content[edit.start : edit.end] == edit.old for edit in made.edits)
    return done(content, made).decode(encoding)


LIST = """\
TOUR = [  # all
    [1.0, -2.50],  # the dock, ä

    # then
    [3.0,
     4.0]  # the door
]
"""


@pytest.mark.parametrize(
    ('operation', 'marked', 'old', 'new'),
    [
        ('duplicate', '1.0', '    [1.0, -2.50],  # the dock, ä\n', '    [1.0, -2.50],  # the dock, ä\n' * 2),
        ('delete', '-2', '    [1.0, -2.50],  # the dock, ä\n', ''),
        ('duplicate', '4.0', ' 4.0]  # the door\n', ' 4.0],  # the door\n    [3.0,\n     4.0]  # the door\n'),
        ('delete', '3.0', LIST[8:-2], '  # all\n    [1.0, -2.50]  # the dock, ä\n\n    # then\n'),
        (
            'down',
            '1.0',
            LIST[8:-2],
            '  # all\n    [3.0,\n     4.0],  # the door\n\n    # then\n    [1.0, -2.50]  # the dock, ä\n',
        ),
    ],
)
def test_a_row_goes_with_its_comment_and_all_else_stays(operation, marked, old, new):
    expected = LIST.replace(old, new)
    assert expected != LIST
    assert in_python(LIST, marked, operation) == expected
    if operation == 'down':
        assert in_python(LIST, '3.0', 'up') == expected
    for ending in ('\r\n', '\r'):
        assert in_python(LIST.replace('\n', ending), marked, operation) == expected.replace('\n', ending)
    tabs = LIST.replace('    ', '\t')
    assert in_python(tabs, marked, operation) == expected.replace('    ', '\t')
    for encoding in ('latin-1', 'utf-8-sig'):
        declared = f'# coding: {encoding}\n'
        assert in_python(declared + LIST, marked, operation, encoding) == declared + expected


@pytest.mark.parametrize(
    ('text', 'marked', 'operation', 'expected'),
    [
        ('A = [(1, 2),  # a\n     (3, 4)]  # b\n', '1', 'down', 'A = [(3, 4),  # b\n     (1, 2)]  # a\n'),
        ('A = [(1, 2),  # a\n     (3, 4)]  # b\n', '1', 'delete', 'A = [(3, 4)]  # b\n'),
        ('A = [(1, 2),  # a\n     (3, 4)]  # b\n', '3', 'delete', 'A = [(1, 2)]  # a\n'),
        ('A = [(1, 2)]\n', '1', 'duplicate', 'A = [(1, 2),\n     (1, 2)]\n'),
        ('A = [(1, 2),\n\n # b\n (3, 4)]\n', '1', 'delete', 'A = [\n\n # b\n (3, 4)]\n'),
        ('A = [(1, 2),\n # b\n (3, 4)]\n', '3', 'delete', 'A = [(1, 2),\n # b\n ]\n'),
        ('A = (\n (1, 2),\n (3, 4)\n)\n', '3', 'delete', 'A = (\n (1, 2),\n)\n'),
        ('A = (\n 1,\n 2)\n', '1', 'delete', 'A = (\n 2,)\n'),
        ('A = (\n (1, 2),\n)\n', '1', 'duplicate', 'A = (\n (1, 2),\n (1, 2),\n)\n'),
        ('A = ((1, 2),)\n', '1', 'duplicate', 'A = ((1, 2),\n     (1, 2),)\n'),
        ('A = [\n 3.0,\n 4.0\n]\n', '3', 'down', 'A = [\n 4.0,\n 3.0\n]\n'),
        ('A = [\n -1,  # ]\n 4,\n]\n', '-', 'delete', 'A = [\n 4,\n]\n'),
        ("A = [\n {'x': 1, 'y': 2},\n {'y': 3, 'x': 4},\n]\n", '1', 'delete', "A = [\n {'y': 3, 'x': 4},\n]\n"),
        ('A = f([\n P(x=1.0, y=[2]),\n P(y=[3], x=4)])\n', '2', 'delete', 'A = f([\n P(y=[3], x=4)])\n'),
        ('A = [\n [\n  1,\n  2,\n ],\n [\n  3,\n  4,\n ],\n]\n', '2', 'delete', 'A = [\n [\n  3,\n  4,\n ],\n]\n'),
        (
            'A = [\n [location(1.0), location(2.0)],\n [3, 4],\n]\n',
            '2',
            'down',
            'A = [\n [3, 4],\n [location(1.0), location(2.0)],\n]\n',
        ),
        ('goto(1, 2)\n# x\ngoto(3, 4)  # c', '1', 'down', 'goto(3, 4)  # c\n# x\ngoto(1, 2)'),
        ('goto(1, 2)\n# x\ngoto(3, 4)  # c', '3', 'delete', 'goto(1, 2)\n# x'),
        ('goto(1, 2)\r\ngoto(3, 4)', '3', 'duplicate', 'goto(1, 2)\r\ngoto(3, 4)\r\ngoto(3, 4)'),
        ('goto(1, 2)\r\ngoto(3, 4)', '3', 'delete', 'goto(1, 2)'),
        ('if a:\n  go([1, 2])\n  go([3, 4])\nwait(1)\n', '3', 'up', 'if a:\n  go([3, 4])\n  go([1, 2])\nwait(1)\n'),
        ('go(x=1)\ngo(x=2)\ngo(y=2)\n', '2', 'up', 'go(x=2)\ngo(x=1)\ngo(y=2)\n'),
        ('go("""\n a""", 1)\ngo("b", 2)', '2', 'up', 'go("b", 2)\ngo("""\n a""", 1)'),
    ],
)
def test_rows_of_many_layouts(text, marked, operation, expected):
    assert in_python(text, marked, operation) == expected


@pytest.mark.parametrize(
    ('text', 'marked', 'operation', 'refusal'),
    [
        ('A = [\n [1, 2], [3, 4],\n]\n', '3', 'delete', 'a.py:2:10: two rows of its list stand on one line'),
        ('A = [\n [1, 2],\n [3, 4, 5],\n]\n', '1', 'up', 'a.py:2:2: it is no row .* element 1, in line 3, is of an'),
        ("A = [\n {'x': 1},\n {'y': 1},\n]\n", '1', 'down', 'a.py:2:2: it is no row of a list of alike ones'),
        ('A = [\n P(1),\n Q(1),\n]\n', '1', 'down', 'a.py:2:2: it is no row of a list of alike ones'),
        ('A = [\n (1),\n 2,\n]\n', '1', 'down', 'a.py:2:3: something else stands in front of the row'),
        ('A = [\n (1, 2)\n , (3, 4)\n]\n', '1', 'down', 'a.py:3:4: something else stands in front of the row'),
        ('go(1); go(2)\n', '2', 'up', 'a.py:1:8: two rows of its list stand on one line'),
        ('go(1)\ngo(2); wait()\n', '1', 'delete', 'a.py:2:6: something else stands behind the row'),
        ('A = [\n [1, 2],\n]\n', '1', 'delete', 'a.py:2:2: it is the only row of its list'),
        ('A = [\n [1, 2],\n [1, 3],\n]\n', '1', 'up', 'a.py:2:2: it is the first row of its list'),
        ('A = [\n [1, 2],\n [1, 3],\n]\n', '3', 'down', 'a.py:3:2: it is the last row of its list'),
        ('x = 1\nwait(2)\n', '2', 'up', 'a.py:2:6: no list of alike rows stands here'),
        (
            "A = {'a': (\n 1,\n 2,\n), 'b': (\n 3,\n 4,\n)}\n",
            '1',
            'delete',
            'a.py:2:2: no list of alike rows stands here',
        ),
        ('x = (\n', 'x', 'up', 'a.py:1:.*never closed|EOF'),
    ],
)
def test_what_is_no_row_is_refused_with_its_place(text, marked, operation, refusal):
    with pytest.raises(FileError, match=refusal):
        in_python(text, marked, operation)


def test_an_operation_that_is_none_is_refused():
    with pytest.raises(ValueError, match="'left' is none of duplicate, "):
        in_python(LIST, '1.0', 'left')


BLOCK = 'w:\n- x: 1.0\n  y: 2.0  # ä\n# k\n\n-   x: 3.0\n    y: [4.0,\n        5]\n\n# end\nz: 1\n'
FIRST, SECOND = '- x: 1.0\n  y: 2.0  # ä\n', '-   x: 3.0\n    y: [4.0,\n        5]\n'


@pytest.mark.parametrize(
    ('text', 'path', 'operation', 'expected'),
    [
        (BLOCK, ['w', 0, 'x'], 'duplicate', BLOCK.replace(FIRST, FIRST * 2)),
        (BLOCK, ['w', 0], 'delete', BLOCK.replace(FIRST, '')),
        (BLOCK, ['w', 1], 'delete', BLOCK.replace(SECOND, '')),
        (BLOCK, ['w', 1, 'y', 0], 'up', f'w:\n{SECOND}# k\n\n{FIRST}\n# end\nz: 1\n'),
        ('- - [1, 2]\n  - [3, 4]\n- - [5, 6]', [0, 0, 1], 'delete', '- - [3, 4]\n- - [5, 6]'),
        (
            '- - [1, 2]\n  - [3, 4]\n- - [5, 6]',
            [1, 0, 1],
            'duplicate',
            '- - [1, 2]\n  - [3, 4]\n- - [5, 6]\n  - [5, 6]',
        ),
        ('a: [[1, 2], # a\n [3, 4]] # b\n', ['a', 0, 1], 'down', 'a: [[3, 4], # b\n [1, 2]] # a\n'),
        ('a: [\n  1.5,\n  2\n]\n', ['a', 1], 'delete', 'a: [\n  1.5\n]\n'),
        ('- 1\r\n- 2.5', [1], 'duplicate', '- 1\r\n- 2.5\r\n- 2.5'),
        ('-\n- \n', [1], 'up', '- \n-\n'),
        ('\ufeff- 1\n- 2\n', [1], 'up', '\ufeff- 2\n- 1\n'),
    ],
)
def test_items_of_yaml(text, path, operation, expected):
    assert in_yaml(text, path, operation) == expected


@pytest.mark.parametrize(
    ('text', 'path', 'operation', 'refusal'),
    [
        ('a:\n- &x [1]\n- [2]\n', ['a', 0], 'up', 'a.yaml:2:3: an anchor or an alias stands in the row'),
        ('a: &x 1\nb:\n- [*x]\n- [2]\n', ['b', 0, 0], 'down', 'a.yaml:3:4: an anchor or an alias stands in the row'),
        ('- {x: 1}\n- {y: 1}\n', [0], 'down', 'a.yaml:1:1: it is no row of a list of alike ones: element 1, in line 2'),
        ('- [1]\n- [1, 2]\n', [0], 'down', 'it is no row of a list of alike ones'),
        ('- 1\n- a\n', [0], 'down', 'it is no row of a list of alike ones'),
        ('[[1, 2], [3, 4]]\n', [0], 'down', 'a.yaml:1:10: two rows of its list stand on one line'),
        ('- [1]\n', [0], 'delete', 'a.yaml:1:1: it is the only row of its list'),
        ('- |\n  a\n- b\n', [0], 'down', 'a.yaml:1:3: a text in a block of lines stands in the row'),
        ('a: 1\n', ['a'], 'up', 'a.yaml:1:4: no list of alike rows stands here'),
        ('a: 1\n', ['b'], 'up', 'a.yaml: the file has no b any more'),
        ('[[1],\n [2]], "#"\n', [1], 'up', 'a.yaml: it cannot be read'),
        ('{a: [[1],\n [2]], b: 2}\n', ['a', 1], 'up', 'a.yaml:2:5: something else stands behind the list'),
    ],
)
def test_what_is_no_row_of_yaml_is_refused_with_its_place(text, path, operation, refusal):
    with pytest.raises(FileError, match=refusal):
        in_yaml(text, path, operation)


def test_rows_of_yaml_in_a_launch_file():
    text = '<launch>\n  <rosparam>a: 1</rosparam>\n  <rosparam>\n    w:\n    - [1, 2]\n    - [3, 4]\n'
    text += '  </rosparam>\n</launch>\n'

    def done(*arguments):
        edits, _ = inline_row_edits('a.launch', text.encode(), *arguments)
        return replaced(text.encode(), edits).decode()

    swapped = text.replace('[1, 2]', '[5]').replace('[3, 4]', '[1, 2]').replace('[5]', '[3, 4]')
    assert done(1, 2, ['w', 1], 'up') == swapped
    with pytest.raises(FileError, match=r'a\.launch:5:5: it is the first row of its list'):
        done(1, 2, ['w', 0], 'up')
    with pytest.raises(FileError, match='not certain which <rosparam>'):
        done(0, 1, ['w', 0], 'up')


def other_lines(text):
    """The lines of a text that belong to no row."""
    return [line for line in re.split(r'\r?\n', text) if re.match(r'\s*(#|$|A\b|\]|\)|begin|end)', line)]


def lines_but_commas(text):
    """How often a text has each line, but for the comma that ends the last row or does not."""
    return Counter(re.sub(r',(?=\s*(#|$))', '', line) for line in re.split(r'\r?\n', text))


@pytest.mark.parametrize('seed', range(20))
def test_an_edit_is_taken_back_beside_others_of_the_file(seed):
    chance = random.Random(seed)
    cuts = sorted(chance.sample(range(40), 8))

    def some(pairs, content):
        texts = [bytes(chance.choices(b'xyz', k=chance.randrange(1, 4))) for _ in pairs]
        digest = digest_of(content)
        return [Edit('a', digest, start, end, content[start:end], text) for (start, end), text in zip(pairs, texts)]

    before = bytes(range(65, 105))
    done = some([(cuts[0], cuts[1]), (cuts[4], cuts[4])], before)
    done.append(Edit('a', done[0].digest, cuts[6], cuts[7], before[cuts[6] : cuts[7]], b''))
    now = replaced(before, done)
    back = taking_back(done, digest_of(now))
    assert replaced(now, back) == before
    grown = len(done[0].new) - len(done[0].old)
    behind = len(now) - (40 - cuts[7])  # just behind what was deleted
    others = some([(cuts[2] + grown, cuts[3] + grown), (behind, behind + 1)], now)
    later = replaced(now, others)
    found = beside(back, others, digest_of(later))
    others_before = beside(others, back, digest_of(before))
    assert {edit.digest for edit in found} == {digest_of(later)}
    assert replaced(later, found) == replaced(before, others_before)
    assert beside(back, some([(cuts[0], cuts[0] + 1)], now), '') is None


@pytest.mark.parametrize('seed', range(20))
def test_random_operations_do_what_they_do_with_a_list(seed):
    chance = random.Random(seed)
    for _ in range(50):
        layout = RowText(chance)
        text = layout.text
        rows, rest = layout.read(text)
        index, operation = chance.randrange(len(rows)), chance.choice(['duplicate', 'delete', 'up', 'down'])
        refused = {'up': index == 0, 'down': index == len(rows) - 1, 'delete': len(rows) == 1}.get(operation, False)
        if refused:
            with pytest.raises(FileError, match=r'it is the (first|last|only) row'):
                layout.after(text, index, operation)
            continue
        print(text, index, operation)  # shown where the test fails
        made = layout.after(text, index, operation)
        expected = list(rows)
        operate(expected, index, operation)
        assert layout.read(made) == (expected, rest), made
        assert other_lines(made) == other_lines(text), made
        assert operation == 'delete' or made.endswith('\n') == text.endswith('\n')
        assert ('\r' in made) == ('\r' in text)
        if operation == 'duplicate':
            assert layout.after(made, index, 'delete') == layout.after(made, index + 1, 'delete') == text
        elif operation in ('up', 'down'):
            back = ('down', index - 1) if operation == 'up' else ('up', index + 1)
            assert layout.after(made, back[1], back[0]) == text
        else:
            assert not lines_but_commas(made) - lines_but_commas(text), made


ROUTE = """\
ROUTE = [  # all
    Stop(x=1.00, y=-2., name='a', speed=1e-1),  # the dock
    Stop(x=3.00, y=4., name='b', speed=2e-1)]  # the door
"""


def with_rows(text, marked, *added, behind=()):
    """A Python text with rows below the one in which some texts stand, in which these are other numbers."""
    places = []
    for one in marked:
        place = text.index(one)
        before = re.split(r'\r\n|\r|\n', text[:place])
        places.append((len(before), len(before[-1]) + 1))
    content = text.encode()
    return done(content, python_row_additions('a.py', content, places, added, behind)).decode()


@pytest.mark.parametrize('newline', ['\n', '\r\n'])
def test_added_rows_are_written_as_the_row_above_them(newline):
    text = ROUTE.replace('\n', newline)
    made = with_rows(text, ['-2.', '1.00'], (0.5, 1.5), (-1.25, 2.0), (3.0, -1e-3))
    lines = made.split(newline)
    assert lines[2:5] == [
        "    Stop(x=1.50, y=0.5, name='a', speed=1e-1),",
        "    Stop(x=2.00, y=-1.25, name='a', speed=1e-1),",
        "    Stop(x=-0.001, y=3., name='a', speed=1e-1),",
    ]
    assert newline.join([*lines[:2], *lines[5:]]) == text


def test_rows_added_below_the_last_one_stand_in_front_of_the_bracket():
    made = with_rows(ROUTE, ['3.00'], (5.0,), (6.0,))
    assert made == ROUTE.replace(
        'speed=2e-1)]',
        "speed=2e-1),\n    Stop(x=5.00, y=4., name='b', speed=2e-1),\n    Stop(x=6.00, y=4., name='b', speed=2e-1)]",
    )
    assert (
        with_rows('A = [(1.0, 2.0),\n     (2, 3)]', ['1.0'], (0.5,))
        == 'A = [(1.0, 2.0),\n     (0.5, 2.0),\n     (2, 3)]'
    )
    assert with_rows('goto(1, 2)  # in\ngoto(3, 4)', ['3', '4'], (5, 6), (7, 8.5)) == (
        'goto(1, 2)  # in\ngoto(3, 4)\ngoto(5, 6)\ngoto(7, 8.5)'
    )
    assert with_rows(LIST, ['4.0'], (5.5,)) == LIST.replace('4.0]', '4.0],').replace(
        'door\n', 'door\n    [3.0,\n     5.5]\n'
    )


@pytest.mark.parametrize('last', [')]', '),\n]', '), ]'])
def test_rows_go_behind_those_that_were_added_before(last):
    text = ROUTE.replace('2e-1)]', '2e-1' + last)
    earlier = [(1.5, 0.5), (3.0, 4.0), (-7.0, -1.0)]
    made, added = text, []
    for row in earlier:
        made = with_rows(made, ['1.00', '-2.'], row, behind=added)
        added.append(row)
    assert made == with_rows(text, ['1.00', '-2.'], *earlier)
    door = "    Stop(x=3.00, y=4., name='b', speed=2e-1)"
    kept = with_rows(text, ['1.00', '-2.'], earlier[0], earlier[2])
    made = with_rows(kept, ['1.00', '-2.'], (9.0, 9.5), behind=earlier)
    assert made == kept.replace(door, "    Stop(x=9.00, y=9.5, name='a', speed=1e-1),\n" + door), 'one was taken out'
    other = kept.replace('x=1.50', 'x=1.75')
    made = with_rows(other, ['1.00', '-2.'], (9.0, 9.5), behind=earlier)
    assert made.index('x=9.00') < made.index('x=1.75'), 'none of them stands directly below'


def test_a_row_behind_the_last_of_a_list_has_its_comma():
    text = 'A = [\n    (1.0, 2.0),\n    (2.0, 2.0)  # b\n]\n'
    assert with_rows(text, ['1.0'], (5.0,), behind=[(2.0,)]) == (
        'A = [\n    (1.0, 2.0),\n    (2.0, 2.0),  # b\n    (5.0, 2.0)\n]\n'
    )
    text = 'goto(1, 2)  # in\ngoto(3, 2)'
    assert with_rows(text, ['1'], (5,), behind=[(3,)]) == 'goto(1, 2)  # in\ngoto(3, 2)\ngoto(5, 2)'


@pytest.mark.parametrize(
    ('text', 'marked', 'reason'),
    [
        (ROUTE, ['1.00', '3.00'], 'no number of the row in line 2 stands here'),
        (ROUTE, ["'a'"], 'no number of the row in line 2 stands here'),
        ('X = 1.0\n', ['1.0'], 'no list of alike rows stands here'),
        ('X = [[1.0, 2.0], [3.0]]\n', ['1.0'], 'it is no row of a list of alike ones'),
        ('X = [[1.0, 2.0], [3.0, 4.0]]\n', ['1.0'], 'put each on a line of its own'),
    ],
)
def test_what_is_no_number_of_one_row_gets_no_rows(text, marked, reason):
    with pytest.raises(FileError, match=reason):
        with_rows(text, marked, [0.5] * len(marked))
    with pytest.raises(FileError, match=reason):
        with_rows(text, marked)


@pytest.mark.parametrize('seed', range(20))
def test_random_rows_are_added_and_every_other_byte_stays(seed):
    chance = random.Random(seed)
    for _ in range(50):
        layout = RowText(chance, is_yaml=False)
        rows, rest = layout.read(layout.text)
        index = chance.randrange(len(rows))
        mark, numbers = layout.mark(index), [20000 + number for number in range(chance.randint(1, 4))]
        print(layout.text, index, numbers)  # shown where the test fails
        made = with_rows(layout.text, [mark], *[(number,) for number in numbers])
        added = [ast.literal_eval(repr(rows[index]).replace(mark, str(number))) for number in numbers]
        assert layout.read(made) == ([*rows[: index + 1], *added, *rows[index + 1 :]], rest), made
        assert other_lines(made) == other_lines(layout.text)
        assert not lines_but_commas(layout.text) - lines_but_commas(made), made
        if index < len(rows) - 1 or not layout.is_last_bare:
            start = next(place for place, (one, other) in enumerate(zip(layout.text, made)) if one != other)
            assert made.endswith(layout.text[start:]), made


@pytest.mark.parametrize('operation', OPERATIONS)
def test_elements_are_found_where_they_were_before_an_operation(operation):
    for index in range(5):
        after = index_after(index, 2, operation)
        assert after is None or index_before(after, 2, operation) == index
    assert index_before(3, 2, 'duplicate') is None


def test_no_rows_added_change_nothing():
    assert with_rows(LIST, ['4.0']) == LIST


ROWS = """\
home = 0.5
for x, y in [(1, 2),
             (3, -4)]:
    goto(x, y, 1.0)
    goto(x,
         y, home + 2)
    wait(1)
STOPS = {'a': 7, 'b': [
    1.5,
    -2.5]}
ODD = [
    (1, 2),
    (1, 2, 3),
]
ONE_LINE = [(1, 2), (3, 4)]
"""


def test_the_row_of_each_number_is_known():
    found = rows_of_numbers(SourceText('a.py', ROWS.encode()))
    table, calls = '2:14', '4:5'
    expected = ['', *[table + '[0]'] * 2, *[table + '[1]'] * 2, calls + '[0]', calls + '[1]']
    assert found == expected + [''] * (len(found) - len(expected))


@pytest.mark.parametrize('seed', range(20))
def test_a_known_row_is_the_one_that_is_deleted(seed):
    layout = RowText(random.Random(seed), is_yaml=False)
    source = SourceText('a.py', layout.text.encode())
    rows = rows_of_numbers(source)
    assert any(rows) == (len(layout.read(layout.text)[0]) > 1)
    for literal, row in zip(source.numbers, rows):
        if row:
            made = python_row_edits('a.py', source.content, literal.line, literal.column, 'delete')
            left = Counter(one.value for one in SourceText('a.py', done(source.content, made)).numbers)
            gone = Counter(one.value for one, of in zip(source.numbers, rows) if of == row)
            assert left + gone == Counter(one.value for one in source.numbers)
