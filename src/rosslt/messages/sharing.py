"""Decodes the messages of one publisher, each of which has in it what is the same as in the message before.

A `MarkerArray` of 500 markers is sent again and again, and few of them change, or none. Those whose bytes, and whose
provenance, are the same as before are not decoded again: the new message has the very objects of the earlier one, so
that who follows the messages sees by `is` what has not changed. Where all that changed of an element lies in one part,
such as the pose of a marker that moves, this part alone is decoded; the others are those of the earlier element.
"""

import bisect
import itertools
import struct
from typing import Any, Callable, List, NamedTuple, Optional, Sequence, Tuple

import genpy.message

from rosslt.messages.codec import ReceivedHeader, header_like
from rosslt.messages.codegen.blanks import blank, copier
from rosslt.messages.codegen.walkers import END, Walkers, walkers
from rosslt.messages.errors import BadHeader
from rosslt.messages.fields import INSTANTS, SCALARS, VARIABLE, Layout
from rosslt.messages.inband import decoder, fields_and_provenance
from rosslt.messages.leaves import put_located

_LENGTH = struct.Struct('<I')

#: The number and the stamp that a header begins with, and how many leaves they are.
_STAMP, _STAMP_LEAVES = struct.Struct('<3I'), 3

#: Of a field that was not in the message before.
_NOTHING = None, None


class _Element:
    """An element of the array of a message, and what it was decoded from.

    Attributes:
        message: itself.
        skipped: how many bytes it begins with that may be others: those of the number and the stamp in its header, or
            none.
        data: the bytes behind these.
        lengths: of its texts and arrays. As long as those of all elements stay, the leaves of the message have their
            indices.
        leaf: the index of its first leaf.
        fields: the numbers of its first tracked field, and of the one behind its last.
        values: of each of these fields its plain and its tracked value.
    """

    __slots__ = ('data', 'fields', 'leaf', 'lengths', 'message', 'skipped', 'values')

    def __init__(
        self, message: Any, data: bytes, skipped: int, lengths: List[int], leaf: int, fields: Tuple[int, int]
    ) -> None:
        self.message, self.data, self.skipped = message, data, skipped
        self.lengths, self.leaf, self.fields = lengths, leaf, fields
        self.values: List[Tuple[Any, Any]] = [_NOTHING] * (fields[1] - fields[0])


class _Part(NamedTuple):
    """A part of an element that is a message of constant size, before the first array."""

    name: str
    start: int
    """Where its bytes begin in an element with empty texts,"""
    end: int
    """and end."""
    texts: int
    """The number of texts before it."""
    leaf: int
    """The index of its first leaf in the element,"""
    behind: int
    """and of the one behind its last."""
    blank: Callable[[], Any]
    walks: Walkers


class _Changed(NamedTuple):
    """What has been decoded of an element that has changed: all of it, or a part."""

    element: _Element
    message: Any
    walks: Walkers
    leaf: int
    """The index of its first leaf."""
    fields: Tuple[int, int]
    """The numbers of its first tracked field, and of the one behind its last."""


class _Before(NamedTuple):
    """What a message was decoded to."""

    elements: Sequence[_Element]
    provenance: bytes
    header: Optional[ReceivedHeader]
    """What the provenance was read to; None where there is none."""


class SharingDecoder:
    """Decodes the messages of one publisher, in the order in which they come, for those who only read them.

    An element of a message that is the same as in the message before, its provenance too, is the same object. So nobody
    may change it. Where it differs in the number and the stamp of its header alone, it is still the same object, which
    gets the new ones. Messages that are no array of messages, and whatever is odd, are decoded as by `decoder`.

    Args:
        message_class: of the messages; not a tracked type.
    """

    def __init__(self, message_class: Any) -> None:
        self._class, self._decode = message_class, decoder(message_class)
        self._before: Optional[_Before] = None
        self._array: Optional[str] = None
        layout = walkers(message_class).layout
        fields = layout.definitions[layout.name]
        array = fields[0] if len(fields) == 1 else None
        if array is None or array.length != VARIABLE or array.type not in layout.definitions:
            return
        element_class = genpy.message.get_message_class(array.type)
        if element_class is None or element_class._full_text not in message_class._full_text:
            return  # of a message in a bag, for example
        self._array = array.name
        self._blank, self._walks, self._copied = blank(element_class), walkers(element_class), copier(element_class)
        self._parts = _parts(layout, array.type)
        first = layout.definitions[array.type][:1]
        self._has_header = bool(first) and first[0].type == 'std_msgs/Header' and first[0].length is None

    def decode_into(self, message: Any, data: bytes) -> Optional[BadHeader]:
        """As the function that `decoder` gives."""
        before, self._before = self._before, None
        if self._array is None:
            return self._decode(message, data)
        try:
            self._before = self._decoded(data, before)
        except Exception:  # the other decoder says what is wrong
            return self._decode(message, data)
        setattr(message, self._array, [element.message for element in self._before.elements])
        return None

    def _decoded(self, data: bytes, before: Optional[_Before]) -> _Before:
        """What a message is decoded to.

        Raises:
            Exception: it is odd.
        """
        end, provenance = fields_and_provenance(data, self._class)
        count, at = _LENGTH.unpack_from(data)[0], _LENGTH.size
        if before is not None and (before.provenance != provenance or len(before.elements) != count):
            before = None
        header = before.header if before is not None else header_like(self._class, provenance) if provenance else None
        wanted = header.wanted if header is not None else (END,)
        elements: List[_Element] = []
        changed: List[_Changed] = []
        leaf = field = 0
        for number in range(count):
            known = None if before is None else before.elements[number]
            if known is not None:
                part = None
                is_same = data.startswith(known.data, at + known.skipped)
                if not is_same:
                    part = self._decode_part(known, data[at + known.skipped : at + known.skipped + len(known.data)])
                if is_same or part is not None:
                    if known.skipped:
                        stamped = known.message.header
                        stamped.seq, stamped.stamp.secs, stamped.stamp.nsecs = _STAMP.unpack_from(data, at)
                    if part is not None:
                        changed.append(self._changed_part(known, part, wanted))
                    elements.append(known)
                    at += known.skipped + len(known.data)
                    continue
            lengths: List[int] = []
            to = self._walks.measure(data, at, end, lengths.append)
            if known is not None and known.lengths != lengths:
                return self._decoded(data, None)
            message = self._blank()
            message.deserialize(data[at:to])
            if known is not None:
                element = known
                element.message, element.data = message, data[at + element.skipped : to]
            else:
                behind = self._walks.collect(message, leaf, [])
                own = field, bisect.bisect_left(wanted, behind, field)
                skipped = _STAMP.size if self._has_header and wanted[field] >= leaf + _STAMP_LEAVES else 0
                element = _Element(message, data[at + skipped : to], skipped, lengths, leaf, own)
                leaf, field = behind, own[1]
            changed.append(_Changed(element, message, self._walks, element.leaf, element.fields))
            elements.append(element)
            at = to
        if at != end or (before is None and wanted[field] != END):
            raise BadHeader('found more than the elements, or provenance of more than these')
        if header is not None:
            self._put_provenance(header, changed)
        return _Before(elements, provenance, header)

    def _decode_part(self, element: _Element, data: bytes) -> Optional[_Part]:
        """Decode what has changed of an element, if all of it lies in one part.

        Args:
            element: gets another message, which has all other parts of its earlier one.
            data: its bytes, as many as before.

        Returns:
            the part; None, and the element is as it was, where more has changed.
        """
        if len(data) != len(element.data):
            return None
        others = int.from_bytes(data, 'little') ^ int.from_bytes(element.data, 'little')
        first, last = ((others & -others).bit_length() - 1) // 8, (others.bit_length() - 1) // 8
        for part in self._parts:
            before = sum(element.lengths[: part.texts]) - element.skipped
            start, end = part.start + before, part.end + before
            if start <= first and last < end:
                message = part.blank()
                message.deserialize(data[start:end])
                earlier, element.data = element.message, data
                element.message = self._copied(earlier)
                setattr(element.message, part.name, message)
                if self._has_header:  # it gets stamps of its own
                    element.message.header = _copied_header(earlier.header)
                return part
        return None

    def _changed_part(self, element: _Element, part: _Part, wanted: Sequence[int]) -> _Changed:
        leaf = element.leaf + part.leaf
        first = bisect.bisect_left(wanted, leaf, *element.fields)
        behind = bisect.bisect_left(wanted, element.leaf + part.behind, first, element.fields[1])
        return _Changed(element, getattr(element.message, part.name), part.walks, leaf, (first, behind))

    def _put_provenance(self, header: ReceivedHeader, changed: Sequence[_Changed]) -> None:
        """Put the provenance of a message onto those of its elements that have changed.

        A field that holds what it held in the message before, as the same provenance has it, keeps its tracked value.

        Raises:
            BadHeader: it does not fit.
        """
        found: List[Any] = []
        arrays: List[Any] = []
        numbers: List[int] = []
        before: List[Tuple[Any, Any]] = []
        for element, message, walks, leaf, (first, behind) in changed:
            if first < behind:
                walks.locate(message, leaf, (*header.wanted[first:behind], END), 0, found.append, arrays.append)
                numbers.extend(range(first, behind))
                before.extend(element.values[first - element.fields[0] : behind - element.fields[0]])
        plain = [value for _, _, value, _ in found]
        others = [at for at, (value, (earlier, _)) in enumerate(zip(plain, before)) if not _are_one(value, earlier)]
        tracked = [value for _, value in before]
        made = header.part([numbers[at] for at in others]).tracked([found[at] for at in others])
        for at, value in zip(others, made):
            tracked[at] = value
        put_located(found, tracked, arrays)
        values = zip(plain, tracked)
        for element, _, _, _, (first, behind) in changed:
            start, end = first - element.fields[0], behind - element.fields[0]
            element.values[start:end] = itertools.islice(values, behind - first)


def _parts(layout: Layout, type_: str) -> List[_Part]:
    """Those parts of an element of which each may be decoded alone."""
    parts: List[_Part] = []
    at = texts = leaf = 0
    for field in layout.definitions[type_]:
        leaves = layout.flat(field.type)
        if field.length is not None or leaves is None:
            break
        size = layout.size(field.type)
        if size is not None and field.type not in SCALARS and field.type not in INSTANTS:
            class_ = genpy.message.get_message_class(field.type)
            if class_ is not None:
                place = (at, at + size, texts, leaf, leaf + len(leaves))
                parts.append(_Part(field.name, *place, blank(class_), walkers(class_)))
        sizes = [layout.size(scalar) for _, scalar in leaves]
        texts += sizes.count(None)
        at += sum(_LENGTH.size if one is None else one for one in sizes)
        leaf += len(leaves)
    return parts


def _copied_header(header: Any) -> Any:
    make: Callable[[Any], Any] = copier(header.__class__)
    made = make(header)
    made.stamp = type(header.stamp)()  # which would make numbers of its own of what it is given
    made.stamp.secs, made.stamp.nsecs = header.stamp.secs, header.stamp.nsecs
    return made


def _are_one(value: Any, earlier: Any) -> bool:
    """Whether two plain values of the same field are the same one: 0.0 and -0.0 are not, nor is NaN."""
    return bool(value == earlier and type(value) is type(earlier) and (value or repr(value) == repr(earlier)))
