"""The tracked fields of messages: found, and compared with those of earlier messages.

A field is an index among the flattened fields of a message, a value and its kind.
"""

import struct
from typing import Any, Callable, Container, List, NamedTuple, Optional, Sequence, Tuple

from .accelerator import CORE
from .tracked import TRACKED, is_made_alike, plain_scalar

Field = Tuple[int, Any, str]
"""The index of a field, its value and its kind."""


def select_tracked(
    values: Tuple[Any, ...], index: int, kinds: Tuple[str, ...], found: List[Field], before: Sequence[Field] = ()
) -> None:
    """Append `(its index, the value, its kind)` for each tracked one among values.

    Args:
        values: of any classes.
        index: of the first one.
        kinds: as many.
        found: is extended.
        before: what was found in an earlier message; what is the same in its place there is appended as it is.
    """
    for place, value in enumerate(values):
        if type(value) in TRACKED:
            at = len(found)
            is_known = at < len(before) and before[at][1] is value and before[at][0] == index + place
            found.append(before[at] if is_known else (index + place, value, kinds[place]))


def replaced_fields(found: Sequence[Field], before: Sequence[Field]) -> Optional[List[int]]:
    """The places of those among some fields whose values are others than before; None where they are other fields.

    Args:
        found, before: as `select_tracked` finds them.
    """
    if len(found) != len(before):
        return None
    if any(field[0] != earlier[0] or field[2] != earlier[2] for field, earlier in zip(found, before)):
        return None
    return [place for place, field in enumerate(found) if field[1] is not before[place][1]]


if CORE is not None:
    replaced_fields = CORE.replaced_fields


class WrittenFields(NamedTuple):
    """The tracked fields of an earlier message, in their order, as later messages are compared with them."""

    indices: bytes
    """Their indices, an int of 32 bits each;"""
    values: Tuple[Any, ...]
    kinds: bytes
    """a letter for each;"""
    moving: bytes
    """1 for each that may have other values in later messages, and 0 for others."""


def written_fields(fields: Sequence[Field], moving: Container[int]) -> WrittenFields:
    """Fields of an earlier message, to be compared with those of later ones.

    Args:
        fields: as `select_tracked` finds them.
        moving: the indices of those that may have other values.
    """
    indices = [index for index, _, _ in fields]
    return WrittenFields(
        struct.pack('%di' % len(indices), *indices),
        tuple([value for _, value, _ in fields]),
        ''.join([kind for _, _, kind in fields]).encode(),
        bytes([index in moving for index in indices]),
    )


#: What `compare_fields` tells of a field.
HOLDS_NOT, HOLDS, IS_PLAIN = 0, 1, 2


def compare_fields(
    found: Sequence[Field], written: WrittenFields, plain_at: Callable[[List[int]], List[Tuple[Any, str]]]
) -> bytes:
    """For which fields of an earlier message does hold for a later one what was written of them?

    Args:
        found: the fields of the later message, as `select_tracked` finds them.
        written: those of the earlier one.
        plain_at: gives the values and kinds of others of its fields by their indices, which rise; as far as there are.

    Returns:
        of each field of the earlier message HOLDS where its value is the same one, or was made alike, and is equal
        where the field does not move; IS_PLAIN where it is not tracked, and is equal where it does not move; else
        HOLDS_NOT.
    """
    by_index = {field[0]: field for field in found}
    indices = [index for (index,) in struct.iter_unpack('i', written.indices)]
    plain = [index for index in indices if index not in by_index]
    others = dict(zip(plain, plain_at(plain)))
    told = bytearray(len(indices))
    for place, index in enumerate(indices):
        value, kind = by_index[index][1:] if index in by_index else others.get(index, (None, ''))
        earlier = written.values[place]
        if kind == chr(written.kinds[place]) and (
            value is earlier or written.moving[place] or is_equal(value, earlier)
        ):
            if index in others:
                told[place] = IS_PLAIN
            elif is_made_alike(value, earlier):
                told[place] = HOLDS
    return bytes(told)


def is_equal(one: Any, other: Any) -> bool:
    """Whether two values are both floats, both whole numbers or both texts, and equal, whatever they were made of."""
    kinds = [kind for kind in (float, int, str) if isinstance(one, kind) and isinstance(other, kind)]
    return bool(kinds) and bool(plain_scalar(one) == plain_scalar(other))


Member = Tuple[str, Any, int, int]
"""A field of a message class: its name; the kind of a scalar, or of the elements of an array of scalars, or else the
`FieldWalk` of the message; its length, -1 for an array of variable length and -2 where it is no array; and the longest
array in which a scalar may be tracked."""


def field_walk(members: Tuple[Member, ...], items_of: Callable[[Any], Any]) -> Any:
    """The core's walk of the fields of a message class; None without the core.

    `walk(message, index, found, limit, before)` appends as `select_tracked` does for each field, little more than
    `limit`, and returns how many leaves there are in all. `walk.compare(message, written)` returns what
    `compare_fields` does, how many leaves of the message are tracked, and how many there are in all.

    Args:
        members: the fields of the class.
        items_of: gives the elements of an array that is no list or tuple, if they may be tracked.
    """
    return None if CORE is None else CORE.FieldWalk(members, items_of)
