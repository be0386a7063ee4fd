"""Decodes the messages of one publisher, each of which has in it what is the same as in the message before.

A `MarkerArray` of 500 markers is sent again and again, and few of them change, or none. Those whose bytes, and whose
provenance, are the same as before are not decoded again: the new message has the very objects of the earlier one, so
that who follows the messages sees by `is` what has not changed.
"""

import bisect
import itertools
import struct
from typing import Any, List, NamedTuple, Optional, Sequence, Tuple

import genpy.message

from rosslt.messages.codec import ReceivedHeader, header_like, put_located
from rosslt.messages.codegen.blanks import blank
from rosslt.messages.codegen.walkers import END, walkers
from rosslt.messages.errors import BadHeader
from rosslt.messages.fields import VARIABLE
from rosslt.messages.inband import decoder, fields_and_provenance

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
        self.values: Sequence[Tuple[Any, Any]] = [_NOTHING] * (fields[1] - fields[0])


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
        self._blank, self._walks = blank(element_class), walkers(element_class)
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
        changed: List[_Element] = []
        leaf = field = 0
        for number in range(count):
            known = None if before is None else before.elements[number]
            if known is not None and data.startswith(known.data, at + known.skipped):
                if known.skipped:
                    stamped = known.message.header
                    stamped.seq, stamped.stamp.secs, stamped.stamp.nsecs = _STAMP.unpack_from(data, at)
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
                behind, _ = self._walks.locate(message, leaf, END, None, None, None)
                own = field, bisect.bisect_left(wanted, behind, field)
                skipped = _STAMP.size if self._has_header and wanted[field] >= leaf + _STAMP_LEAVES else 0
                element = _Element(message, data[at + skipped : to], skipped, lengths, leaf, own)
                leaf, field = behind, own[1]
            changed.append(element)
            elements.append(element)
            at = to
        if at != end or (before is None and wanted[field] != END):
            raise BadHeader('found more than the elements, or provenance of more than these')
        if header is not None:
            self._put_provenance(header, changed)
        return _Before(elements, provenance, header)

    def _put_provenance(self, header: ReceivedHeader, changed: Sequence[_Element]) -> None:
        """Put the provenance of a message onto those of its elements that have changed.

        A field that holds what it held in the message before, as the same provenance has it, keeps its tracked value.

        Raises:
            BadHeader: it does not fit.
        """
        found: List[Any] = []
        arrays: List[Any] = []
        numbers: List[int] = []
        before: List[Tuple[Any, Any]] = []
        for element in changed:
            first, behind = element.fields
            if first < behind:
                more = iter((*header.wanted[first:behind], END)).__next__
                self._walks.locate(element.message, element.leaf, more(), more, found.append, arrays.append)
                numbers.extend(range(first, behind))
                before.extend(element.values)
        plain = [value for _, _, value, _ in found]
        others = [at for at, (value, (earlier, _)) in enumerate(zip(plain, before)) if not _are_one(value, earlier)]
        tracked = [value for _, value in before]
        made = header.part([numbers[at] for at in others]).tracked([found[at] for at in others])
        for at, value in zip(others, made):
            tracked[at] = value
        put_located(found, tracked, arrays)
        values = zip(plain, tracked)
        for element in changed:
            element.values = list(itertools.islice(values, len(element.values)))


def _are_one(value: Any, earlier: Any) -> bool:
    """Whether two plain values of the same field are the same one: 0.0 and -0.0 are not, nor is NaN."""
    return bool(value == earlier and type(value) is type(earlier) and (value or repr(value) == repr(earlier)))
