"""The rows of tables in a program's text."""

import ast

import pytest

from rosslt.instrument.tables import rows_of_literals


def rows(text):
    """The index of the row of each number, in the order of the text; None for one in no table."""
    tree = ast.parse(text)
    found = rows_of_literals(tree)
    numbers = [one for one in ast.walk(tree) if isinstance(one, ast.Constant) and isinstance(one.value, float)]
    numbers.sort(key=lambda one: (one.lineno, one.col_offset))
    return [found.get(id(one)) for one in numbers]


@pytest.mark.parametrize(
    'text',
    [
        'stops = [(1.0, 2.0), (3.0, -4.0)]',
        'stops = ((1.0, 2.0), (3.0, 4.0))',
        "stops = [{'x': 1.0, 'y': 2.0}, {'x': 3.0, 'y': 4.0}]",
        "self.places = {'kitchen': [1.0, 2.0], 'hall': [3.0, 4.0]}",
        "stops = [Stop('a', 1.0, y=2.0), Stop('b', 3.0, y=4.0)]",
        'stops = [(SCALE * 1.0, 2.0 + base[0]), (SCALE * -3.0, 4.0)]',
    ],
)
def test_rows_that_are_alike_make_a_table(text):
    first, second = (f'1:{text.index(text[text.index("=") + 2 :]) + 1}[{row}]' for row in (0, 1))
    assert rows(text) == [first, first, second, second]


@pytest.mark.parametrize(
    'text',
    [
        'offset = [1.0, 2.0]',
        "offset = {'x': 1.0, 'y': 2.0}",
        'single = [(1.0, 2.0)]',
        "robot = {'size': [1.0, 2.0], 'name': 'a'}",
        'different = [(1.0, 2.0), (3.0,)]',
        'names = [left(a), left(b)]; x = 1.0',
    ],
)
def test_other_containers_have_no_rows(text):
    assert set(rows(text)) == {None}


def test_names_stand_for_other_rows_of_a_table():
    text = "a = {'dock': DOCK, 'gate': {'x': DOCK.x + 1.0, 'y': 2.0}, 'shed': {'x': 3.0, 'y': 4.0}, 'far': b['shed']}"
    assert rows(text) == ['1:5[1]', '1:5[1]', '1:5[2]', '1:5[2]']
    assert set(rows("a = {'size': [1.0, 2.0], 'name': name, 'of': other}")) == {None}


def test_of_tables_of_tables_the_inner_ones_have_the_rows():
    outer = 'a = [[(1.0, 2.0), (3.0, 4.0)], [(5.0, 6.0), (7.0, 8.0)]]'
    assert rows(outer) == [f'1:{column}[{row}]' for column in (6, 32) for row in (0, 0, 1, 1)]
