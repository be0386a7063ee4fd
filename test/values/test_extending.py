"""Adding an operation is one row, adding a form of record is one class: each is shown by doing it."""

import math as plain_math
import pickle

import pytest

from rosslt import Source, evaluate, explain, is_tracked, solve, sources, track
from rosslt.values import affine, assemble, disassemble, reapply
from rosslt.values.functions import function
from rosslt.values.operations import Form, row
from rosslt.values.operations.notation import FUNCTION
from rosslt.values.operators import give_method
from rosslt.values.recording import apply, make, size_of
from rosslt.values.tracked import TrackedFloat

A, B = Source('/node', 1), Source('/node', 2)


@pytest.fixture
def haversine():
    """A row that is added to the table, and taken away again."""
    added = row.operation(
        999,
        'haversine',
        lambda a: plain_math.sin(a / 2) ** 2,
        image=(0, 1),
        inverse=(lambda y, a: 2 * plain_math.asin(plain_math.sqrt(y)),),
        slope=(lambda a: plain_math.sin(a) / 2,),
    )
    yield added
    del row.BY_CODE[999], row.BY_NAME['haversine']


def test_a_new_row_is_all_that_a_new_operation_takes(haversine):
    x = track(0.6, A)
    value = function(haversine)(x) * 2 + 1
    assert value == 2 * plain_math.sin(0.3) ** 2 + 1
    assert explain(value) == 'haversine(0.6 [/node#1]) * 2 + 1'
    assert solve(value, 1.5) == {A: pytest.approx(2 * plain_math.asin(0.5))}
    assert evaluate(value, {A: 0.0}) == 1.0
    assert explain(reapply(value, {A: 0.1})) == 'haversine(0.1 [/node#1]) * 2 + 1'
    twice = function(haversine)(x) + x
    assert evaluate(twice, solve(twice, 1.0)) == pytest.approx(1.0)
    instructions, (root,) = disassemble([value])
    assert (haversine, 0) in instructions
    assert explain(assemble(instructions)[root]) == explain(value)
    assert explain(pickle.loads(pickle.dumps(value))) == explain(value)


def test_a_row_without_a_symbol_can_be_a_method_that_numpy_calls(haversine):
    np = pytest.importorskip('numpy')
    give_method(TrackedFloat, 'haversine', haversine)
    try:
        ufunc = np.frompyfunc(lambda x: x.haversine(), 1, 1)
        assert sources(ufunc(np.array([track(0.6, A)], dtype=object))) == [A]
    finally:
        del TrackedFloat.haversine


class Mean(Form):
    """`(form, operands, None)`: the mean of any number of tracked values, as one record."""

    def operands(self, first, second):
        return first

    def with_operands(self, first, second, operands):
        return self, tuple(operands), second

    def evaluate(self, present, first, second, values):
        return sum(values) / len(values)

    def slopes(self, first, second, values):
        return [1 / len(values)] * len(values)

    def undo(self, place, wanted, present, first, second, values):
        return values[place] + (wanted - present) * len(values)

    def text(self, present, first, second, texts):
        return 'mean(%s)' % ', '.join(text for text, _ in texts), FUNCTION


MEAN = Mean(affine=True)


def mean(*values):
    return make(sum(value._plain for value in values) / len(values), (MEAN, values, None), size_of(values))


def test_a_new_class_is_all_that_a_new_form_of_record_takes():
    a, b, c = track(1.0, A), track(2.0, B), track(6.0, Source('/node', 3))
    value = mean(a, b, c) * 2
    assert value == 6.0
    assert sources(value) == [A, B, Source('/node', 3)]
    assert explain(value) == 'mean(1.0 [/node#1], 2.0 [/node#2], 6.0 [/node#3]) * 2'
    assert evaluate(value, {B: 5.0}) == 8.0
    assert solve(value, 8.0) == {A: 4.0}
    assert solve(value, 8.0, B) == {B: 5.0}
    assert [slope for _, _, slope in affine(value)] == pytest.approx([2 / 3] * 3)
    assert explain(reapply(value, {A: 4.0})).startswith('mean(4.0 [/node#1], ')
    both = mean(a, a * 3)
    assert solve(both, 10.0) == {A: 5.0}
    assert evaluate([value, a], solve([value, a], [8.0, 2.0])) == pytest.approx([8.0, 2.0])
    instructions, (root,) = disassemble([value])
    again = assemble(instructions)[root]
    assert again == value
    assert evaluate(again, {B: 5.0}) == 8.0
    for _ in range(10_000):
        value = value + both
    assert len(disassemble([value])[0]) < 5000
    assert solve(value, value + 10_000.0, A) == {A: pytest.approx(1.5, rel=1e-4)}


@pytest.mark.parametrize(
    ('known', 'message'),
    [
        ({'inverse': (None,), 'slope': (abs,)}, 'the inverse for argument 1 is None, and no function'),
        ({'inverse': (abs, abs), 'slope': (abs,)}, 'has 2 operands, found 1 of `slope`'),
        ({'inverse': (abs,), 'slope': (abs,), 'code': 1}, 'is there already'),
    ],
)
def test_a_row_that_lacks_something_is_refused(known, message):
    before = dict(row.BY_CODE)
    with pytest.raises((TypeError, ValueError), match=message):
        row.operation(known.pop('code', 998), 'lacking', abs, **known)
    assert before == row.BY_CODE


def test_every_row_has_its_three_forms_and_they_apply_it():
    assert is_tracked(apply(row.BY_CODE[1], track(1.0, A), 2.0))
    for operation in row.BY_CODE.values():
        assert operation.left.single_operand
        assert (operation.both is None) == (operation.arity == 1)
