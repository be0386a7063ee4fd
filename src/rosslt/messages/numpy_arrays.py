"""Arrays of Python objects in messages that are serialized by NumPy.

A class that `rospy.numpy_msg` makes writes the memory of its arrays. If elements are tracked, NumPy makes arrays of
objects, whose memory is addresses: so they are replaced by arrays of the fields' own types before.
"""

import copy
import functools
import operator
import struct
from typing import Any, Callable, List

import genpy

from rosslt.messages.fields import BYTES, SCALARS, Field, Layout, Message, MessageClass
from rosslt.messages.walkers import walkers
from rosslt.values import is_object_array


@functools.lru_cache(maxsize=None)
def packed_arrays(message_class: MessageClass) -> Callable[[Any], Any]:
    """`pack(message)`: the message as a class of `rospy.numpy_msg` serializes it rightly.

    It is the message itself if it has no array of objects, or its class writes values one by one; else a copy in
    which these arrays hold numbers.

    Raises (`pack`):
        genpy.SerializationError: an element is not a number of the field's type.
    """
    if message_class.serialize.__module__ != 'rospy.numpy_msg':
        return lambda message: message
    layout = walkers(message_class).layout
    return lambda message: _packed(message, layout.definitions[layout.name], layout)


def _packed(message: Message, fields: List[Field], layout: Layout) -> Message:
    result = message
    for field in fields:
        inner = None if field.type in SCALARS else layout.definitions.get(field.type)
        value = getattr(message, field.name)
        if inner is not None and field.length is None:
            packed: Any = _packed(value, inner, layout)
        elif inner is not None:
            elements = [_packed(element, inner, layout) for element in value]
            packed = value if all(map(operator.is_, elements, value)) else elements
        elif field.length is not None and SCALARS.get(field.type) and is_object_array(value):
            packed = _numbers(value, field)
        else:
            continue
        if packed is not value:
            if result is message:
                result = copy.copy(message)
            setattr(result, field.name, packed)
    return result


def _numbers(array: Any, field: Field) -> Any:
    """The elements as genpy writes those of a list, in an array of the field's type."""
    import numpy  # which is there where its arrays are

    form = '<%d%s' % (array.size, SCALARS[field.type])
    try:
        data = struct.pack(form, *array.flat)
    except struct.error as error:
        raise genpy.SerializationError(
            'field %s is not an array of %s: %s' % (field.name, field.type, error)
        ) from error
    if field.type in BYTES:
        return data  # which genpy writes as it is
    return numpy.frombuffer(data, '<' + form[-1]).reshape(array.shape)
