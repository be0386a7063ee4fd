"""What a node hears and sends, and the numbers in it: as they come, changed, and played to a twin."""

import copy
import math
import os
import statistics
import time
from typing import Any, Dict, Hashable, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import genpy
import rosbag
import rosgraph
import roslib.message
import rospy

from rosslt import messages, values
from rosslt.models.processes import LiveProcess, NotCopied
from rosslt.models.raw_messages import raw_class
from rosslt.models.twin import Timed

#: What every node has, and nobody computes from.
IGNORED = ('/rosout', '/rosout_agg')

#: So long may it take until all publishers are connected, in seconds. One that has crashed never is.
CONNECTS = 10.0

_Key = Tuple[str, Hashable]
"""A topic, and a thing on it."""


class Number(NamedTuple):
    """A number of a message, or a parameter.

    Attributes:
        topic: the full name of the topic, or of the parameter.
        thing: what the message is about, as `messages.thing_of` names it.
        path: of the field, `position[2]`; '' of a parameter.
    """

    topic: str
    thing: Hashable
    path: str

    @property
    def name(self) -> str:
        """TOPIC/FIELD, or the parameter."""
        return '/'.join(filter(None, (self.topic, self.path.replace('.', '/'))))


class Recording(NamedTuple):
    """What a node has heard and sent.

    Attributes:
        inputs, outputs: messages with the seconds since it began, negative before, in the order in which they came.
        types: {topic: the class of its messages}.
        seconds: how long it took.
    """

    inputs: List[Timed]
    outputs: List[Timed]
    types: Mapping[str, Any]
    seconds: float

    def read(self, topic: str, serialized: bytes) -> Any:
        """The message that bytes are."""
        return self.types[topic]().deserialize(serialized)

    def last(self, sent: Sequence[Timed]) -> Dict[_Key, Any]:
        """The last message of each thing."""
        found: Dict[_Key, Any] = {}
        for _, topic, serialized in sent:
            message = self.read(topic, serialized)
            found[topic, messages.thing_of(message)] = message
        return found

    def period(self, key: _Key) -> float:
        """The median of the seconds between the messages of an input; infinite if it came once."""
        came = [when for when, topic, _ in self.inputs if topic == key[0]]
        gaps = [later - earlier for earlier, later in zip(came, came[1:])]
        return max(0.001, statistics.median(gaps)) if gaps else math.inf


def inputs_and_outputs(process: LiveProcess) -> Tuple[Dict[str, str], Dict[str, str]]:
    """{topic: type} of what a node may compute from, and of what it sends."""
    subscribed = {topic: name for topic, name in process.subscribed.items() if topic not in IGNORED}
    return subscribed, {topic: name for topic, name in process.published.items() if topic not in IGNORED}


def record(process: LiveProcess, seconds: float) -> Recording:
    """Listen to what a live node hears and sends.

    Args:
        process: the node's; this process is a node as well.
        seconds: for so long, from when all publishers are connected. What comes before, as latched messages do, has a
            negative time.

    Raises:
        NotCopied: the node has ended meanwhile.
    """
    inputs, outputs = inputs_and_outputs(process)
    heard: List[Timed] = []
    sent: List[Timed] = []

    def take(message: rospy.AnyMsg, topic: str) -> None:
        is_own = message._connection_header.get('callerid') == process.node
        came = time.monotonic(), topic, bytes(message._buff)
        if is_own:
            sent.append(came)  # a twin sends to itself as well
        elif topic in inputs:
            heard.append(came)

    subscribers = [
        rospy.Subscriber(topic, raw_class(name), take, topic, tcp_nodelay=True)
        for topic, name in {**inputs, **outputs}.items()
    ]
    publishers = dict(rosgraph.Master(rospy.get_name()).getSystemState()[0])
    deadline = time.monotonic() + CONNECTS
    while time.monotonic() < deadline and any(
        one.get_num_connections() < len(publishers.get(one.resolved_name, ())) for one in subscribers
    ):
        rospy.rostime.wallsleep(0.01)
    begin = time.monotonic()
    rospy.rostime.wallsleep(seconds)
    for subscriber in subscribers:
        subscriber.unregister()
    if not os.path.exists(f'/proc/{process.pid}/exe'):  # neither ended nor left unwaited for
        raise NotCopied(f'{process.node} has ended while it was listened to')
    since = [[(when - begin, topic, data) for when, topic, data in sorted(part)] for part in (heard, sent)]
    return Recording(since[0], since[1], _classes({**inputs, **outputs}), seconds)


def recorded(process: LiveProcess, file: str) -> Recording:
    """Read from a bag what a node has heard and sent.

    Args:
        process: the node's.
        file: the path of the bag.

    Raises:
        OSError, rosbag.ROSBagException: it cannot be read.
    """
    inputs, outputs = inputs_and_outputs(process)
    heard: List[Timed] = []
    sent: List[Timed] = []
    with rosbag.Bag(file) as bag:
        begin, end = bag.get_start_time(), bag.get_end_time()
        for topic, raw, when, header in bag.read_messages([*inputs, *outputs], raw=True, return_connection_header=True):
            came = when.to_sec() - begin, topic, bytes(raw[1])
            # rosbag reads the fields of a connection's header as bytes
            if header.get('callerid') in (process.node, process.node.encode()):
                sent.append(came)
            elif topic in inputs:
                heard.append(came)
    return Recording(sorted(heard), sorted(sent), _classes({**inputs, **outputs}), end - begin)


def _classes(types: Mapping[str, str]) -> Dict[str, Any]:
    return {topic: roslib.message.get_message_class(name) for topic, name in types.items()}


def numbers_in(things: Mapping[_Key, Any]) -> List[Tuple[Number, float]]:
    """The floats in messages, with their values: finite ones, as no step leads away from others."""
    return [
        (Number(topic, thing, path), float(leaf))
        for (topic, thing), message in things.items()
        for path, leaf in values.leaves(message)
        if type(leaf) is float and math.isfinite(leaf)
    ]


def with_numbers(message: Any, changed: Mapping[str, float]) -> Any:
    """A message with other numbers at some paths, with headers of its own."""
    paths = iter([path for path, leaf in values.leaves(message) if type(leaf) in (bool, int, float, str)])
    return values.rebuilt(message, lambda leaf: changed.get(next(paths), leaf))


def stamp_of(message: Any) -> Optional[Tuple[int, int]]:
    """The stamp of the first header of a message; None if it has none, or one of 0."""
    for header in _headers(message):
        return (header.stamp.secs, header.stamp.nsecs) if header.stamp else None
    return None


def stamped(message: Any, now: genpy.Time) -> Any:
    """A message whose headers have another time, if they have one; the headers are copied."""
    moved = copy.deepcopy(message)
    for header in _headers(moved):
        if header.stamp:
            header.stamp = now
    return moved


def _headers(part: Any) -> Iterator[Any]:
    if getattr(part, '_type', '') == 'std_msgs/Header':
        yield part
    elif isinstance(part, genpy.Message):
        for name in part.__slots__:
            yield from _headers(getattr(part, name))
    elif isinstance(part, (list, tuple)) and part and isinstance(part[0], genpy.Message):
        for one in part:
            yield from _headers(one)
