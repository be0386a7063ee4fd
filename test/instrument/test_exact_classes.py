"""What Python asks an object for as a number of an exact class is one of that class, as without provenance."""

import array
import builtins
import copy
import csv
import io
import itertools
import marshal
import math
import operator
import pickle
import socket
import types
import warnings

import genpy
import genpy.message
import pytest
from std_msgs.msg import UInt8, UInt8MultiArray

from rosslt import values
from rosslt.instrument import exact_classes, functions
from support.programs import run_rewritten

LEVEL = """
gain = 2.5

class Level:
    def __init__(self, level=1.5):
        self.level, self.place = level, 2

    def __float__(self):
        def twice(x):
            return x * 2

        return twice(self.level) if self.level else 0.0

    def __index__(self):
        return self.place

    def __int__(self):
        if self.place:
            return 7
        return -1

    def __complex__(self):
        return self.level + 1j

    def height(self):
        return self.level * gain

level = Level()
"""


@pytest.mark.parametrize(
    ('ask', 'expected'),
    [
        (float, 3.0),
        (math.sin, math.sin(3.0)),
        (int, 7),
        (operator.index, 2),
        ([1, 2, 3].__getitem__, 3),
        (hex, '0x2'),
        (complex, 1.5 + 1j),
    ],
)
def test_an_object_that_is_a_number_gives_one_of_the_class_that_is_asked_for(ask, expected):
    level = run_rewritten(LEVEL)['level']
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        assert ask(level) == expected


def test_other_methods_give_numbers_with_their_provenance():
    level = run_rewritten(LEVEL)['level']
    assert values.is_tracked(level.height())
    assert values.is_tracked(level.level)


OPERANDS = [1.5, 2, True, -0.0, 0, 'i', [7, 7], (1.0, 2.0), b'ab', None, 1j]
REFUSED = [
    *(('math.' + name, (one,)) for name in functions.MATH for one in OPERANDS),
    *(
        ('math.' + name, two)
        for name in ('log', 'atan2', 'fmod', 'hypot', 'dist')
        for two in itertools.product(OPERANDS, OPERANDS)
    ),
    *(
        ('operator.' + name, two)
        for name in ('iand', 'ior', 'xor', 'mul', 'imul', 'sub', 'floordiv', 'mod')
        for two in itertools.product(OPERANDS, OPERANDS)
    ),
    *((name, two) for name in ('round', 'divmod') for two in itertools.product(OPERANDS, OPERANDS)),
]


def outcome(name, arguments, functions_of_math):
    module, _, last = name.rpartition('.')
    function = (
        functions_of_math[last] if module == 'math' else getattr({'': builtins, 'operator': operator}[module], last)
    )
    try:
        return repr(values.untracked(function(*copy.deepcopy(arguments))))
    except Exception as error:  # whatever Python raises
        words = str(error).replace('TrackedFloat', 'float').replace('TrackedInt', 'int')
        return type(error).__name__, 'cannot multiply' if 'multiply sequence' in words or '*' in words else words


def test_what_python_refuses_is_refused_in_the_same_words():
    source = values.Source('/node', 1)
    differing = []
    for name, arguments in REFUSED:
        plain = outcome(name, arguments, vars(math))
        for number, one in enumerate(arguments):
            if type(one) in (float, int):
                tracked = [*arguments]
                tracked[number] = values.track(one, source)
                if outcome(name, tracked, functions.MATH) != plain:
                    differing.append((name, arguments, number))
    assert not differing


class Metres(float):
    def __radd__(self, other):
        return 'metres'

    def __rdivmod__(self, other):
        return 'rest'


def test_a_subclass_on_the_right_that_computes_itself_comes_first_as_in_python():
    number = values.track(2.0, values.Source('/node', 1))
    assert number + Metres(1.0) == 'metres'
    assert number * Metres(1.5) == 3.0
    assert values.is_tracked(number * Metres(1.5))


def test_functions_that_ask_for_an_exact_class_get_a_plain_number(monkeypatch):
    monkeypatch.setattr(socket, 'getaddrinfo', socket.getaddrinfo)
    monkeypatch.setattr(csv, 'field_size_limit', csv.field_size_limit)
    port = values.track(80, values.Source('/node', 1))
    with pytest.raises(OSError, match='Int or String expected'):
        socket.getaddrinfo('127.0.0.1', port)
    exact_classes.give_plain_ones()
    assert socket.getaddrinfo('127.0.0.1', port) == socket.getaddrinfo('127.0.0.1', 80)
    csv.field_size_limit(values.track(csv.field_size_limit(), values.Source('/node', 1)))


@pytest.fixture
def plain_ones(monkeypatch):
    monkeypatch.setattr(socket, 'getaddrinfo', socket.getaddrinfo)
    monkeypatch.setattr(csv, 'field_size_limit', csv.field_size_limit)
    for module, name in (
        *((marshal, name) for name in ('dumps', 'dump')),
        *((module, name) for module in (genpy, genpy.message) for name in ('strify_message', 'check_type')),
    ):
        monkeypatch.setattr(module, name, getattr(module, name))
    exact_classes.give_plain_ones()


def test_marshal_writes_tracked_numbers_as_plain_ones(plain_ones):
    x, n = values.track(1.5, values.Source('/node', 1)), values.track(2, values.Source('/node', 2))
    assert marshal.loads(marshal.dumps([x, {'n': (n, x + 1.0)}])) == [1.5, {'n': (2, 2.5)}]
    assert marshal.dumps(x) == marshal.dumps(1.5)
    file = io.BytesIO()
    marshal.dump([n], file, n)
    assert file.getvalue() == marshal.dumps([2], 2)


@pytest.mark.parametrize('number', [303, -1, 1.5])
def test_a_message_that_cannot_be_written_says_what_the_plain_one_says(plain_ones, number):
    said = []
    for data in (number, values.track(number, values.Source('/node', 1))):
        for message in (UInt8(data), UInt8MultiArray(data=[1, data])):
            with pytest.raises(genpy.SerializationError) as caught:
                message.serialize(io.BytesIO())
            said.append(str(caught.value))
    assert said[:2] == said[2:]


CACHED = """
import functools

@functools.lru_cache(typed=True)
def twice(x):
    return x * 2.0

class Doubler:
    @functools.lru_cache(maxsize=None)
    def double(self, x):
        return x + x

doubled = Doubler().double(1.5)
"""


def test_what_is_cached_of_a_number_is_nothing_of_where_that_came_from():
    names = run_rewritten(CACHED)
    twice = names['twice']
    near, far = values.Source('/node', 1), values.Source('/node', 2)
    made = [twice(values.track(1.5, near)), twice(values.track(1.5, far)), twice(x=values.track(1.5, far))]
    assert made == [3.0, 3.0, 3.0]
    assert not {near, far} & {source for one in made for source in values.sources(one)}
    assert (twice.cache_info().hits, twice.cache_info().misses) == (1, 2)
    assert (names['doubled'], twice.__name__) == (3.0, 'twice')
    assert values.sources(twice.__wrapped__(values.track(1.5, near)))[0] == near


@pytest.mark.parametrize('code', ['math.sqrt', 'math.floor', 'math.hypot', 'math.log'])
def test_functions_are_pickled_as_pythons_own(code):
    written = run_rewritten('import math, pickle\nwritten = pickle.dumps({})'.format(code))['written']
    assert pickle.loads(written)(9.0) == eval(code)(9.0)


def test_all_that_rewritten_programs_call_is_pickled():
    builtin = [thing for name, thing in vars(builtins).items() if name.startswith('__rosslt_') and callable(thing)]
    for function in [*filter(callable, values.MATH.values()), *functions.REFLECTING.values(), *builtin]:
        assert pickle.loads(pickle.dumps(function)) is function


def test_a_function_is_called_with_other_globals():
    names = run_rewritten('n = 4\ndef f(x):\n    return x * int(n) + 2 * x\n')
    other = types.FunctionType(names['f'].__code__, {'n': 3})
    assert other(2) == 10


def test_a_subclass_of_array_is_as_without_it():
    names = run_rewritten(
        'import array\nclass Samples(array.array):\n    def __init__(self, kind, rate=2.0):\n        self.rate = rate\n'
        "made = Samples('d', rate=3.0)\nmade.append(1.5)\n"
    )
    assert type(names['made']).__mro__[1] is array.array
    assert (names['made'].tolist(), names['made'].rate) == ([1.5], 3.0)
