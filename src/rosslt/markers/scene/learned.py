"""Messages of nodes that nobody tracks, with the provenance that they have by what was learned of the nodes."""

import math
import os
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Any, Callable, Collection, Deque, Dict, Hashable, List, NamedTuple, Optional, Tuple

import rosgraph
import rospy

from rosslt import messages, node, values
from rosslt.markers.faults import contained
from rosslt.markers.scene.basis import Basis

if TYPE_CHECKING:
    from rosslt.models import Following, Moment  # NumPy and SciPy: loaded once anything was learned

#: Called with a message as it was heard, the message to show, and what its provenance comes from, None if it is plain.
Show = Callable[[node.Heard, messages.Message, Optional[Basis]], None]

#: The period in which the same warning is repeated at most, in seconds.
WARNING_PERIOD = 60.0


class Look(NamedTuple):
    """All that has to be the same if what was learned of a node was fresh and still is.

    Attributes:
        changed: when the folder of the files last changed, in nanoseconds since 1970.
        pid: the node's.
        topics: what it sends and hears, as the master knows it.
    """

    changed: int
    pid: Optional[int]
    topics: Collection[Tuple[bool, str]]


class Stream:
    """The messages of a thing that a node sends.

    Args:
        following: the numbers of the thing as functions of the node's inputs.
        publisher: the node.
        learned_at: as in Basis.
        show: takes the messages.
    """

    def __init__(self, following: 'Following', publisher: str, learned_at: float, show: Show) -> None:
        self.following, self._publisher, self._learned_at, self._show = following, publisher, learned_at, show
        self._waiting: Deque[Tuple[float, node.Heard]] = deque()  # for inputs of their stamps, since when
        self._is_tracked = False  # the message that is shown

    def take(self, heard: node.Heard) -> None:
        """A message has come. It waits for its inputs; if the one before has no provenance, it is shown meanwhile."""
        self._waiting.append((time.monotonic(), heard))
        self.go_on()
        if self._waiting and not self._is_tracked:
            self._show(heard, heard.message, None)

    def go_on(self) -> None:
        """Show the messages that wait no more."""
        while self._waiting:
            came, heard = self._waiting[0]
            is_due = time.monotonic() >= self.following.due(heard.message, came)
            moment = self._moment(heard, came, is_due)
            if moment is None and not is_due:
                return
            if moment is None and self._is_tracked:  # no input has been there for so long; its handle stays
                moment = self._moment(heard, math.inf, True)
                moment = moment and moment._replace(is_settled=False)
            self._waiting.popleft()
            self._is_tracked = moment is not None and values.is_tracked(moment.inputs)
            if moment is None or not self._is_tracked:
                self._show(heard, heard.message, None)
            else:
                made = self.following.made(moment)
                made._connection_header = heard.message._connection_header
                basis = Basis(self.following, moment, self._publisher, self._learned_at)
                self._show(heard, made, basis)

    def _moment(self, heard: node.Heard, came: float, is_due: bool) -> 'Optional[Moment]':
        try:
            return self.following.moment(heard.message, came, is_due)
        except values.NotInvertible as error:
            rospy.logwarn_throttle_identical(
                WARNING_PERIOD, f'{heard.topic} stays without what was learned of {heard.publisher}: {error}'
            )
            return None


class LearnedNodes:
    """The nodes on some topics of which something was learned.

    What was learned of a node is compared with the node when it appears, and when a file that was learned, the node's
    process or its topics change. The topics of its inputs are subscribed to meanwhile.

    Args:
        master: the ROS master.
        show: takes the messages.
    """

    def __init__(self, master: rosgraph.Master, show: Show) -> None:
        self._master, self._show = master, show
        self._lock = threading.Lock()  # each connection to a topic has a thread
        self._looks: Dict[str, Look] = {}
        self._streams: Dict[str, Dict[Tuple[str, Hashable], Stream]] = {}
        self._reader = node.TopicReader(self._hear, of_moved=True)

    def follow(self, topics: Collection[str], publishers: Any, subscribers: Any, types: Dict[str, str]) -> None:
        """Look at what was learned of the nodes that send topics.

        Args:
            topics: those that are watched.
            publishers, subscribers, types: as in Graph.
        """
        names = {name for topic in topics for name in publishers.get(topic, ())}
        if not node.is_any_learned():
            names = set()
        for name in self._looks.keys() - names:
            self._forget(name)
        changed = os.stat(node.learned_folder()).st_mtime_ns if names else 0
        for name in sorted(names):
            with contained(f'what was learned of {name} cannot be used'):
                self._look_at(name, changed, publishers, subscribers)
        with self._lock:
            streams = self._all()
            for stream in streams:
                stream.go_on()
        inputs = {topic for stream in streams for topic in stream.following.topics}
        self._reader.follow({topic: types[topic] for topic in inputs if topic in types})

    def take(self, heard: node.Heard) -> bool:
        """Take in a message; False if nothing was learned of its numbers."""
        streams = self._streams.get(heard.publisher)
        stream = streams and streams.get((heard.topic, messages.thing_of(heard.message)))
        if not stream:
            return False
        with self._lock:
            stream.take(heard)
        return True

    def _hear(self, heard: node.Heard) -> None:
        came = time.monotonic()
        with contained(f'a message on {heard.topic} cannot be read'), self._lock:
            for stream in self._all():
                if heard.topic in stream.following.topics:
                    stream.following.hear(heard.topic, heard.publisher, heard.message, came)
                    stream.go_on()

    def _all(self) -> List[Stream]:
        return [stream for streams in self._streams.values() for stream in streams.values()]

    def _forget(self, name: str) -> None:
        del self._looks[name]
        self._put(name, {})

    def _put(self, name: str, streams: Dict[Tuple[str, Hashable], Stream]) -> None:
        with self._lock:
            self._streams = {**self._streams, name: streams}
            if not streams:
                del self._streams[name]

    def _look_at(self, name: str, changed: int, publishers: Any, subscribers: Any) -> None:
        before = self._looks.get(name)
        if before is not None and before.changed == changed and before.pid is None and not before.topics:
            return  # nothing was learned of it
        from rosslt import models

        if before is None or before.changed != changed:
            self._looks[name] = Look(changed, None, ())
            self._put(name, {})
            if models.kept_of(node.learned_folder(), name) is None:
                return
        topics = {
            (is_sent, topic)
            for is_sent, nodes in ((True, publishers), (False, subscribers))
            for topic, names in nodes.items()
            if name in names
        }
        look = Look(changed, node.pid_of(self._master, name), topics)
        if look == before:
            return
        self._looks[name] = look
        self._put(name, {})
        fresh = models.fresh_of(self._master, node.learned_folder(), name) if look.pid is not None else None
        if fresh is None:
            return
        if fresh.kept is None:
            rospy.loginfo('what was learned of %s is not used: %s', name, fresh.why_stale)
            return
        answers, when = fresh.kept.answers, fresh.kept.when
        self._put(
            name,
            {
                (topic, thing): Stream(models.Following(answers, topic, thing, '', paths), name, when, self._show)
                for (topic, thing), paths in models.followed_things(answers).items()
            },
        )
        rospy.loginfo('what was learned of %s gives provenance', name)
