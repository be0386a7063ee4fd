"""The numbers that the wire format is made of, and its limits. Neither may change without a new version."""

VERSION = 1

SAMPLED = bytes((VERSION,))
"""The version alone: the message was sent plain between whole ones, although a leaf of it is tracked."""

BYTES_LIMIT = 1 << 20
"""The longest provenance of a message."""

FIELD_LIMIT = 1 << 14
"""The most tracked leaves of a message: each takes half a kilobyte and up to some microseconds of who receives it."""

TABLE_LIMIT = 1 << 15
"""The most entries of any table."""

LISTED_LIMIT = 1 << 16
"""The most numbers in the lists of sources together, and in those of coefficients."""

SUMMED_LIMIT = 1 << 18
"""The most terms of all fields that are sums together: many fields may name one long list."""

INT_LIMIT = 1 << 64
"""Integers on the wire are smaller than that, with either sign: all that ROS has, signed or not."""

INSTRUCTION_LIMIT = 10000
"""The most instructions of a message. What has more is sent linearized."""

HAS_VALUES, HAS_COEFFICIENTS, HAS_LISTS, HAS_INSTRUCTIONS = 1, 2, 4, 8
"""The flags in the second byte: which parts follow."""

NO_VALUE, FLOAT, INT, STRING, FALSE, TRUE = range(6)
"""The kinds of a source's value, and of a constant."""

IDENTITY = 0
"""Written instead of the number of a field's coefficients if the field equals its source."""

FROM_SOURCE, EXACT, LINEAR, OPERATION = 0, 6, 8, 16
"""The codes of instructions beside those of constants, 1 to 5: a source, affine parts with a float (7 and 9: with an
integer), and operations, whose own codes follow."""
