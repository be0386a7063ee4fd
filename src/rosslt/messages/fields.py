"""Fields of a message class, read from the definition that every genpy class carries with it.

So a class that genpy made at run time, of a bag or for `rostopic echo`, is as good as a generated one, and nothing is
looked for on the disk. The leaves of a message are its scalars in the order of their serialization; a time or duration
is two, an array of scalars is one for each element.
"""

import operator
import struct
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Tuple, Union

import genmsg
import genmsg.msg_loader
import genmsg.msgs
from genpy import Message
from genpy.generator import make_python_safe

MessageClass = Any
"""A message class of genpy, or a service class."""

Scalar = Union[bool, int, float, str]
"""What a leaf of a message holds, or should hold: a number, a bool or a text, tracked or plain."""

_SEPARATOR = '\n' + '=' * 80 + '\nMSG: '

#: The `struct` letter of each scalar type; None for a string, which has no fixed size.
SCALARS: Dict[str, Optional[str]] = {
    'bool': 'B',
    'int8': 'b',
    'uint8': 'B',
    'byte': 'b',
    'char': 'B',
    'int16': 'h',
    'uint16': 'H',
    'int32': 'i',
    'uint32': 'I',
    'int64': 'q',
    'uint64': 'Q',
    'float32': 'f',
    'float64': 'd',
    'string': None,
}

#: Types that genpy gives as `bytes` when they are elements of an array.
BYTES = ('uint8', 'char')

HEADER = 'std_msgs/Header'

#: A time and a duration are objects with two integers, in a message and in an array.
INSTANTS = {'time': ('secs', 'nsecs'), 'duration': ('secs', 'nsecs')}

VARIABLE = -1
"""The length of an array that has none by definition."""


class Field(NamedTuple):
    """A field of a message type: its name, its type and, for an array, its length."""

    name: str
    """The name of the attribute in the Python class."""
    type: str
    """The type of the field, or of its elements if it is an array; with its package if it is a message."""
    length: Optional[int]
    """None for a field that is not an array, VARIABLE, or the number of elements."""


#: The Python type of each kind of `kind_of`.
TYPE_OF_KIND = {'d': float, 'f': float, 'i': int, 'b': bool, 's': str}


def kind_of(scalar: str) -> str:
    """Return the kind of a scalar type: 'd' float, 'f' float of 32 bits, 'i' int, 'b' bool, 's' str."""
    if scalar in ('float32', 'float64', 'bool', 'string'):
        return {'float32': 'f', 'float64': 'd', 'bool': 'b', 'string': 's'}[scalar]
    return 'i'


def limits_of(scalar: str) -> Tuple[int, int]:
    """The least and the greatest number that a field of a type of whole numbers holds."""
    letter = SCALARS[scalar] or ''
    bits = 8 * struct.calcsize('<' + letter)
    least = 0 if letter.isupper() else -(1 << bits - 1)
    return least, least + (1 << bits) - 1


def whole_numbers(message_class: MessageClass) -> List[Tuple[Callable[[Message], Scalar], int, int]]:
    """The fields of a message class for whole numbers, without those of headers, times and arrays.

    Returns:
        Each with the function that reads it, and the least and the greatest number that it holds.
    """
    layout = Layout(message_class)
    return [
        (operator.attrgetter(path), *limits_of(field.type))
        for path, owner, field in layout.parts(layout.name)
        if field.length is None and kind_of(field.type) == 'i' and owner not in (*INSTANTS, HEADER)
    ]


class Layout:
    """The fields of a message type and of all that are nested in it.

    Args:
        message_class: a genpy message class: its `_type` and `_full_text` are read.
    """

    def __init__(self, message_class: type) -> None:
        texts = message_class._full_text.split(_SEPARATOR)  # type: ignore[attr-defined]
        self.name: str = message_class._type  # type: ignore[attr-defined]
        self.definitions: Dict[str, List[Field]] = {}
        self._add(self.name, texts[0])
        for text in texts[1:]:
            name, _, text = text.partition('\n')
            self._add(name.strip(), text)

    def _add(self, name: str, text: str) -> None:
        spec = make_python_safe(genmsg.msg_loader.load_msg_from_string(genmsg.MsgContext.create_default(), text, name))
        fields = []
        for type_, field in zip(spec.types, spec.names):
            base, is_array, length = genmsg.msgs.parse_type(type_)
            if length is None:
                length = VARIABLE
            fields.append(Field(field, base, length if is_array else None))
        self.definitions[name] = fields

    def members(self, type_: str) -> Optional[List[Field]]:
        """The fields of a message type, or of a time or duration; None for a scalar."""
        if type_ in INSTANTS:
            return [Field(name, 'int32' if type_ == 'duration' else 'uint32', None) for name in INSTANTS[type_]]
        return None if type_ in SCALARS else self.definitions[type_]

    def parts(self, type_: str, prefix: str = '') -> Iterator[Tuple[str, str, Field]]:
        """Yield the scalars and the arrays of a message type in the order of serialization: the path of each, the type
        that has it as a field, and that field."""
        for field in self.members(type_) or ():
            if field.length is None and field.type not in SCALARS:
                yield from self.parts(field.type, f'{prefix}{field.name}.')
            else:
                yield prefix + field.name, type_, field

    def flat(self, type_: str) -> Optional[List[Tuple[str, str]]]:
        """The `(path, scalar type)` of all leaves of a message type without arrays; None if it has arrays."""
        parts = list(self.parts(type_))
        has_array = any(field.length is not None for _, _, field in parts)
        return None if has_array else [(path, field.type) for path, _, field in parts]

    def size(self, type_: str) -> Optional[int]:
        """The number of bytes that a type serializes to; None if it varies."""
        members = self.members(type_)
        if members is None:
            letter = SCALARS[type_]
            return struct.calcsize('<' + letter) if letter else None
        total = 0
        for field in members:
            size = self.size(field.type)
            if size is None or field.length == VARIABLE:
                return None
            total += size * (1 if field.length is None else field.length)
        return total
