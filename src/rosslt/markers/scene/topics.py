"""The watched topics: those of types that RViz shows, ordinary and tracked ones, as they appear and disappear."""

import threading
from typing import Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Set, Tuple, Type

import genpy
import rosgraph
import roslib.message
import rospy

from rosslt import messages, node
from rosslt.markers.faults import contained
from rosslt.markers.scene.by_type import KINDS, kind_of
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
        self._scene, self._also = scene, also
        self._only = frozenset(map(rospy.resolve_name, topics))
        self._master = rosgraph.Master(rospy.get_name())
        self._subscribers: Dict[str, Tuple[str, node.Subscriber]] = {}  # topic -> (its type, the subscriber)
        self._ignored: Set[Tuple[str, str]] = set()  # (topic, type)
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
        """Subscribe to what is present and to be watched, and to nothing else."""
        present = {topic: kind for topic, kind in graph.types.items() if topic in (self._only or graph.types)}
        for topic, (known, subscriber) in list(self._subscribers.items()):
            if present.get(topic) != known:
                del self._subscribers[topic]
                subscriber.unregister()
                self._scene.keep_publishers(topic, ())
        for topic, kind in present.items():
            if topic not in self._subscribers and (topic, kind) not in self._ignored:
                with contained(f'{topic} cannot be watched'):
                    self._subscribe(topic, kind)
        for topic, (_, subscriber) in self._subscribers.items():
            # A node that crashed stays in the master's list: who is connected tells who is there.
            self._scene.keep_publishers(topic, node.connected_publishers(subscriber))

    def _subscribe(self, topic: str, kind: str) -> None:
        if kind == '*':
            return
        found = self._visible_class(topic, kind)
        if found is None:
            self._ignored.add((topic, kind))
            return
        message_class, is_shown = found

        def take(message: genpy.Message) -> None:
            with contained(f'a message on {topic} cannot be read'):
                self._scene.take(topic, message, is_shown)

        self._subscribers[topic] = (kind, node.Subscriber(topic, message_class, take, keep_provenance=True))
        rospy.loginfo('watching %s (%s)', topic, kind)

    @staticmethod
    def _visible_class(topic: str, kind: str) -> Optional[Tuple[Type[genpy.Message], bool]]:
        """(message class, whether RViz shows it by itself), or None where it is nothing to be seen."""
        if kind not in visible_types() and not kind.endswith(('Tracked', 'ActionGoal')):
            return None
        message_class = roslib.message.get_message_class(kind)
        if message_class is None:
            rospy.logwarn('cannot watch %s: its type %s is not built here', topic, kind)
            return None
        is_shown = not messages.is_tracked_type(message_class)
        plain = message_class if is_shown else messages.plain_type(message_class)
        return (message_class, is_shown) if _is_visible(plain) else None


def _is_visible(message_class: Type[genpy.Message]) -> bool:
    return message_class._type in MARKER_TYPES or kind_of(message_class) is not None
