"""Messages that stay serialized, and are known by their type all the same."""

from typing import Any, Type

import roslib.message
import rospy


class NotBuilt(Exception):
    """A type of messages is not built here; the text says which."""


def raw_class(name: str) -> Type[Any]:
    """A class of messages of a type that keeps them serialized.

    Raises:
        NotBuilt: the type is not known.
    """
    known = roslib.message.get_message_class(name)
    if known is None:
        raise NotBuilt(f'the message type {name} is not built here')
    passed = {'_type': known._type, '_md5sum': known._md5sum, '_full_text': known._full_text}
    return type('Raw', (rospy.AnyMsg,), passed)
