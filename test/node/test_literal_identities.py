"""What identifies a number in a text never identifies another one after an edit."""

import ast
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosslt.instrument.literals import SourceText, find_literals
from rosslt.instrument.states import find_states
from rosslt.node.locations.literal_identities import identities
from support.row_texts import RowText

#: Lines with a number that is a location, and one that is none where there are two.
CALLS = [
    'servo({1}, location({0}))',
    'p[{1}] = location({0})',
    'goal = location({0})',
    'go(location({0}), location({1}5))',
]
LITERALS = ['p[{1}] = {0}', 'goal = {0}', 'send(p[{1}], {0})', 'go({0}, {1}5.5)']


def ids_of_calls(text):
    """{identity: number} of the calls of `location`."""
    tree = ast.parse(text)
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and node.func.id == 'location']
    named = identities(tree, text, [(node, 'location') for node in found])
    return dict(zip(named, [ast.literal_eval(node.args[0]) for node in found]))


def ids_of_literals(text):
    """{identity: number} of the literals of a node that was not written for this."""
    tree = ast.parse(text)
    found = find_literals(tree, SourceText('/node.py', text.encode()), find_states(tree))
    return {literal.identity: literal.value for _, literal in found}


class Line:
    """A line of a program: a form of CALLS or LITERALS and its two numbers, which no other line has."""

    def __init__(self, form, numbers):
        self.form, self.own, self.other = form, next(numbers) + 0.25, next(numbers)

    def text(self):
        return self.form.format(self.own, self.other)


def program(lines, is_looped):
    body = ''.join(f'        {line.text()}\n' for line in lines)
    return f'def f():\n    {"while running()" if is_looped else "if ready()"}:\n{body}        pass\n'


@pytest.mark.parametrize(
    ('forms', 'ids'), [(CALLS, ids_of_calls), (LITERALS, ids_of_literals)], ids=['calls', 'literals']
)
@given(data=st.data())
def test_no_edit_gives_a_number_the_identity_of_another(forms, ids, data):
    numbers = iter(range(1, 1000))
    lines = [Line(form, numbers) for form in data.draw(st.lists(st.sampled_from(forms), min_size=1, max_size=6))]
    is_looped = data.draw(st.booleans())
    before = ids(program(lines, is_looped))
    edited = list(lines)
    moved = {}
    kinds = data.draw(st.lists(st.sampled_from(['swap', 'delete', 'own', 'other']), max_size=3)) or ['insert']
    for kind in kinds:
        at = data.draw(st.integers(0, max(0, len(edited) - 1)))
        if kind == 'insert':
            edited.insert(at, Line(data.draw(st.sampled_from(forms)), numbers))
        elif edited and kind == 'delete':
            del edited[at]
        elif edited and kind == 'swap':
            to = data.draw(st.integers(0, len(edited) - 1))
            edited[at], edited[to] = edited[to], edited[at]
        elif edited:
            line = Line(edited[at].form, numbers)
            if kind == 'own':
                line.other = edited[at].other
                moved[line.own] = moved.get(edited[at].own, edited[at].own)
            else:
                line.own = edited[at].own
            edited[at] = line
    after = ids(program(edited, is_looped))
    for identity in before.keys() & after.keys():
        now = after[identity]
        if now % 1 == 0.25:  # an own number; those beside it in `go` are told apart by their index
            assert moved.get(now, now) == before[identity]


@pytest.mark.parametrize(
    ('forms', 'ids'), [(CALLS, ids_of_calls), (LITERALS, ids_of_literals)], ids=['calls', 'literals']
)
def test_a_number_that_is_saved_keeps_its_identity(forms, ids):
    for form in forms:
        numbers = iter(range(1, 1000))
        lines = [Line(form, numbers) for _ in range(3)]
        (identity,) = [identity for identity, number in ids(program(lines, True)).items() if number == lines[1].own]
        lines[1].own = 77.25
        assert ids(program(lines, True))[identity] == 77.25


def test_all_numbers_of_a_line_that_has_no_equal_keep_their_identity_when_they_are_saved():
    text = 'def f():\n    goal = Point({}, {}, 0.5)\n    p[0] = 1.5\n'
    before, after = ids_of_literals(text.format(1.5, -2.5)), ids_of_literals(text.format(-7.0, 8.25))
    assert list(before) == list(after)
    assert len(before) == 4


@pytest.mark.parametrize('seed', range(20))
def test_what_is_done_with_rows_gives_none_the_id_of_another(seed):
    """All numbers beside them keep theirs."""
    chance = random.Random(seed)
    for _ in range(50):
        layout = RowText(chance, is_yaml=False)
        rows, _ = layout.read(layout.text)
        index = chance.randrange(len(rows))
        moves = ['up'] * (index > 0) + ['down'] * (index < len(rows) - 1)
        operation = chance.choice(['duplicate', *['delete'] * (len(rows) > 1), *moves])
        around = f'HOME = 0.125{layout.newline}%s{layout.newline}send(0.375){layout.newline}'
        texts = [around % text for text in (layout.text, layout.after(layout.text, index, operation))]
        print(*texts, index, operation)  # shown where the test fails
        found = [ids_of_literals(text) for text in texts]
        before, after = ({one: mark for one, mark in ids.items() if mark >= 10000} for ids in found)
        beside = [{one: number for one, number in ids.items() if number in (0.125, 0.375)} for ids in found]
        assert beside[0] == beside[1]
        assert len(beside[0]) == 2
        assert len(before) == len(rows)
        assert all(before[one] == after[one] for one in before.keys() & after.keys())


@pytest.mark.slow
def test_a_table_of_many_numbers_is_identified_at_once():
    rows = ''.join(f'    ({n}.5, {n}.25, 0.0),\n' for n in range(3000))
    assert len(ids_of_literals(f'table = [\n{rows}]\n')) == 9000
