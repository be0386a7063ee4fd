"""Recorded bags."""

import contextlib
import os
import struct
import sys
from typing import Any, Dict, Iterator, Mapping, Optional, Sequence, Set, Tuple

import genpy
import rosbag

from rosslt.cli.failure import Failure
from rosslt.messages import LastProvenance, decode, topic_in
from rosslt.node import Directory, Heard

#: The message type of <node>/rosslt/locations.
_LOCATIONS_TYPE = 'rosslt/LocationList'

#: A serialized message as rosbag has it: type, data, md5sum, position, class.
Raw = Tuple[Any, ...]

#: The header of a connection in a bag.
Header = Mapping[str, Any]

#: Exceptions of rosbag for a damaged bag: its own, and those of unpacking, decompressing and decoding names.
_UNREADABLE = (rosbag.ROSBagException, genpy.DeserializationError, struct.error, OSError, EOFError, UnicodeDecodeError)


@contextlib.contextmanager
def opened(path: str) -> Iterator[rosbag.Bag]:
    """An open bag.

    Raises:
        Failure: there is none, or it cannot be read.
    """
    if not path:
        raise Failure('found an empty name in the place of the bag')
    try:
        bag = rosbag.Bag(path)
    except rosbag.ROSBagUnindexedException:
        raise Failure(f'{path} has no index: rosbag reindex makes one') from None
    except _UNREADABLE as error:
        raise Failure(f'cannot read {path}: {getattr(error, "strerror", None) or error}') from None
    with bag:
        try:
            yield bag
        except _UNREADABLE as error:
            if getattr(error, 'errno', None) is not None:
                raise  # of the system: it may be another file; what decompresses has no number
            raise Failure(f'cannot read {path}: {error}') from None


def messages(bag: rosbag.Bag, topics: Optional[Sequence[str]] = None) -> Iterator[Heard]:
    """The messages of a bag, in the order in which they were recorded.

    Plain ones between whole ones have the provenance of the last of these.
    """
    decoder = Decoder()
    for topic, raw, _, header in serialized(bag, topics):
        yield decoder.decode(topic, raw, header)


def serialized(
    bag: rosbag.Bag, topics: Optional[Sequence[str]] = None
) -> Iterator[Tuple[str, Raw, genpy.Time, Header]]:
    """Read the serialized messages of a bag, each with its topic, time and connection header."""
    return _read(bag, topics, raw=True, return_connection_header=True)


def _read(bag: rosbag.Bag, topics: Optional[Sequence[str]], **options: bool) -> Iterator[Any]:
    """Read the messages of a bag; a damaged bag raises ROSBagException instead of a LookupError."""
    try:
        yield from bag.read_messages(topics, **options)
    except LookupError as error:
        raise rosbag.ROSBagException(f'a record names {error}, which the bag does not have') from None


class Decoder:
    """Decodes serialized messages; plain ones between whole ones get the provenance of the last of these.

    Provenance that cannot be read is reported once a topic and publisher.
    """

    def __init__(self) -> None:
        self._reported: Set[Tuple[str, str]] = set()
        self._last = LastProvenance()

    def decode(self, topic: str, raw: Raw, header: Header) -> Heard:
        """The message that `serialized` gives."""
        publisher = header.get('callerid', b'')
        # rosbag reads the fields of a connection's header as bytes
        publisher = publisher.decode('utf-8', 'replace') if isinstance(publisher, bytes) else publisher
        message, error, is_sampled = decode(raw[1], raw[-1])
        if error is not None and (topic, publisher) not in self._reported:
            self._reported.add((topic, publisher))
            print(
                f'rosslt: {publisher or topic} sends a provenance on {topic} that cannot be read: {error}',
                file=sys.stderr,
            )
        # the class may differ: rosbag has one class for all types with the same fields, such as Point and Vector3
        message = self._last.completed(message, is_sampled, (topic, publisher))
        return Heard(topic, publisher, raw[0], message, is_sampled=is_sampled)


class ConnectionWriter:
    """Writes messages to a bag, each on a connection of its own publisher.

    By itself, rosbag writes all messages of a topic on the connection of the first one: they would all be of its
    publisher, and of its type. It has no public way to say which connection: what is set here is its own table of the
    last one of each topic.
    """

    def __init__(self, bag: rosbag.Bag) -> None:
        self._bag = bag
        self._written: Dict[int, Tuple[Header, Any]] = {}  # by the ids of headers: the header, and the connection

    def write(self, topic: str, raw: Raw, stamp: genpy.Time, header: Header) -> None:
        """Write a message.

        Args:
            topic, raw, stamp, header: as in `serialized`; messages of one connection have the same header object.
        """
        connections = self._bag._topic_connections
        known = self._written.get(id(header))
        if known is not None:
            connections[topic] = known[1]
        else:
            connections.pop(topic, None)
        self._bag.write(topic, raw, stamp, raw=True, connection_header=header)
        if known is None:
            self._written[id(header)] = header, connections[topic]


def take_names(bag: rosbag.Bag, directory: Directory) -> None:
    """Add the recorded locations of nodes to a directory."""
    topics = [name for name, topic in bag.get_type_and_topic_info().topics.items() if topic.msg_type == _LOCATIONS_TYPE]
    if topics:
        for _, told, _ in _read(bag, topics):
            directory.take(told.node, told.locations)


def split_topic(bag: rosbag.Bag, text: str) -> Tuple[str, str]:
    """TOPIC[/FIELD] as the longest recorded topic that it begins with, and the field.

    Raises:
        Failure: there is no such topic in the bag.
    """
    topics = bag.get_type_and_topic_info().topics
    text = '/' + text.lstrip('/')
    topic = topic_in(text, ['/' + name.lstrip('/') for name in topics])
    if topic is None:
        held = ', '.join(sorted(topics)) or 'none'
        raise Failure(f'{os.path.basename(bag.filename)} has no topic {text}, it has {held}')
    return topic, text[len('/' + topic.lstrip('/')) :].lstrip('/.')
