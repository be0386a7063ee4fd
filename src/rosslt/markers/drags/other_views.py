"""Who holds what in other views: RViz, the page, a device. The views tell each other on one topic."""

import threading
from typing import Callable, Dict

import rospy

from rosslt import msg, node
from rosslt.markers.scene.scene import Scene

TOPIC = '/rosslt/hands'


class OtherViews:
    """The views of a ROS graph beside this one, as far as hands are concerned.

    Args:
        scene: of this view; who takes hold of one of its things elsewhere is said there.
        called: whose a hand of this view is, for people.
    """

    def __init__(self, scene: Scene, called: Callable[[str], str]) -> None:
        self._scene, self._called = scene, called
        self._lock = threading.Lock()
        self._views: Dict[str, Dict[str, str]] = {}  # by node: {name of a handle: who holds it}
        self._publisher = rospy.Publisher(TOPIC, msg.Hands, queue_size=10, latch=True)
        self._reader = node.TopicReader(self._hear)
        self._reader.follow({TOPIC: msg.Hands._type})

    def tell(self, held: Dict[str, str]) -> None:
        """Tell the others what this view holds.

        Args:
            held: {name of a handle: the hand that holds it}.
        """
        self._publisher.publish(list(held), [self._called(hand) for hand in held.values()])

    def held(self) -> Dict[str, str]:
        """{name of a handle: who holds it elsewhere}; a view that has ended, or was killed, holds nothing."""
        there = self._reader.publishers(TOPIC)
        with self._lock:
            return {name: who for view, held in self._views.items() if view in there for name, who in held.items()}

    def _hear(self, heard: node.Heard) -> None:
        if heard.publisher == rospy.get_name():
            return
        held = dict(zip(heard.message.handles, heard.message.whose))
        with self._lock:
            before = self._views.get(heard.publisher, {})
            self._views[heard.publisher] = held
        for name in held.keys() - before.keys():
            handle = self._scene.handle(name)
            if handle is not None:
                self._scene.say(handle, held_by(held[name]))


def held_by(who: str) -> str:
    """Tell a person who else holds a thing."""
    return f'held by {who}'
