"""Provenance that was made to be slow: deep, wide, huge, quadratic; and what receiving it takes."""

import struct
import time
import tracemalloc
from typing import NamedTuple

from std_msgs.msg import Float64MultiArray, Int64MultiArray

from rosslt import sources
from rosslt.messages import BadHeader, attach
from rosslt.messages.codec.varint import packed, zigzag
from rosslt.messages.codec.wire_format import FIELD_LIMIT
from rosslt.values import OPERATIONS

CODES = {operation.name: 16 + code for code, operation in OPERATIONS.items()}
NODE = packed([1, 5]) + b'/node'
VALUES, COEFFICIENTS, LISTS, INSTRUCTIONS = 1, 2, 4, 8

FLOAT, INT = 1, 2
MESSAGES = {FLOAT: Float64MultiArray, INT: Int64MultiArray}


class Cost(NamedTuple):
    """What a message took: until it was received, and until all its sources were known."""

    seconds: float
    megabytes: float
    seconds_with_sources: float
    megabytes_with_sources: float
    outcome: str


def cases(size=1.0):
    """`(name, message class, the elements of its array, provenance)`.

    Args:
        size: how large they are, from 0 to 1, the limits of the format.
    """
    fields = int(size * FIELD_LIMIT)
    entries = int(size * (1 << 15))
    steps = int(size * 9990)
    for kind in (FLOAT, INT):
        word = 'floats' if kind == FLOAT else 'integers'
        for length in (4, 256, entries):
            yield _sums('%s, each a sum of %d sources' % (word, length), kind, fields, length, entries)
        yield _sums('4 %s, each a sum of all sources' % word, kind, 4, entries, entries)
        yield _pairs('%s with lists of 4 of their own' % word, kind, fields)
        yield _single('%s with a source of their own' % word, kind, fields, entries)
    yield _padded('numbers of ten bytes each', fields)
    yield _long_integers('integers of ten bytes each', entries)
    sine, negation, product, total = (packed([CODES[name], 1]) for name in ('sin', 'neg', 'mul', 'add'))
    source = packed([0, 0])
    yield _expressions('a deep sine', [source] + [sine] * steps, [steps])
    yield _expressions(
        'a deep negation of which all floats are parts',
        [source] + [negation] * steps,
        [2 * place % (steps // 2 * 2) for place in range(fields)],
    )
    yield _expressions('squares of squares', [source] + [product + b'\1'] * steps, [steps])
    yield _expressions('integers that grow', [source] + [product + b'\1'] * 3 + [product + b'\4'] * (steps - 3), [4],
                       INT)  # fmt: skip
    half = steps // 2
    every = [packed([0, place]) for place in range(half)]
    for name, code in (('sum', total), ('product', product)):
        chain = every + [code + packed([half]) for _ in range(half - 1)]
        yield _expressions('a %s of all sources' % name, chain, [2 * half - 2], count=half)
        roots = [half + place % (half - 1) for place in range(fields)]
        yield _expressions('a %s of all sources of which all floats are parts' % name, chain, roots, count=half)
    yield _affine_parts('sums of affine parts', steps)
    text = int(size * 60000)
    texts = [packed([3, text]) + b'a' * text, packed([3, 0])]
    texts += [packed([CODES['concat'], place, place - 1]) for place in range(2, steps)]
    yield _expressions('many long texts', texts, [steps - 1])


def _ids(count):
    return b''.join(place.to_bytes(6, 'little') for place in range(count))


def _value(kind):
    return struct.pack('<d', 1.0) if kind == FLOAT else packed([zigzag(1)])


def _head(flags, kind, count):
    """All up to the coefficients: `count` sources of value 1."""
    numbers = NODE + packed([count]) + bytes(count) + _ids(count) + bytes([kind]) * count
    return bytes([1, flags | VALUES]) + numbers + _value(kind) * count


def _fields(origins, slopes=None):
    """The elements of the array, which come behind leaf 0, the offset in its layout."""
    count = len(origins)
    data = packed([count]) + packed([1] + [0] * (count - 1)) + packed(origins)
    return data if slopes is None else data + packed(slopes)


def _case(name, kind, count, data):
    value = 1.0 if kind == FLOAT else 1
    return name, MESSAGES[kind], [value] * count, data


ONE = packed([0, 0, 1, zigzag(1)])
"""The coefficients, of which there is one: the integer 1."""


def _sums(name, kind, count, length, entries):
    lists = packed([1, 1, length]) + packed(range(length)) + packed([length]) + packed([1] * length)
    data = _head(COEFFICIENTS | LISTS, kind, entries) + ONE + lists + _fields([entries] * count, [2] * count)
    return _case(name, kind, count, data)


def _pairs(name, kind, count):
    """Lists of 4: those of sources differ, and no two fields have the same of both."""
    many, coefficients = count // 4, 64
    lists = packed([many, coefficients]) + packed([4] * many)
    for place in range(many):
        digits = (place >> 12 & 15, place >> 8 & 15, place >> 4 & 15, place & 15)
        lists += packed([16 * row + digit for row, digit in enumerate(digits)])
    lists += packed([4] * coefficients)
    for place in range(coefficients):
        lists += packed([1 + (place >> shift & 3) for shift in (6, 4, 2, 0)])
    numbers = packed([0, 0, 4]) + packed([zigzag(number) for number in (1, 2, 3, 4)])
    origins = [64 + place % many for place in range(count)]
    slopes = [5 + place // many for place in range(count)]
    return _case(name, kind, count, _head(COEFFICIENTS | LISTS, kind, 64) + numbers + lists + _fields(origins, slopes))


def _single(name, kind, count, entries):
    origins = [place % entries for place in range(count)]
    data = _head(COEFFICIENTS, kind, entries) + ONE + _fields(origins, [1] * count)
    return _case(name, kind, count, data)


def _padded(name, count):
    zero, one = b'\x80' * 9 + b'\0', b'\x81' + b'\x80' * 8 + b'\0'
    data = bytes([1, 0]) + NODE + packed([1, 0]) + bytes(6) + packed([count]) + one + zero * (count - 1) + bytes(count)
    return _case(name, FLOAT, count, data)


def _long_integers(name, entries):
    long = packed([zigzag(2**64 - 1)])
    head = bytes([1, VALUES | COEFFICIENTS]) + NODE + packed([entries]) + bytes(entries) + _ids(entries)
    numbers = bytes([INT]) * entries + long * entries + packed([0, entries, 0]) + long * entries
    return _case(name, FLOAT, 4, head + numbers + _fields([0] * 4, [0] * 4))


def _expressions(name, instructions, roots, kind=FLOAT, count=1):
    body = packed([len(instructions)]) + b''.join(instructions)
    data = _head(INSTRUCTIONS, kind, count) + body + _fields([count + root for root in roots])
    return _case(name, kind, len(roots), data)


def _affine_parts(name, steps):
    """40,000 terms: affine parts over all of a thousand sources, and their sums."""
    count = steps // 10
    instructions = [packed([0, place]) for place in range(count)]
    for place in range(39):
        distances = b''.join(packed([count + place - source, 1]) for source in range(count))
        instructions.append(packed([6]) + struct.pack('<d', 1.0) + packed([count]) + distances)
    instructions += [packed([CODES['add'], 1, 2])] * (steps - len(instructions))
    body = packed([len(instructions)]) + b''.join(instructions)
    half = packed([1, 0, 0]) + struct.pack('<d', 0.5)
    roots = [count + 10, count + 45, steps // 2, steps - 1]
    origins = [count + root for root in roots]
    head = _head(COEFFICIENTS | INSTRUCTIONS, FLOAT, count)
    return _case(name, FLOAT, 4, head + half + body + _fields(origins, [0] * 4))


def cost(message_class, elements, data):
    """What receiving a message takes, of processor time and of memory."""
    seconds, outcome = _received(message_class, elements, data, time.process_time)
    tracemalloc.start()
    try:
        megabytes, _ = _received(message_class, elements, data, lambda: 1e-6 * tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()
    return Cost(seconds[0], megabytes[0], seconds[1], megabytes[1], outcome)


def _received(message_class, elements, data, meter):
    message = message_class(data=list(elements))
    begin = meter()
    try:
        attach(message, data)
    except BadHeader as error:
        taken = meter() - begin
        return (taken, taken), 'refused: %s' % error
    received = meter() - begin
    found = sources(message)
    return (received, meter() - begin), '%d sources' % len(found)
