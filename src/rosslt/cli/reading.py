"""Messages with their provenance, from topics and from bags, whatever their type."""

import contextlib
import functools
import queue
import sys
import threading
import time
from typing import Any, Callable, Dict, Iterable, Iterator, List, NamedTuple, Optional, Set, Tuple

import genpy
import genpy.dynamic
import genpy.message
import rosgraph
import rospy

from rosslt import messages, node
from rosslt.cli.failure import Failure, did_you_mean
from rosslt.cli.master import full_name, system_state

#: Interval at which a wait checks for the node's shutdown, in seconds.
_SHUTDOWN_CHECK_PERIOD = 0.1

#: Time to wait for the other publishers of a topic after the first message, in seconds.
_GATHERING = 1.0

#: The number of messages that are queued for reading before their publishers have to wait.
_BACKLOG = 100


#: genpy makes one class at a time: it puts a folder on the path of the whole process.
_making = threading.Lock()


class Received(NamedTuple):
    """A message with tracked leaves, whichever way it came."""

    topic: str
    publisher: str
    """The publishing node; '' where that was not recorded."""
    type: str
    """The type on the wire."""
    message: Any
    """An ordinary message, also where the type on the wire is a tracked one."""
    is_latched: bool = False
    """True for a latched publisher, which sends its last message to later subscribers."""
    is_sampled: bool = False
    """True for a message that was sent plain between whole ones, although a leaf of it is tracked."""
    size: int = 0
    """The bytes of the message, and those of them that are provenance; 0 where they were not counted."""
    provenance_size: int = 0


@functools.lru_cache(maxsize=None)
def _message_class(type_: str, md5sum: str, definition: str) -> Any:
    """The class of a type, made from its definition where it is not installed as it was sent."""
    found = genpy.message.get_message_class(type_)
    if found is None or found._md5sum != md5sum:
        with _making:
            found = genpy.dynamic.generate_dynamic(type_, definition)[type_]
    return found


class Decoder:
    """Decodes serialized messages; provenance that cannot be read is reported once a topic and publisher."""

    def __init__(self) -> None:
        self._reported: Set[Tuple[str, str]] = set()

    def decode(self, data: bytes, message_class: Any, topic: str, publisher: str = '') -> Received:
        """The Received that serialized data is."""
        message, error, is_sampled = messages.decode(data, message_class)
        if error is not None and (topic, publisher) not in self._reported:
            self._reported.add((topic, publisher))
            print(
                f'rosslt: {publisher or topic} sends a provenance on {topic} that cannot be read: {error}',
                file=sys.stderr,
            )
        return Received(topic, publisher, message_class._type, message, is_sampled=is_sampled)


def start_node() -> None:
    """Make this process a node with a unique name and without locations; once."""
    if not node.is_initialized():
        # without arguments, as private parameters among them would be left behind
        rospy.init_node('rosslt', anonymous=True, disable_rosout=True, argv=[])


class Inbox:
    """The messages of topics as they come, for a node that owns nothing.

    Args:
        topics: their full names.
        is_exact: leave out messages between whole ones, instead of completing them from the last whole one.
    """

    def __init__(self, topics: Iterable[str], is_exact: bool = False) -> None:
        self._is_exact = is_exact
        self._queue: queue.Queue[Received] = queue.Queue(_BACKLOG)
        self._decoder = Decoder()
        self._last = messages.LastProvenance()
        start_node()
        self._subscribers: List[rospy.Subscriber] = [
            rospy.Subscriber(topic, rospy.AnyMsg, self._take, topic) for topic in topics
        ]

    def _take(self, message: genpy.Message, topic: str) -> None:
        header = message._connection_header
        if isinstance(message, rospy.AnyMsg):
            data = message._buff
            message_class = _message_class(header['type'], header['md5sum'], header['message_definition'])
            received = self._decoder.decode(data, message_class, topic, header['callerid'])
            received = received._replace(size=len(data), provenance_size=messages.provenance_size(data, message_class))
        else:
            # rospy itself listens to /clock where use_sim_time is set, and all subscribers of a topic in a process
            # share the class of the first one
            received = Received(topic, header['callerid'], message._type, message)
        if received.is_sampled and self._is_exact:
            return
        message = self._last.completed(received.message, received.is_sampled, (topic, received.publisher))
        self._queue.put(received._replace(message=message, is_latched=header.get('latching') == '1'))

    def during(self, seconds: float) -> Iterator[Received]:
        """The Received of that time, as they come."""
        end = time.monotonic() + seconds
        while True:
            received = self.next_before(end)
            if received is None:
                return
            yield received

    def next_before(self, end: Optional[float]) -> Optional[Received]:
        """The next Received; None where there is none until a time of `time.monotonic`, if one is given.

        Raises:
            KeyboardInterrupt: this process has to end.
        """
        while end is None or time.monotonic() < end:
            left = _SHUTDOWN_CHECK_PERIOD if end is None else max(0.0, end - time.monotonic())
            with contextlib.suppress(queue.Empty):
                return self._queue.get(timeout=min(left, _SHUTDOWN_CHECK_PERIOD))
            if rospy.is_shutdown():
                # rospy handles the interrupt itself
                raise KeyboardInterrupt
        return None

    def clear(self) -> None:
        """Drop messages that have arrived and were not read, so that the next one is new."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._queue.get_nowait()

    def __enter__(self) -> 'Inbox':
        return self

    def __exit__(self, *_: object) -> None:
        for subscriber in self._subscribers:
            subscriber.unregister()


def heard_publishers(
    master: rosgraph.Master,
    inbox: Inbox,
    topic: str,
    timeout: float,
    publisher: Optional[str] = None,
    is_meant: Callable[[Received], bool] = lambda received: True,
) -> List[Received]:
    """A message of each node that publishes a topic, in the order of their names.

    Args:
        master: knows who publishes it.
        inbox: listens to that topic alone.
        topic: its full name.
        timeout: the time to wait for the first message, in seconds.
        publisher: wait for this node alone.
        is_meant: returns True for a message to wait for; others are passed over.

    Raises:
        Failure: nobody sends such a message in time, or the publisher is none.
    """
    awaited = system_state(master).publishers.get(topic, [])
    if publisher is not None:
        name = full_name(publisher)
        if name not in awaited:
            raise Failure(
                f'{name} does not publish {topic}{did_you_mean(name, awaited)}: ' + ', '.join(sorted(awaited))
            )
        awaited = [name]
    found: Dict[str, Received] = {}
    end = time.monotonic() + timeout
    while set(awaited) - found.keys():
        received = inbox.next_before(end)
        if received is None:
            break
        if (publisher is not None and received.publisher != awaited[0]) or not is_meant(received):
            continue
        if not found:
            end = min(end, time.monotonic() + _GATHERING)
        found.setdefault(received.publisher, received)
    if not found:
        raise Failure(f'no message within {timeout:g} s')
    return [found[name] for name in sorted(found)]
