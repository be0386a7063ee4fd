"""Slots: other values in the places that hold what is expected, in the compiled core and in Python."""

import collections
import gc
import sys
import threading
import types

import numpy
import pytest

from rosslt.values import KEEPS_LOCALS, exchange, slots

OLD, NEW = object(), object()


def exchange_in_python(rows):
    return [slots._exchange(*row) for row in rows]


both = pytest.mark.parametrize('exchanged', [exchange, exchange_in_python], ids=['as built', 'in Python'])


class Plain:
    pass


class Slotted:
    __slots__ = ('x',)


class Frozen:
    def __setattr__(self, name, value):
        raise AttributeError(name)


def owners():
    """(owner, key, what reads the slot) of each kind; the slot holds OLD."""
    made = Slotted()
    made.x = OLD
    holder = type('Holder', (), {'x': OLD})
    frozen = Frozen()
    vars(frozen)['x'] = OLD
    array = numpy.array([None, OLD], object)
    cell = types.CellType(OLD)

    def function(x=OLD):
        return x

    yield {'x': OLD}, 'x', lambda owner: owner['x']
    yield {None: OLD}, None, lambda owner: owner[None]
    yield collections.OrderedDict(x=OLD), 'x', lambda owner: owner['x']
    yield made, 'x', lambda owner: owner.x
    yield frozen, 'x', lambda owner: owner.x
    yield holder, 'x', lambda owner: owner.x
    yield array, (1,), lambda owner: owner[1]
    yield cell, None, lambda owner: owner.cell_contents
    yield function, '__defaults__', lambda owner: owner()


@both
def test_each_kind_of_slot(exchanged):
    for owner, key, read in owners():
        expected, other = ((OLD,), (NEW,)) if key == '__defaults__' else (OLD, NEW)
        if key == '__defaults__':
            expected = owner.__defaults__
        assert exchanged([(owner, key, NEW, OLD)]) == [False]
        assert read(owner) is OLD
        assert exchanged([(owner, key, expected, other)]) == [True], type(owner)
        assert read(owner) is NEW


@both
@pytest.mark.parametrize('kind', [list, collections.deque])
def test_elements_wherever_they_stand(exchanged, kind):
    own_methods = dict.fromkeys(['__getitem__', '__setitem__', '__iter__', '__len__'])
    for made in (kind, type('Own', (kind,), own_methods)):
        owner, others = made([1, OLD, 2, OLD]), {id(OLD): NEW}
        kind.insert(owner, 0, kind.pop(owner))
        assert exchanged([(owner, None, (OLD,), others)]) == [True]
        assert list(kind.__iter__(owner)) == [NEW, 1, NEW, 2]
        assert exchanged([(owner, None, (OLD,), others)]) == [False]


@both
def test_slots_that_are_gone(exchanged):
    rows = [
        ({}, 'x'),
        (None, 'x'),
        (None, None),
        (Plain(), 'x'),
        (types.CellType(), None),
        (Plain, 'y'),
        (7, 'x'),
    ]
    assert exchanged([(*row, OLD, NEW) for row in rows]) == [False] * len(rows)


@both
def test_references_are_neither_lost_nor_kept(exchanged):
    expected, other = object(), object()
    before = sys.getrefcount(expected), sys.getrefcount(other)
    for _ in range(100):
        owner = {'x': expected}
        assert exchanged([(owner, 'x', expected, other), (owner, 'x', other, expected)]) == [True, True]
    del owner
    gc.collect()
    assert (sys.getrefcount(expected), sys.getrefcount(other)) == before


def test_local_variables_beside_a_loop_that_counts():
    frames, ends = [], []
    if not KEEPS_LOCALS:  # which needs the compiled core
        assert exchange([(sys._getframe(), 'ends', ends, [1])]) == [False]
        return

    def work():
        kept, count = OLD, 0
        frames.append(sys._getframe())
        while kept is OLD or kept is NEW:
            count += 1
        ends.append((kept, count))

    thread = threading.Thread(target=work)
    thread.start()
    while not frames:
        pass
    expected, other = OLD, NEW
    for _ in range(300):
        before = frames[0].f_locals['count']
        assert exchange([(frames[0], 'kept', expected, other)]) == [True]
        assert frames[0].f_locals['count'] >= before
        expected, other = other, expected
    end = frames[0].f_locals['count']
    assert exchange([(frames[0], 'kept', expected, 'end')]) == [True]
    thread.join(60)
    assert ends[0][0] == 'end'
    assert ends[0][1] >= end
