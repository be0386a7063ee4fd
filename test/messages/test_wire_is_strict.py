"""Provenance from elsewhere is not believed: it is right, or it is refused with a reason, and nothing else happens."""

import contextlib
import os
import pickle
import struct
import traceback
import tracemalloc

import pytest
from geometry_msgs.msg import Point
from std_msgs.msg import Bool, Float64, Float64MultiArray, Int64, String

import rosslt
from rosslt import Error, Source, is_tracked, sources
from rosslt.messages import BadHeader, attach, encode, fault_log
from rosslt.messages.codec.varint import Reader, packed, zigzag
from rosslt.values import OPERATIONS
from support.counting import instructions_run
from support.filling import serialized
from support.header_fuzz import fuzz, fuzz_stream
from support.slow_provenance import cases, cost


@pytest.fixture(autouse=True)
def faults_of_this_test(monkeypatch):
    """So many faults come that rosout hears of no more: those of other tests are heard of."""
    monkeypatch.setattr(fault_log, '_said', set())


CODES = {operation.name: 16 + code for code, operation in OPERATIONS.items()}

# The parts of a provenance, as docs/wire_format.md has them, for those who send what is wrong.
NODE = b'\x01\x05/node'


def header(flags=0, tables=NODE + b'\x01\x00' + bytes(6), rest=b'\x01\x00\x00'):
    return bytes([1, flags]) + tables + rest


def with_values(kinds, values, rest, flags=1):
    return header(flags, NODE + packed([len(kinds)]) + bytes(7 * len(kinds)) + bytes(kinds) + values, rest)


QUARTER = ((1, struct.pack('<d', 0.25)),)


def expression(instructions, root, values=QUARTER):
    """A provenance of one field, leaf 0, by instructions in bytes."""
    return with_values(
        [kind for kind, _ in values],
        b''.join(value for _, value in values),
        packed([len(instructions)]) + b''.join(instructions) + b'\x01\x00' + packed([len(values) + root]),
        flags=9,
    )


def refused(message, data):
    """What the error says when data is attached to a message, which must stay as it was."""
    before = serialized(message)
    with pytest.raises(BadHeader) as caught:
        attach(message, data)
    assert serialized(message) == before
    assert not is_tracked(message)
    return str(caught.value)


def test_the_smallest_provenance_is_understood():
    point = Point()
    attach(point, header())
    assert sources(point.x) == [Source('/node', 0)]


@pytest.mark.parametrize(
    ('data', 'reason'),
    [
        (b'\x02' + header()[1:], 'version 2'),
        (header(flags=16), 'flags'),
        (header()[:-1], 'sources of fields'),
        (header() + b'\0', 'bytes more'),
        (header(tables=b'\x01\x09/n'), 'bytes of nodes'),
        (header(tables=b'\x01\x02\xff\xfe\x00'), 'UTF-8'),
        (header(tables=NODE + b'\x01\x01' + bytes(6)), 'node 1 of 1'),
        (header(tables=NODE + b'\x02\x00\x00' + bytes(6)), 'location ids'),
        (header(tables=NODE + packed([10**6])), 'number of sources'),
        (header(tables=packed([2**62])), 'number of nodes'),
        (header(tables=b'\x80' * 11), 'more than 10 bytes'),
        (header(rest=b'\x01\x03\x00'), 'leaf 3'),
        (header(rest=packed([1, 2**63, 0])), 'leaf %d' % 2**63),
        (header(rest=b'\x01\x00\x01'), 'leaf 0 with sources 1'),
        (header(rest=packed([2**30])), 'number of fields'),
        (with_values([6], b'', b'\x01\x00\x00'), 'kind 6'),
        (with_values([1], struct.pack('<d', float('nan')), b'\x01\x00\x00'), 'not finite'),
        (with_values([1], struct.pack('<d', float('inf')), b'\x01\x00\x00'), 'not finite'),
        (with_values([2], packed([1 << 66]), b'\x01\x00\x00'), '64 bits'),
        (header(2, rest=b'\x01\x00\x00' + struct.pack('<d', float('-inf')) + b'\x01\x00\x00\x01'), 'not finite'),
        (header(2, rest=b'\x00\x01\x00\x00' + b'\x01\x00\x00\x02'), 'coefficients 2'),
        (header(2, rest=b'\x00\x01\x00\x02' + b'\x01\x00\x00\x01'), 'None'),
        (header(4, rest=b'\x01\x00\x02\x00\x01\x01\x00\x00'), 'number 1 of 1'),
        (header(4, rest=b'\x01\x00\x01\x00\x01\x00\x00'), 'shortest of 1'),
        (header(4, rest=b'\x01\x00\x02\x00\x00\x01\x00\x00'), 'the same source twice'),
        (header(4, NODE + b'\x02\x00\x00' + bytes(12), b'\x01\x00\x02\x00\x01\x01\x00\x00'), 'the same source twice'),
    ],
    ids=lambda value: value if isinstance(value, str) else '',
)
def test_what_is_wrong_is_refused_and_named(data, reason):
    assert reason in refused(Point(), data)


def test_a_provenance_that_is_longer_than_any_is_refused_unread():
    assert 'limit' in refused(Point(), header() + bytes(1 << 20))


def test_long_numbers_are_read_exactly_or_refused():
    numbers = [1 << bits for bits in range(70)]
    data = packed(numbers)
    assert list(Reader(data).column(len(numbers), 'numbers')) == numbers
    with pytest.raises(BadHeader, match='found 69 of 70 of numbers'):
        Reader(data[:-1]).column(len(numbers), 'numbers')
    with pytest.raises(BadHeader, match='more than 10 bytes in numbers'):
        Reader(b'\xff' * 10 + b'\1').column(1, 'numbers')


def test_no_leaf_comes_twice_and_none_is_beyond_the_message():
    assert 'leaf 3' in refused(Point(), header(rest=b'\x04' + b'\0' * 8))


@pytest.mark.parametrize(
    ('message', 'value'),
    [
        (Bool(True), b'\x01' + struct.pack('<d', 1.0)),
        (String('a'), b'\x01' + struct.pack('<d', 1.0)),
        (Int64(3), b'\x01' + struct.pack('<d', 3.0)),
        (Float64(3), b'\x03\x01a'),
        (Float64(1), b'\x05'),
    ],
    ids=['bool', 'string', 'int of float', 'float of string', 'float of bool'],
)
def test_a_sum_must_fit_the_type_of_its_field(message, value):
    data = with_values(value[:1], value[1:], b'\x00\x00\x01\x02' + b'\x01\x00\x00\x01', flags=3)
    assert 'as a sum' in refused(message, data)


@pytest.mark.parametrize(
    ('instructions', 'reason'),
    [
        ([b'\0\x01'], 'number of a source'),
        ([b'\0\0', packed([CODES['sin'], 0])], 'on itself'),
        ([b'\0\0', packed([CODES['sin'], 2])], 'distance'),
        ([packed([CODES['sin'], 1]), b'\0\0'], 'distance'),
        ([b'\0\0', packed([16 + 15000, 1])], 'unknown operation'),
        ([b'\0\0', b'\x0a'], 'unknown operation'),
        ([b'\x01' + struct.pack('<d', float('nan'))], 'not finite'),
        ([packed([2, 1 << 67])], '64 bits'),
        ([b'\0\0', b'\x06' + bytes(8) + b'\x02\x01'], 'number of terms'),
        ([b'\x01' + bytes(8), b'\x06' + bytes(8) + b'\x01\x01\x01'], 'number of a\nsource'.replace('\n', ' ')),
    ],
    ids=lambda value: value if isinstance(value, str) else '',
)
def test_instructions_that_are_wrong_are_refused_and_named(instructions, reason):
    assert reason in refused(Float64(), expression(instructions, len(instructions) - 1))


def test_a_million_instructions_are_refused_by_their_number():
    data = with_values([1], bytes(8), packed([10**6]) + b'\0\0' * 100, flags=9)
    assert 'number of instructions' in refused(Float64(), data)


def test_instructions_without_a_value_to_start_from_are_refused():
    data = header(8, rest=packed([1]) + b'\0\0' + b'\x01\x00\x01')
    assert 'no value' in refused(Float64(), data)


EXPLOSIONS = {
    'tower of powers': [b'\0\0'] + [packed([CODES['power'], 1, 1])] * 12,
    'squares of squares': [b'\0\0'] + [packed([CODES['mul'], 1, 1])] * 200,
    'rounding to a billion digits': [b'\0\0', packed([2, zigzag(-(10**9))]), packed([CODES['round_to'], 2, 1])],
    'a text repeated for ever': [packed([3, 1]) + b'a', packed([2, zigzag(10**15)]), packed([CODES['repeat'], 2, 1])],
    'a text doubled for ever': [packed([3, 1]) + b'a'] + [packed([CODES['concat'], 1, 1])] * 200,
    'halves that are squared': [b'\0\0', packed([2, zigzag(2)]), packed([CODES['floordiv'], 2, 1])]
    + [packed([CODES['mul'], 1, 1])] * 4000,
    'many long texts': [packed([3, 60000]) + b'a' * 60000, packed([3, 0])]
    + [packed([CODES['concat'], place, place - 1]) for place in range(2, 9000)],
    'a format of great width': [packed([3, 13]) + b'%01000000000d', b'\0\0', packed([CODES['mod'], 2, 1])],
}


@pytest.mark.parametrize('instructions', EXPLOSIONS.values(), ids=EXPLOSIONS)
def test_an_expression_that_would_explode_has_no_sources(instructions, caplog):
    data = expression(instructions, len(instructions) - 1, [(2, packed([zigzag(7)]))])
    message = Int64(5)
    tracemalloc.start()
    try:
        attach(message, data)
        assert sources(message.data) == []
        assert tracemalloc.get_traced_memory()[1] < 10e6
    finally:
        tracemalloc.stop()
    assert 'bad provenance' in caplog.text
    assert message.data == 5


def test_an_expression_that_makes_another_value_has_no_sources(caplog):
    message = Float64(0.9)
    attach(message, expression([b'\0\0', packed([CODES['sin'], 1])], 1))
    assert message.data == 0.9
    assert sources(message.data) == []
    assert 'delivered untracked' in caplog.text


def test_an_expression_of_constants_has_no_sources():
    message = Float64(1.0)
    attach(message, expression([b'\x01' + struct.pack('<d', 1.0)], 0))
    assert sources(message.data) == []


def test_the_limits_keep_the_memory_small():
    ids = b''.join(place.to_bytes(6, 'little') for place in range(1 << 15))
    filler = NODE + packed([1 << 15]) + bytes(1 << 15) + ids + b'\x01' * (1 << 15) + bytes(8 << 15)
    pairs = b'\x02' * (1 << 14)
    lists = packed([1 << 14, 1 << 14]) + pairs + b'\x00\x01' * (1 << 14) + pairs + b'\x01' * (1 << 15)
    data = header(7, filler, packed([1 << 15, 0, 0]) + bytes(8 << 15) + lists + packed([1 << 14]) + bytes(3 << 14))
    assert len(data) < 1 << 20
    tracemalloc.start()
    try:
        assert 'leaf 3' in refused(Point(), data)
        assert tracemalloc.get_traced_memory()[1] < 10e6
    finally:
        tracemalloc.stop()


def test_thousands_of_bad_provenances_do_no_harm(caplog):
    caplog.set_level('CRITICAL', logger='rosout')
    cases = 20000 if os.environ.get('ROSSLT_MANY_EXAMPLES') else 4000
    result = fuzz(cases=cases, seed=42)
    assert not result.faults
    assert result.attached > cases / 10


def test_what_was_changed_anywhere_on_its_way_is_decoded_or_refused(caplog):
    caplog.set_level('CRITICAL', logger='rosout')
    tracked, faults = fuzz_stream(cases=4000, seed=42)
    assert not faults
    assert tracked > 500


def test_bad_provenances_take_little_memory(caplog):
    caplog.set_level('CRITICAL', logger='rosout')
    tracemalloc.start()
    try:
        fuzz(cases=300, seed=7)
        assert tracemalloc.get_traced_memory()[1] < 10e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize('case', cases(size=0.1), ids=lambda case: case[0])
def test_what_is_made_to_be_slow_takes_as_little_memory_as_its_size_allows(case, caplog):
    caplog.set_level('CRITICAL', logger='rosout')
    _, message_class, elements, data = case
    taken = cost(message_class, elements, data)
    # 1,638 leaves of 600 bytes each, and 700 bytes for each of up to 26,214 terms that are asked for
    assert taken.megabytes < 6
    assert taken.megabytes_with_sources < 30


@pytest.mark.parametrize('case', cases(), ids=lambda case: case[0])
def test_what_is_made_to_be_slow_takes_at_most_20_megabytes_until_it_is_received(case, caplog):
    caplog.set_level('CRITICAL', logger='rosout')
    _, message_class, elements, data = case
    message = message_class(data=list(elements))
    tracemalloc.start()
    try:
        with contextlib.suppress(BadHeader):
            attach(message, data)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize('case', cases(size=0.25), ids=lambda case: case[0])
def test_what_is_made_to_be_slow_takes_few_steps_until_it_is_received(case, caplog):
    """A quarter of the limits of the format: a hundred steps take about a microsecond."""
    caplog.set_level('CRITICAL', logger='rosout')
    _, message_class, elements, data = case

    def receive():
        with contextlib.suppress(BadHeader):
            attach(message_class(data=list(elements)), data)

    receive()  # what is compiled once for a class of messages is
    assert instructions_run(receive) < 1300000


def test_more_fields_than_the_limit_are_refused():
    count = 16385
    data = header(rest=packed([count]) + packed([1] + [0] * (count - 1)) + bytes(count))
    message = Float64MultiArray(data=[1.0] * count)
    assert 'found the number of fields 16385, the limit is 16384' in refused(message, data)


def test_of_more_tracked_leaves_than_the_limit_the_first_are_sent(caplog):
    message = Float64MultiArray(data=[rosslt.track(float(at), rosslt.Source('/node', at)) for at in range(16400)])
    message.layout.data_offset = rosslt.track(0, rosslt.Source('/node', 20000))
    for _ in range(2):
        received = received_of(message)
    assert list(received.data) == [float(at) for at in range(16400)]
    kept = [rosslt.sources(value) for value in received.data]
    assert kept == [[rosslt.Source('/node', at)] if at < 16383 else [] for at in range(16400)]
    assert [record.getMessage() for record in caplog.records if record.name == 'rosout'] == [
        'a message of type std_msgs/Float64MultiArray has more than 16384 tracked leaves: '
        'those after these are sent without provenance'
    ]


def test_where_the_provenance_has_too_many_bytes_the_first_leaves_are_sent_with_theirs(caplog):
    nodes = ['/%s%d' % ('node' * 30, at) for at in range(12000)]
    message = Float64MultiArray(data=[rosslt.track(float(at), rosslt.Source(node, 1)) for at, node in enumerate(nodes)])
    received = received_of(message)
    assert list(received.data) == [float(at) for at in range(12000)]
    assert [len(rosslt.sources(value)) for value in received.data] == [1] * 6000 + [0] * 6000
    assert [record.getMessage() for record in caplog.records if record.name == 'rosout'] == [
        'a message of type std_msgs/Float64MultiArray has more than 1048576 bytes of provenance: '
        'only its first 6000 tracked leaves are sent with theirs'
    ]


def received_of(message):
    """What arrives of a message."""
    received = Float64MultiArray().deserialize(serialized(rosslt.untracked(message)))
    attach(received, encode(message))
    return received


def test_many_fields_that_are_sums_of_many_sources_are_refused():
    case = next(data for name, *_, data in cases(0.05) if name.startswith('floats, each a sum of 1638'))
    message = Float64MultiArray(data=[1.0] * 819)
    assert 'sums of %d terms together, the limit is %d' % (819 * 1638, 1 << 18) in refused(message, case)


@pytest.mark.parametrize('error', [rosslt.BadHeader, rosslt.UnknownType])
def test_errors_that_users_meet_are_public_and_show_their_public_names(error):
    assert issubclass(error, Error)
    assert traceback.format_exception_only(error, error('why')) == ['rosslt.%s: why\n' % error.__name__]
    assert type(pickle.loads(pickle.dumps(error('why')))) is error
