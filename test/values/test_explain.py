"""`explain`: one line that a person reads."""

import pytest

from rosslt import Source, explain, math, to_int, track
from rosslt.values import describe_sources_with, lazy

A, B = Source('/node', 1), Source('/node', 2)

LINES = {
    'x': '0.3 [/node#1]',
    'x + 1': '0.3 [/node#1] + 1',
    '1 - x': '1 - 0.3 [/node#1]',
    'x + -1': '0.3 [/node#1] - 1',
    'x - -1.5': '0.3 [/node#1] + 1.5',
    'x * -2': '0.3 [/node#1] * -2',
    '2 * (x + 1)': '2 * (0.3 [/node#1] + 1)',
    '2 * x + 1': '2 * 0.3 [/node#1] + 1',
    'x - (y - 1)': '0.3 [/node#1] - (2.0 [/node#2] - 1)',
    'x - y - 1': '0.3 [/node#1] - 2.0 [/node#2] - 1',
    'x / (y * 3)': '0.3 [/node#1] / (2.0 [/node#2] * 3)',
    'x / y * 3': '0.3 [/node#1] / 2.0 [/node#2] * 3',
    '-x': '-(0.3 [/node#1])',
    '-(x + y)': '-(0.3 [/node#1] + 2.0 [/node#2])',
    '-x ** 2': '-0.3 [/node#1] ** 2',
    '(-x) ** 2': '(-(0.3 [/node#1])) ** 2',
    '2 ** x ** y': '2 ** 0.3 [/node#1] ** 2.0 [/node#2]',
    '(2 ** x) ** y': '(2 ** 0.3 [/node#1]) ** 2.0 [/node#2]',
    'x // 2 % 3': '0.3 [/node#1] // 2 % 3',
    'math.sin(x * 2)': 'sin(0.3 [/node#1] * 2)',
    'math.atan2(x, y)': 'atan2(0.3 [/node#1], 2.0 [/node#2])',
    'round(x, 2) + abs(y)': 'round(0.3 [/node#1], 2) + abs(2.0 [/node#2])',
    'to_int(y)': 'int(2.0 [/node#2])',
    's + "/base"': "'map' [/node#2] + '/base'",
    'x * (0.1 + 0.2)': '0.3 [/node#1] * 0.3',
    'x * 0.30000001192092896': '0.3 [/node#1] * 0.3',
    'n * 12345678901234567890': '7 [/node#2] * 12345678901234567890',
}


@pytest.mark.parametrize('text', LINES)
def test_it_reads_as_it_was_written(text):
    names = {
        'x': track(0.3, A),
        'y': track(2.0, B),
        's': track('map', B),
        'n': track(7, B),
        'math': math,
        'to_int': to_int,
    }
    assert explain(eval(text, names)) == LINES[text]


def test_sources_are_called_by_their_place_where_it_is_known():
    describe_sources_with(lambda source: 'pose.py:7:12' if source == A else None)
    try:
        assert explain(track(0.3, A) + track(2, B)) == '0.3 [pose.py:7:12] + 2 [/node#2]'
    finally:
        describe_sources_with(None)


def test_a_long_one_is_shortened_in_the_middle():
    x = track(0.3, A)
    for number in range(500):
        x = x + number * 0.1
    assert len(explain(x)) <= 400
    assert explain(x).startswith('0.3 [/node#1] + 0.0 + 0.1 + 0.2 + ')
    assert explain(x).endswith(' + 49.8 + 49.9')
    assert ' ... ' in explain(x)
    y = track(0.3, A)
    for _ in range(500):
        y = (y + 1) * 0.5
    assert '0.3 [/node#1]' in explain(y)
    assert len(explain(y)) <= 400


def test_a_folded_part_reads_as_a_sum_of_products():
    for value, terms, text in (
        (1.0, [(A, 0.3, 2.0)], '2.0 * 0.3 [/node#1] + 0.4'),
        (4.3, [(A, 0.3, 1), (B, 2.0, 2)], '0.3 [/node#1] + 2 * 2.0 [/node#2]'),
        (-1.7, [(A, 0.3, 1), (B, 2.0, -1)], '0.3 [/node#1] - 2.0 [/node#2]'),
    ):
        (folded,) = lazy([value], [lambda _, terms=terms: terms])
        assert explain(folded) == text


def test_plain_values_explain_themselves():
    assert explain(0.3) == '0.3'
