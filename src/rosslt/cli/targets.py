"""What `rosslt teach` is to move: a thing, a field, a joint, or a location, by the name that a person gives."""

import time
from typing import Dict, NamedTuple, Optional, Tuple, Union

import genpy.message
import rosgraph

from rosslt import markers, messages
from rosslt.cli.directory import find
from rosslt.cli.failure import Failure
from rosslt.cli.master import full_field, split_topic
from rosslt.node import Directory
from rosslt.teach import JOINTS, Device, Field, Joints, Joystick, Numbers

#: The period in which the master is asked for what is not there yet, in seconds.
PERIOD = 0.2


class Meant(NamedTuple):
    """What a name stands for.

    Attributes:
        what: a field, a joint or a location; or the full name to be looked for among the things that can be dragged.
        also: what else has the name, as a sentence; '' if nothing has.
        missing: why it is no location, if it is nothing else either; else ''.
    """

    what: Union[str, Field]
    also: str = ''
    missing: str = ''


def wait_for(master: rosgraph.Master, text: str, device: Device, turns: bool, end: float) -> Meant:
    """Wait until a name stands for something. Topics come first, as for `rosslt explain` and `force`.

    Args:
        master: knows topics and nodes.
        text: TOPIC, TOPIC/FIELD, TOPIC:JOINT, TOPIC:NAMESPACE:ID, NODE/LOCATION or NODE#ID.
        device: is to move it.
        turns: whether a person has said which axes of a Joy turn a thing.
        end: until when to wait, a time of `time.monotonic`.

    Raises:
        Failure: nobody publishes such a topic, and the device moves numbers.
    """
    full, missing = full_field(text), ''
    while True:
        types = dict(master.getPublishedTopics('/'))
        found = _of_topic(full, types, device, turns)
        location, missing = _location(master, text)
        if found is not None and location is not None and location.place is not None:
            kind = 'thing' if isinstance(found, str) else 'field'
            return Meant(found, f'{text} is a {kind} and a location; for the location, say {location.place.source}')
        if found is not None or location is not None:
            return Meant(found or location or full)
        if time.monotonic() > end:
            break
        time.sleep(PERIOD)
    if isinstance(device, Numbers) or _path(full, types)[1]:
        return Meant(_field(master, text, missing), missing=missing)
    return Meant(full, missing=missing)


def wait_for_field(master: rosgraph.Master, text: str, end: float, is_measured: bool = False) -> Field:
    """Wait until a name stands for a field of a topic, or else for a location.

    Args:
        master, text, end: as of `wait_for`; TOPIC, TOPIC/FIELD, TOPIC:JOINT, NODE/LOCATION or NODE#ID.
        is_measured: whether it is measured, as a location is not.

    Raises:
        Failure: there is none.
    """
    full = full_field(text)
    head, _, joint = full.partition(':')
    while True:
        types = dict(master.getPublishedTopics('/'))
        if joint and head in types:
            if _type_of(types[head]) != JOINTS:
                raise Failure(f'{text} would be a joint of a {JOINTS}, and {head} is a {_type_of(types[head])}')
            return Field(head, '', joint)
        topic, path = _path(full, types)
        if topic and (not path or is_measured or _has(types[topic], path)):
            return Field(topic, path)
        location, missing = _location(master, text)
        if location is not None and not is_measured:
            return location
        if time.monotonic() > end:
            break
        time.sleep(PERIOD)
    if is_measured and location is not None:
        raise Failure(f'{text} is a location, and only a field of a topic is measured')
    return _field(master, text, missing)


def _field(master: rosgraph.Master, text: str, missing: str) -> Field:
    """The field of a topic that a name stands for if it stands for no location, for the reason given.

    Raises:
        Failure: nobody publishes the topic.
    """
    try:
        topic, _, path = split_topic(master, text)
    except Failure as failure:
        raise Failure(f'{failure}; nor is it a location: {missing}') from None
    return Field(topic, path)


def _of_topic(full: str, types: Dict[str, str], device: Device, turns: bool) -> Union[None, str, Field]:
    """The field, joint or thing of a topic that a name stands for; None if it stands for none."""
    head, _, tail = full.partition(':')
    if tail and head in types:
        takes_joints = isinstance(device, Numbers) or (isinstance(device, Joystick) and not turns)
        return Field(head, '', tail) if takes_joints and _type_of(types[head]) == JOINTS else full
    topic, path = _path(full, types)
    if not topic:
        return None
    if path:
        return Field(topic, path) if _has(types[topic], path) else None
    if isinstance(device, Numbers):
        return Field(topic, '') if isinstance(device, Joints) and _type_of(types[topic]) == JOINTS else None
    return full if markers.is_visible(topic, types[topic]) else None


def _path(full: str, types: Dict[str, str]) -> Tuple[str, str]:
    """The topic that a name begins with, and the path behind it; '' if it begins with none."""
    topic = messages.topic_in(full, types) or ''
    return topic, full[len(topic) :].strip('/.') if topic else ''


def _class_of(type_: str) -> Optional[messages.MessageClass]:
    """The class of the ordinary messages of a type on the wire; None if it is not installed here."""
    found = genpy.message.get_message_class(type_) if '/' in type_ else None
    return messages.plain_type(found) if found is not None and messages.is_tracked_type(found) else found


def _type_of(type_: str) -> str:
    return getattr(_class_of(type_), '_type', type_)


def _has(type_: str, path: str) -> bool:
    """Return whether messages of a type may have a part at a path: they have its first field, as far as known."""
    message_class = _class_of(type_)
    try:
        return message_class is None or messages.path_steps(path)[0] in message_class.__slots__
    except ValueError:
        return False


def _location(master: rosgraph.Master, text: str) -> Tuple[Optional[Field], str]:
    """The location of that name, or why there is none."""
    try:
        return Field.of_location(find(master, Directory(), text)), ''
    except Failure as failure:
        return None, str(failure)
