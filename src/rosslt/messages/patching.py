"""Serialized messages with other source values: their bytes are changed in place, where that is possible.

Decoding a message, evaluating its provenance and encoding it again takes many times as long; most of that goes into
objects that are thrown away.
"""

import struct
from typing import Any, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from rosslt.messages.byte_places import byte_places
from rosslt.messages.codec.bounded_cache import BoundedCache
from rosslt.messages.codec.patches import Patch, Replaced, Unfit
from rosslt.messages.codec.wire_format import BYTES_LIMIT
from rosslt.messages.codegen.walkers import walkers
from rosslt.messages.errors import BadHeader
from rosslt.messages.fields import SCALARS, kind_of
from rosslt.messages.inband import MAGIC, REFERENCE
from rosslt.messages.tracked_types import is_tracked_type, plain_type
from rosslt.values import Source

_FOOTER_SIZE = 8
_LENGTH = struct.Struct('<I')
_FLOAT = struct.Struct('<d')

MAX_PATCHES = 8
"""The most patches that are remembered for provenances of one class and length."""


class Patched(NamedTuple):
    """A serialized message as it would have been."""

    data: bytes
    is_changed: bool
    """Whether a leaf has another value."""
    is_linearized: bool
    """Whether part of its provenance holds near the recorded values only."""


class Patcher:
    """Gives serialized messages as they would have been with other source values.

    Args:
        changes: `{Source: value}`.
    """

    def __init__(self, changes: Mapping[Source, Any]) -> None:
        self._changes = dict(changes)
        self._nodes = {source.node.encode() for source in changes}
        self._patches: BoundedCache[List[_PlacedPatch]] = BoundedCache(256)

    def patched(self, data: bytes, message_class: Any) -> Optional[Patched]:
        """A message as it would have been.

        Args:
            data: a serialized message, with its provenance in full.
            message_class: its type, ordinary or tracked.

        Returns:
            The message, its leaves as `values.reapply` gives them and its provenance with the new source values; None
            where it has to be decoded for that, or to find out what is wrong with it.
        """
        if not is_tracked_type(message_class) and not data.endswith(MAGIC):
            return None if data.endswith(REFERENCE) else Patched(data, False, False)
        try:
            parts = _split(data, message_class)
            # a provenance names the nodes of its sources
            if parts is None or not any(node in parts.provenance for node in self._nodes):
                return Patched(data, False, False)
            patch, floats = self._patch_for(parts)
            return patch.applied(data, parts, floats) if patch.patch.leaves else Patched(data, False, False)
        except (Unfit, BadHeader, IndexError, OverflowError, UnicodeError, struct.error):
            return None

    def _patch_for(self, parts: '_Parts') -> Tuple['_PlacedPatch', Sequence[float]]:
        """The patch for a provenance, from one that was made before where there is one; and the floats in it."""
        # The last bytes are behind all floats. This only narrows the search.
        key = parts.message_class, len(parts.provenance), parts.provenance[-4:]
        known = self._patches.get(key) or []
        for each in known:
            floats = each.patch.match(parts.provenance)
            if floats is not None:
                return each, floats
        patch = _PlacedPatch(parts.message_class, Patch(parts.provenance, self._changes))
        self._patches.put(key, [patch, *known[: MAX_PATCHES - 1]])
        floats = patch.patch.match(parts.provenance)
        if floats is None:
            raise Unfit('the sum of its floats is not finite')
        return patch, floats


class _Parts(NamedTuple):
    """A serialized message with its provenance."""

    message_class: Any
    """The ordinary one."""
    message_at: int
    lengths: Tuple[int, ...]
    """Of texts and arrays in the message."""
    provenance: bytes
    provenance_at: int
    length_at: int
    """Where the length of the provenance is."""


def _split(data: bytes, message_class: Any) -> Optional[_Parts]:
    """The parts of a serialized message; None where what looks like a footer is part of the message.

    Raises:
        struct.error: it is cut short.
    """
    lengths: List[int] = []
    if is_tracked_type(message_class):
        inner, at = plain_type(message_class), _LENGTH.size
        end = at + _LENGTH.unpack_from(data)[0]
        if walkers(inner).measure(data, end, len(data), lengths.append) > len(data):
            raise struct.error('found %d bytes' % len(data))
        return _Parts(inner, end, tuple(lengths), data[at:end], at, 0)
    footer = len(data) - _FOOTER_SIZE
    end = walkers(message_class).measure(data, 0, len(data), lengths.append)
    if footer < 0 or end != footer - _LENGTH.unpack_from(data, footer)[0]:
        return None
    return _Parts(message_class, 0, tuple(lengths), data[end:footer], end, footer)


class _PlacedPatch:
    """A patch, and where its leaves are in messages of a class."""

    def __init__(self, message_class: Any, patch: Patch) -> None:
        self.patch = patch
        self._message_class = message_class
        self._places: BoundedCache[_Places] = BoundedCache(64)

    def applied(self, data: bytes, parts: _Parts, floats: Sequence[float]) -> Patched:
        """A message as it would have been, whose provenance has those floats."""
        places = self._places.get(parts.lengths)
        if places is None:
            places = _Places(self._message_class, parts.lengths, self.patch)
            self._places.put(parts.lengths, places)
        present = places.read(data, parts.message_at)
        found, moved = self.patch.computed(floats, present, places.kinds)
        made = bytearray(data)
        resized = places.write(made, parts.message_at, found)
        at = parts.provenance_at
        for start, value in moved:
            _FLOAT.pack_into(made, at + start, value)
        for start, end, new in self.patch.replaced:
            if len(new) == end - start:
                made[at + start : at + end] = new
            else:
                resized.append(Replaced(at + start, at + end, new))
        if resized:
            _resize(made, resized, parts)
        return Patched(bytes(made), found != present, self.patch.is_linearized)


def _resize(made: bytearray, resized: List[Replaced], parts: _Parts) -> None:
    """Replace parts of a message by such of other lengths."""
    size = len(parts.provenance)
    end = parts.provenance_at + size
    size += sum(len(new) - (to - start) for start, to, new in resized if parts.provenance_at <= start < end)
    if size > BYTES_LIMIT:
        raise Unfit('a provenance of %d bytes' % size)
    _LENGTH.pack_into(made, parts.length_at, size)
    for start, to, new in sorted(resized, reverse=True):
        made[start:to] = new


class _Places:
    """Where the leaves that a patch changes are in messages whose texts and arrays have certain lengths.

    Attributes:
        kinds: of each leaf, as of `fields.kind_of`.

    Raises:
        IndexError: the messages have not all leaves that are tracked.
        Unfit: one of them cannot be what the provenance says.
    """

    def __init__(self, message_class: Any, lengths: Tuple[int, ...], patch: Patch) -> None:
        places = dict(zip(patch.wanted, byte_places(message_class, lengths, patch.wanted)))
        for index, is_whole in patch.sums.items():
            kind = kind_of(places[index].scalar)
            if not (kind in 'df' or (kind == 'i' and is_whole)):
                raise Unfit('leaf %d is a sum' % index)
        form, end = '<', 0
        self.kinds: List[str] = []
        self._starts: List[int] = []
        self._packs: List[Any] = []
        for leaf in patch.leaves:
            at, scalar = places[leaf.leaf]
            letter = SCALARS[scalar]
            form += '%dx%s' % (at - end, letter or 'I')
            end = at + struct.calcsize('<' + (letter or 'I'))
            self.kinds.append(kind_of(scalar))
            self._starts.append(at)
            self._packs.append(struct.Struct('<' + letter).pack_into if letter else None)
        self._unpack_from = struct.Struct(form).unpack_from
        self._is_numeric = {'d', 'f', 'i'}.issuperset(self.kinds)

    def read(self, data: bytes, at: int) -> List[Any]:
        """What the leaves of a message are that begins there."""
        found = list(self._unpack_from(data, at))
        if not self._is_numeric:
            for place, (kind, start) in enumerate(zip(self.kinds, self._starts)):
                if kind == 'b':
                    found[place] = bool(found[place])
                elif kind == 's':
                    start += at + _LENGTH.size
                    found[place] = data[start : start + found[place]].decode()
        return found

    def write(self, made: bytearray, at: int, values: Sequence[Any]) -> List[Replaced]:
        """Write what the leaves are then; texts, whose lengths may differ, are returned instead."""
        texts: List[Replaced] = []
        for start, pack, value in zip(self._starts, self._packs, values):
            if pack is not None:
                pack(made, at + start, value)
            else:
                start += at
                text = value.encode()
                end = start + _LENGTH.size + _LENGTH.unpack_from(made, start)[0]
                texts.append(Replaced(start, end, _LENGTH.pack(len(text)) + text))
        return texts
