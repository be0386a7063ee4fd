"""Where leaves are in the bytes of a serialized message."""

import functools
from typing import Any, Iterator, List, NamedTuple, Sequence, Tuple

from rosslt.messages.codegen.walkers import BYTES_LIMIT, END, walkers
from rosslt.messages.fields import BYTES, VARIABLE, Layout


class BytePlace(NamedTuple):
    """Where a leaf is in the bytes of a message."""

    at: int
    """Where it begins; a text begins with its length, in four bytes."""
    scalar: str
    """Its type, as `fields.SCALARS` has them."""


@functools.lru_cache(maxsize=256)
def byte_places(message_class: Any, lengths: Tuple[int, ...], indices: Tuple[int, ...]) -> Sequence[BytePlace]:
    """Where leaves are in each message of a class whose texts and arrays have certain lengths; remembered.

    Args:
        message_class: of the message.
        lengths: of the texts and arrays of variable length, as `walkers` measures them.
        indices: of the leaves, rising.

    Raises:
        IndexError: the message has not all of these leaves, or one is in an array of bytes that is taken for data.
    """
    layout = walkers(message_class).layout
    found = _Finder(layout, iter(lengths), indices)
    found.pass_members(layout.name)
    if len(found.places) < len(indices):
        raise IndexError('found no leaf %d' % indices[len(found.places)])
    return found.places


class _Finder:
    """Passes the fields of a message in the order of serialization.

    Attributes:
        places: what was found so far.
    """

    def __init__(self, layout: Layout, lengths: Iterator[int], indices: Sequence[int]) -> None:
        self.places: List[BytePlace] = []
        self._layout = layout
        self._lengths = lengths
        self._more = iter([*indices, END])
        self._wanted = next(self._more)
        self._at = 0  # where the next field begins
        self._index = 0  # of the next leaf

    def pass_members(self, type_: str) -> None:
        """Pass what is serialized one after the other for a message type, a time or a scalar."""
        members = self._layout.members(type_)
        if members is None:
            self._pass_leaf(type_)
            return
        for field in members:
            if field.length is None:
                self.pass_members(field.type)
                continue
            count = field.length
            if count == VARIABLE:
                count = next(self._lengths)
                self._at += 4
            self._pass_array(field.type, count)

    def _pass_leaf(self, scalar: str) -> None:
        if self._index == self._wanted:
            self._find(self._at, scalar)
        self._index += 1
        size = self._layout.size(scalar)
        self._at += 4 + next(self._lengths) if size is None else size

    def _pass_array(self, type_: str, count: int) -> None:
        leaves, size = self._layout.flat(type_), self._layout.size(type_)
        if leaves is None or size is None:
            for _ in range(count):
                self.pass_members(type_)
            return
        end = self._index + count * len(leaves)
        if self._wanted < end and type_ in BYTES and count > BYTES_LIMIT:
            raise IndexError('found leaf %d in %d bytes' % (self._wanted, count))
        starts = [0]
        for _, scalar in leaves:
            starts.append(starts[-1] + self._layout.size(scalar))  # type: ignore[operator]  # all have one here
        while self._wanted < end:
            element, leaf = divmod(self._wanted - self._index, len(leaves))
            self._find(self._at + element * size + starts[leaf], leaves[leaf][1])
        self._index = end
        self._at += count * size

    def _find(self, at: int, scalar: str) -> None:
        self.places.append(BytePlace(at, scalar))
        self._wanted = next(self._more)
