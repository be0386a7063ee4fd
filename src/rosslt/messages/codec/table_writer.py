"""The tables in front of a provenance as they are written: nodes, sources with their values, coefficients, and lists of
both.

An entry that several fields share is written once, and the fields refer to it by number.
"""

import math
import struct
from typing import Any, Dict, List, Optional, Sequence, Tuple

from rosslt.messages.codec.varint import is_whole, packed, packed_strings, zigzag
from rosslt.messages.codec.wire_format import (
    FALSE,
    FLOAT,
    HAS_COEFFICIENTS,
    HAS_LISTS,
    HAS_VALUES,
    INT,
    INT_LIMIT,
    LISTED_LIMIT,
    NO_VALUE,
    STRING,
    SUMMED_LIMIT,
    TABLE_LIMIT,
    TRUE,
)
from rosslt.messages.fields import Scalar
from rosslt.values import UNKNOWN, Error, Source


class Unknown(Error):
    """A value depends on a message that came without its provenance."""


class Unencodable(Error):
    """The provenance of one value cannot be sent; the error says why."""


def checked(value: Scalar) -> Any:
    """A value that can be sent, as it is.

    Raises:
        Unencodable: it is infinite, NaN, too large an integer, or no scalar.
    """
    if type(value) is float:
        if not math.isfinite(value):
            raise Unencodable('its provenance holds %r, which is not finite' % value)
    elif type(value) is int:
        if not -INT_LIMIT < value < INT_LIMIT:
            raise Unencodable('its provenance holds an integer of %d bits' % value.bit_length())
    elif type(value) is str:
        try:
            value.encode('utf-8')
        except UnicodeEncodeError as error:
            raise Unencodable('its provenance holds a text that is not Unicode') from error
    elif type(value) is not bool:
        raise Unencodable('its provenance holds what is of type %s' % type(value).__name__)
    return value


def _key(value: Scalar) -> Any:
    """A key that is different for different values, also for 0.0 and -0.0, and for 1, 1.0 and True."""
    return type(value), value or str(value)


class TableWriter:
    """Collects the sources, lists and coefficients of the fields of one message, and numbers them.

    The numbers of coefficients are known last, since they are sorted by how they are written; until then a coefficient
    has a key.
    """

    def __init__(self) -> None:
        self._nodes: Dict[str, int] = {}
        self._sources: List[Tuple[int, int]] = []
        self._values: List[Any] = []
        self._first: Dict[Source, int] = {}
        self._readings: Dict[Any, int] = {}
        self._coefficients: Dict[Any, Any] = {}
        self._source_lists: Dict[Tuple[int, ...], int] = {}
        self._slope_lists: Dict[Tuple[Any, ...], int] = {}
        self._listed = self._summed = 0

    def _add(self, source: Source, value: Optional[Scalar]) -> int:
        if source == UNKNOWN:
            raise Unknown
        if not isinstance(source.location_id, int):
            raise Unencodable('its location id %r is not an integer' % (source.location_id,))
        if not 0 <= source.location_id < 1 << 48:
            raise Unencodable('its location id %d is not of 48 bits' % source.location_id)
        if len(self._sources) == TABLE_LIMIT:
            raise Unencodable('the message has too many sources')
        checked(source.node)
        self._sources.append((self._nodes.setdefault(source.node, len(self._nodes)), source.location_id))
        self._values.append(value)
        return len(self._sources) - 1

    def source(self, source: Source) -> int:
        """The number of a source, for a field that is the source itself and so has its value."""
        number = self._first.get(source)
        if number is None:
            number = self._first[source] = self._add(source, None)
        return number

    def reading(self, source: Source, value: Scalar) -> int:
        """The number of a source with a value, as a message may hold two readings of one source."""
        key = (source, _key(value))
        number = self._readings.get(key)
        if number is None:
            checked(value)
            number = self._first.get(source)
            if number is None or self._values[number] is not None:
                number = self._add(source, value)
                self._first.setdefault(source, number)
            else:
                self._values[number] = value
            self._readings[key] = number
        return number

    def coefficient(self, slope: Scalar) -> Any:
        """The key of a coefficient."""
        key = _key(slope)
        if key not in self._coefficients:
            if type(slope) is not float and type(slope) is not int:
                raise Unencodable('its slope is of type %s' % type(slope).__name__)
            if len(self._coefficients) == TABLE_LIMIT:
                raise Unencodable('the message has too many coefficients')
            self._coefficients[key] = checked(slope)
        return key

    def lists(self, numbers: Tuple[int, ...], keys: Tuple[object, ...]) -> Tuple[int, int]:
        """The numbers, among the lists, of one of sources and one of the keys of their coefficients, for one field."""
        if self._summed + len(numbers) > SUMMED_LIMIT:
            raise Unencodable('the sums of the message have too many terms')
        if numbers not in self._source_lists or keys not in self._slope_lists:
            self._listed += len(numbers)
            if self._listed > LISTED_LIMIT:
                raise Unencodable('the message has too many lists of sources')
        self._summed += len(numbers)
        return (
            self._source_lists.setdefault(numbers, len(self._source_lists)),
            self._slope_lists.setdefault(keys, len(self._slope_lists)),
        )

    def sorted_coefficients(self) -> Tuple[List[Any], List[Any], List[Any]]:
        """The keys of the coefficients by the way in which they are written: as floats, as whole numbers that are
        floats, as integers. Their numbers, from 1, follow this order."""
        floats: List[Any] = []
        whole: List[Any] = []
        ints: List[Any] = []
        for key, slope in self._coefficients.items():
            (ints if type(slope) is int else whole if is_whole(slope) else floats).append(key)
        return floats, whole, ints

    def counts(self) -> Tuple[int, int, int]:
        """Return the numbers of sources, lists of sources and coefficients."""
        return len(self._sources), len(self._source_lists), len(self._coefficients)

    def flags(self) -> int:
        """The flags of the parts that are there."""
        return (
            (HAS_VALUES if any(value is not None for value in self._values) else 0)
            | (HAS_COEFFICIENTS if self._coefficients else 0)
            | (HAS_LISTS if self._source_lists else 0)
        )

    def packed(self, sorted_keys: Sequence[List[object]], numbers: Dict[object, int]) -> bytes:
        """The tables as bytes.

        Args:
            sorted_keys: the `sorted_coefficients`.
            numbers: the numbers of the coefficients by their keys.
        """
        flags = self.flags()
        parts = [
            packed([len(self._nodes)]),
            packed_strings(list(self._nodes)),
            packed([len(self._sources)]),
            packed([node for node, _ in self._sources]),
            b''.join([location.to_bytes(6, 'little') for _, location in self._sources]),
        ]
        if flags & HAS_VALUES:
            parts += [
                packed([_kind_of_value(value) for value in self._values]),
                _packed_floats([value for value in self._values if type(value) is float]),
                packed([zigzag(value) for value in self._values if type(value) is int]),
                packed_strings([value for value in self._values if type(value) is str]),
            ]
        if flags & HAS_COEFFICIENTS:
            floats, whole, ints = [[self._coefficients[key] for key in keys] for keys in sorted_keys]
            parts += [
                packed([len(floats), len(whole), len(ints)]),
                _packed_floats(floats),
                packed([zigzag(int(slope)) for slope in whole]),
                packed([zigzag(slope) for slope in ints]),
            ]
        if flags & HAS_LISTS:
            parts += [
                packed([len(self._source_lists), len(self._slope_lists)]),
                packed([len(sources) for sources in self._source_lists]),
                packed([source for sources in self._source_lists for source in sources]),
                packed([len(keys) for keys in self._slope_lists]),
                packed([numbers[key] for keys in self._slope_lists for key in keys]),
            ]
        return b''.join(parts)


def _packed_floats(numbers: List[float]) -> bytes:
    return struct.pack('<%dd' % len(numbers), *numbers)


def _kind_of_value(value: Scalar) -> int:
    if type(value) is bool:
        return TRUE if value else FALSE
    return NO_VALUE if value is None else {float: FLOAT, int: INT, str: STRING}[type(value)]
