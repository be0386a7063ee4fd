"""The watched topics: those of types that RViz shows, ordinary and tracked ones, as they appear and disappear."""

import functools
import threading
from typing import Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Set

import rosgraph
import roslib.message
import rospy

from rosslt import messages, node
from rosslt.markers.faults import contained
from rosslt.markers.scene.basis import Basis
from rosslt.markers.scene.by_type import KINDS, kind_of
from rosslt.markers.scene.fixed_frames import FixedFrames
from rosslt.markers.scene.learned import LearnedNodes
from rosslt.markers.scene.scene import MARKER_TYPES, Scene

#: The period of looking up topics and publishers, in seconds.
PERIOD = 0.7


def visible_types() -> Set[str]:
    """The types of messages that can be seen in RViz, and may be dragged there."""
    return {*MARKER_TYPES, *KINDS}


class Graph(NamedTuple):
    """The graph of nodes, as the master knows it.

    Attributes:
        publishers, subscribers: {topic: [node, ...]}.
        services: the names of all services.
        types: {topic: its type} of the topics that are published.
    """

    publishers: Dict[str, List[str]]
    subscribers: Dict[str, List[str]]
    services: List[str]
    types: Dict[str, str]


class Watch:
    """Subscriptions to all topics whose messages can have handles.

    Args:
        scene: takes the messages.
        topics: the names of the topics to watch; by default all of types that can be seen.
        also: called with each Graph that is looked at.
    """

    def __init__(self, scene: Scene, topics: Iterable[str] = (), also: Sequence[Callable[[Graph], None]] = ()) -> None:
        self._scene, self._also, self._fixed_frames = scene, also, FixedFrames(scene)
        self._only = frozenset(map(rospy.resolve_name, topics))
        self._master = rosgraph.Master(rospy.get_name())
        self._reader = node.TopicReader(self._take, is_exact=True)
        self._learned = LearnedNodes(self._master, self._show)
        threading.Thread(target=self._look, name='topics', daemon=True).start()

    def _look(self) -> None:
        while not rospy.is_shutdown():
            try:
                publishers, subscribers, services = map(dict, self._master.getSystemState())
                types = dict(self._master.getTopicTypes())
            except (OSError, rosgraph.MasterException) as error:
                rospy.logwarn_throttle(30, 'the master does not answer: %s', error)
            else:
                types = {topic: kind for topic, kind in types.items() if topic in publishers}
                graph = Graph(publishers, subscribers, list(services), types)
                for use in (self._follow, *self._also):
                    with contained('what the master knows cannot be followed'):
                        use(graph)
            rospy.rostime.wallsleep(PERIOD)

    def _follow(self, graph: Graph) -> None:
        """Subscribe to the present topics that are to be watched, and to no others."""
        present = {
            topic: kind
            for topic, kind in graph.types.items()
            if topic in (self._only or graph.types) and is_visible(topic, kind)
        }
        with contained('what was learned cannot be used'):
            self._learned.follow(present, graph.publishers, graph.subscribers, graph.types)
        before = self._reader.topics()
        with contained('a topic cannot be watched'):
            self._reader.follow(present)
        for topic in self._reader.topics() - before:
            rospy.loginfo('watching %s (%s)', topic, present[topic])
        for topic in before:  # what has just been subscribed to need not be connected yet
            publishers = self._reader.publishers(topic)
            self._scene.keep_publishers(topic, publishers)
            self._fixed_frames.keep_publishers(topic, publishers)
        self._fixed_frames.look(graph.services)

    def _take(self, heard: node.Heard) -> None:
        with contained(f'a message on {heard.topic} cannot be read'):
            if not self._learned.take(heard):
                self._show(heard, heard.message, None)
            self._fixed_frames.take(heard)

    def _show(self, heard: node.Heard, message: messages.Message, basis: Optional[Basis]) -> None:
        # RViz shows no tracked types by itself
        self._scene.take(heard.topic, message, heard.type == message._type, basis)


@functools.lru_cache(maxsize=None)
def is_visible(topic: str, kind: str) -> bool:
    """Return whether the messages of a topic can be seen; warn if they may, and their type is not built here."""
    if kind not in visible_types() and not kind.endswith(('Tracked', 'ActionGoal')):
        return False
    message_class = roslib.message.get_message_class(kind)
    if message_class is None:
        rospy.logwarn('cannot watch %s: its type %s is not built here', topic, kind)
        return False
    plain = messages.plain_type(message_class) if messages.is_tracked_type(message_class) else message_class
    return plain._type in MARKER_TYPES or kind_of(plain) is not None
