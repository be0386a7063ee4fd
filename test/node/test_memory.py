"""The memory of a node: what it notes, by which means, and what a change sets."""

import collections
import functools
import gc
import itertools
import queue
import sys
import threading
import types
import weakref

import pytest

import rosslt
from rosslt import numpy as tracked_numpy
from rosslt import values
from rosslt.node.json_scalars import Refused
from rosslt.node.locations import location, report
from rosslt.node.locations.call_sites import CallSite
from rosslt.node.memory import remembered, walk
from rosslt.node.memory.remembered import Following, Memory

NUMBERS = itertools.count(1)


class Thing:
    pass


class Node:
    """What this process keeps, with a source of its own."""

    def __init__(self):
        self.source = rosslt.Source('/memory', next(NUMBERS))
        self.memory = Memory()

    def speed(self, value=2.0):
        return values.track(value, self.source)

    def change(self, value):
        self.memory.begin()
        self.memory.follow(self.memory.following({self.source: value}), {})


@pytest.fixture
def node():
    return Node()


#: What own code has run that looking into things may not run.
RAN = []


def runs(name):
    def run(*_args, **_kwargs):
        RAN.append(name)
        raise RuntimeError(name)

    return run


LOUD = [
    *('__getattr__', '__getattribute__', '__len__', '__eq__', '__bool__', '__iter__', '__getitem__', '__contains__'),
    *('__hash__', '__setattr__', '__setitem__', '__get__', '__set__', '__instancecheck__', '__subclasscheck__'),
]


def loud(*bases, **names):
    """A class whose objects note what of their code is run."""
    names = {**dict.fromkeys(LOUD, None), **names}
    made = {name: runs(name) if value is None else value for name, value in names.items()}
    return type(bases[0] if bases else object)('Loud', bases, {**made, '__module__': __name__})


def test_the_walk_runs_no_code_of_the_node(node):
    meta = loud(type)
    kind = meta('Kind', (loud(),), {'__module__': __name__, 'number': property(runs('property')), 'other': loud()()})
    thing = object.__new__(kind)
    object.__setattr__(thing, 'x', node.speed())
    slotted = object.__new__(loud(__slots__=('x',)))
    object.__setattr__(slotted, 'x', node.speed())
    items, mapping = loud(list)([node.speed()]), loud(dict)(x=node.speed())
    queue, pair = loud(collections.deque)([node.speed()]), loud(tuple)([node.speed()])
    kept = Thing()  # is found by its class: the tests of a worker may not run in the main thread, whose locals count
    kept.space = types.SimpleNamespace(pair=pair, things=[thing, slotted, items, mapping, queue])
    del RAN[:]
    node.change(5.0)
    assert RAN == []
    found = [object.__getattribute__(one, 'x') for one in (thing, slotted)]
    found += [*list.__iter__(items), *dict.values(mapping), *collections.deque.__iter__(queue)]
    found += tuple.__iter__(kept.space.pair)
    assert found == [5.0] * 6


def test_a_dict_to_which_a_finalizer_adds_is_read_whole(node):
    kept, turns = Thing(), itertools.cycle([False] * 4 + [True])
    kept.mappings = [dict.fromkeys(range(5000)) for _ in range(20)]  # garbage is collected while one is read
    for mapping in kept.mappings:
        mapping['x'] = node.speed()

    def add(phase, _info):
        if phase == 'start' and next(turns):
            for mapping in kept.mappings:
                mapping[len(mapping)] = 1

    thresholds = gc.get_threshold()
    gc.callbacks.append(add)
    try:
        gc.set_threshold(1000, 10**6)
        node.change(5.0)
    finally:
        gc.set_threshold(*thresholds)
        gc.callbacks.remove(add)
    assert [mapping['x'] for mapping in kept.mappings] == [5.0] * 20


def test_what_holds_an_object_is_read_whole_while_its_class_grows(node):
    kept, kind = Thing(), type('Growing', (), {'__module__': __name__})
    kept.things = {'growing': kind(), 'speed': node.speed()}
    names = map('added_{}'.format, itertools.count())

    def grow(_frame, event, _arg):
        if event == 'line':
            setattr(kind, next(names), 1)
        return grow

    def trace(frame, _event, _arg):
        within = {frame.f_code.co_name, frame.f_back.f_code.co_name}
        return grow if '_look_at_attributes' in within else None

    traced = sys.gettrace()
    sys.settrace(trace)  # stands for another thread, which may run between any two lines
    try:
        node.change(5.0)
    finally:
        sys.settrace(traced)
    assert kept.things['speed'] == 5.0


def test_a_class_without_a_module_keeps_nothing_from_following(node):
    names = {}
    exec("Nameless = type('Nameless', (), {})", names)
    kept = Thing()
    kept.things = [names['Nameless'](), node.speed()]
    node.change(5.0)
    assert kept.things[1] == 5.0


def test_tuples_that_are_nested_deeply_follow(node):
    kept = Thing()
    kept.nested = (node.speed(),)
    for _ in range(5000):
        kept.nested = (kept.nested, 1)
    node.change(3.0)
    inner = kept.nested
    for _ in range(5000):
        inner, _ = inner
    assert inner == (3.0,)


def test_a_tuple_with_attributes_keeps_them(node):
    kind = type('Place', (collections.namedtuple('Place', 'x y'),), {'__module__': __name__})
    kept = Thing()
    kept.place = kind(node.speed(), 1.0)
    kept.place.label = 'dock'
    node.change(3.0)
    assert (type(kept.place), kept.place, kept.place.label) == (kind, (3.0, 1.0), 'dock')


def test_an_array_that_cannot_be_written_stays(node):
    kept = Thing()
    kept.fixed, kept.free = tracked_numpy.ones(2) * node.speed(), tracked_numpy.ones(2) * node.speed()
    kept.fixed.flags.writeable = False
    node.change(3.0)
    assert (kept.fixed.tolist(), kept.free.tolist()) == ([2.0, 2.0], [3.0, 3.0])


@pytest.mark.parametrize(
    'made',
    [
        lambda n: tracked_numpy.arange(n) * 0.5,
        lambda n: tracked_numpy.arange(n, n + 2.0, n / 6.0),
        lambda n: tracked_numpy.linspace(n, n + 2.0, n),
        lambda n: tracked_numpy.cumsum(tracked_numpy.arange(n) * n),
        lambda n: tracked_numpy.concatenate([tracked_numpy.arange(n), [n]]),
    ],
)
@pytest.mark.parametrize('other', [1, 2, 5])
def test_an_array_that_would_get_another_shape_is_left(node, made, other):
    kept, n = Thing(), node.speed(3)
    kept.n, kept.array, kept.single, kept.pair = n, made(n), made(n)[1], (n, made(n).sum())
    kept.elements = list(kept.array)
    expected = [kept.array.tolist(), kept.single, kept.pair, kept.elements]
    node.change(other)
    assert kept.n == other
    assert [kept.array.tolist(), kept.single, kept.pair, kept.elements] == expected
    assert node.memory.held_back == {node.source}
    node.change(3)
    assert [kept.array.tolist(), kept.single, kept.pair, kept.elements] == expected
    assert node.memory.held_back == set()


def test_what_waits_for_its_shape_follows_all_changes_then(node):
    step = rosslt.Source('/memory', next(NUMBERS))
    kept = Thing()
    kept.xs = tracked_numpy.arange(node.speed(3)) * values.track(0.5, step)
    node.change(2)
    node.memory.follow(node.memory.following({step: 2.0}), {})
    node.memory.follow(node.memory.following({}), {})
    assert (kept.xs.tolist(), node.memory.held_back) == ([0.0, 0.5, 1.0], {node.source, step})
    node.change(3)
    assert (kept.xs.tolist(), node.memory.held_back) == ([0.0, 2.0, 4.0], set())


@pytest.mark.parametrize(
    ('made', 'other', 'what'),
    [
        (lambda x: tracked_numpy.corrcoef([x, 1.0, 1.0], [1.0, 2.0, 3.0])[0], 1.0, 'nan'),
        (lambda x: tracked_numpy.float_power(tracked_numpy.ones(2) * x, 0.5), -4.0, r'\(.*\+2j\)'),
    ],
)
def test_a_change_that_would_leave_no_number_is_refused(node, made, other, what):
    kept = Thing()
    kept.array = made(node.speed())
    before = kept.array.tolist()
    with pytest.raises(Refused, match=f'which the node keeps, would be {what}'):
        node.change(other)
    assert kept.array.tolist() == before


def test_each_class_of_number_follows(node):
    kept = Thing()
    for before, after in ((1.0, 2.5), (True, False), (3, 4), ('fast', 'slow')):
        kept.x = node.speed(before)
        kept.pair = (kept.x, 1)
        node.memory = Memory()
        node.change(after)
        assert (kept.x, kept.pair) == (after, (after, 1))


@pytest.mark.parametrize(('before', 'after'), [('fast', 3.0), (2.0, 'fast')])
def test_neither_a_text_nor_a_number_becomes_the_other(node, before, after):
    kept = Thing()
    kept.x = node.speed(before)
    node.change(after)
    assert kept.x == before


@pytest.mark.skipif(not values.KEEPS_LOCALS, reason='needs the compiled core')
def test_what_a_generator_drops_ends_at_once(node):
    ended = []

    class Ending:
        def __del__(self):
            ended.append(self)

    def numbers(kept, thing):
        yield
        thing = None  # noqa: F841
        yield kept

    kept = numbers(node.speed(), Ending())
    next(kept)
    node.change(3.0)
    assert not ended
    assert next(kept) == 3.0
    assert ended


def test_a_node_goes_on_after_an_error_of_the_walk(node, monkeypatch):
    said, called = [], []

    def fail():
        raise MemoryError('all is full')

    monkeypatch.setattr(remembered.rospy, 'logerr', lambda text, *parts: said.append(text % parts))
    node.memory.begins.append(lambda: called.append(1))
    monkeypatch.setattr(remembered, 'Walk', fail)
    node.memory.begin()
    assert called
    assert said == ['what this node keeps follows no change: MemoryError: all is full']
    node.change(3.0)


@pytest.mark.parametrize('kind', [list, collections.deque])
def test_elements_follow_wherever_they_stand_now(node, kind):
    kept = Thing()
    kept.places = kind([node.speed(), (1.0, node.speed() + 1), node.speed() * 2, 7.0])
    node.memory.begin()
    kept.places.append(kept.places[0])
    del kept.places[0]
    kept.places.insert(0, 'first')
    node.change(5.0)
    assert list(kept.places) == ['first', (1.0, 6.0), 10.0, 7.0, 5.0]
    kept.places.reverse()
    kept.places.remove(10.0)
    node.change(6.0)
    assert list(kept.places) == [6.0, 7.0, (1.0, 7.0), 'first']


def test_what_was_removed_refuses_no_later_change(node):
    kept = Thing()
    kept.shares = [1 / node.speed(), 1 / node.speed()]
    node.memory.begin()
    del kept.shares[:]
    node.change(5.0)
    node.change(0.0)


def made_with(x, **names):
    made = type('Kept', (), {'__module__': __name__, **names})()
    made.x = x
    return made


def numbers_of(kept):
    while True:
        yield kept


def started(numbers):
    next(numbers)
    return numbers


#: What holds a number, and can be referred to weakly.
HOLDERS = {
    'object': made_with,
    'slot': lambda x: made_with(x, __slots__=('x', '__weakref__')),
    'class': lambda x: type('Kept', (), {'x': x, '__module__': __name__}),
    'deque': lambda x: collections.deque([x]),
    'own list': lambda x: type('Kept', (list,), {'__module__': __name__})([x]),
    'own dict': lambda x: type('Kept', (dict,), {'__module__': __name__})(x=x),
    'array': lambda x: tracked_numpy.ones(2) * x,
    'default argument': lambda x: lambda y=x: y,
    **({'generator': lambda x: started(numbers_of(x))} if values.KEEPS_LOCALS else {}),
}


@pytest.mark.parametrize('holder', HOLDERS)
def test_the_memory_keeps_nothing_alive(node, holder):
    kept = Thing()
    kept.held = HOLDERS[holder](node.speed())
    reference = weakref.ref(kept.held)
    node.memory.begin()
    assert node.memory.following({node.source: 3.0}) != Following([], [])
    del kept.held
    gc.collect()
    assert reference() is None
    assert node.memory.following({node.source: 3.0}) == Following([], [])
    node.change(4.0)


def test_what_many_locations_came_to_is_looked_at_once(node, monkeypatch):
    for module in (location, report):
        monkeypatch.setattr(module, 'MEMORY', node.memory)
    site = CallSite('waypoints.py', 3, 1, '')
    made = [location.LiteralLocation(str(number), f'x_{number}', site, 1.0) for number in range(20)]
    for one in made:
        one.name_node('/memory')
    kept = Thing()
    kept.waypoints = [one.tracked for one in made[1:]]
    node.memory.begin()
    looks, held = [], remembered._held
    monkeypatch.setattr(remembered, '_held', lambda slot: looks.append(slot.key) or held(slot))
    told = {
        one.name: one.at_next_start.split(',')[0]
        for one in report.all_described(made, lambda name: '', lambda source: '')
    }
    assert {name: why for name, why in told.items() if why} == {'x_0': 'takes effect at the next start'}
    assert len(looks) == 1


def test_what_is_not_the_nodes_own_is_named_while_it_holds_a_number(node):
    class Spy:
        @property
        def __class__(self):
            raise AssertionError('it was asked for its class')

    @functools.lru_cache(maxsize=4)
    def limit():
        return node.speed() * 2.0

    kept = Thing()
    number = node.speed()
    kept.stops = itertools.cycle([(number, 1.0), Spy()])
    kept.todo = queue.Queue()
    kept.limit = limit
    kept.lists = itertools.cycle([[node.speed()]])
    kept.own = [number]
    next(kept.stops)
    limit()
    node.memory.begin()
    kept.todo.put(node.speed())  # on its way through

    def held():
        return sorted(node.memory.holders_of([node.source]).get(node.source, []))

    assert held() == ['limit (functools.lru_cache_wrapper)', 'lists (itertools.cycle)', 'stops (itertools.cycle)']
    del kept.stops
    limit.cache_clear()
    assert held() == ['lists (itertools.cycle)']


@pytest.mark.skipif(not values.KEEPS_LOCALS, reason='needs the compiled core')
def test_local_variables_of_a_function_end_with_the_next_change(node):
    begun, end = threading.Event(), threading.Event()
    references = []

    def work():
        thing = Thing()
        thing.x = number = node.speed()  # noqa: F841
        references.append(weakref.ref(thing))
        begun.set()
        end.wait()

    thread = threading.Thread(target=work)
    thread.start()
    begun.wait()
    node.memory.begin()
    end.set()
    thread.join()
    node.change(3.0)
    assert references[0]() is None


@pytest.mark.parametrize('is_collected', [True, False])
def test_no_garbage_is_collected_while_python_lists_the_frames_of_threads(monkeypatch, is_collected):
    """CPython before 3.11.5 may wait for itself then, for ever."""
    seen, current_frames = [], sys._current_frames
    monkeypatch.setattr(sys, '_current_frames', lambda: seen.append(gc.isenabled()) or current_frames())
    was_collected = gc.isenabled()
    try:
        (gc.enable if is_collected else gc.disable)()
        list(walk.running())
        assert (seen, gc.isenabled()) == ([False], is_collected)
    finally:
        (gc.enable if was_collected else gc.disable)()
