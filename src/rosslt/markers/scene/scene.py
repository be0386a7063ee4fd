"""The scene: what the watched topics show at present, by the rules that RViz itself goes by.

Adding, deleting, deleting all, lifetimes and namespaces mean here what they mean in RViz. In addition, what a
publisher has shown goes when the publisher goes.

A scene asks nobody and tells nobody while its lock is held: messages, drags and views call it, and views take what is
new with `news`.
"""

import math
import threading
from typing import Any, Collection, Dict, Iterable, List, NamedTuple, Optional, Set, Tuple

import genpy
import rospy
from visualization_msgs.msg import Marker, MarkerArray

from rosslt import node, values
from rosslt.markers.faults import contained
from rosslt.markers.geometry import PoseTuple, distance
from rosslt.markers.scene import marker as markers
from rosslt.markers.scene.basis import Basis
from rosslt.markers.scene.by_type import kind_of
from rosslt.markers.scene.duplicates import Duplicates
from rosslt.markers.scene.handle import Handle, Settings
from rosslt.markers.scene.hold import Hold
from rosslt.markers.scene.shapes import pose_tuple

#: The types whose messages add and delete things one by one.
MARKER_TYPES = (Marker._type, MarkerArray._type)

#: The period in which the same warning is repeated at most, in seconds.
WARNING_PERIOD = 60.0

#: (namespace, id) of a marker, the name of a frame, or () if a message is one thing.
Key = Tuple[Any, ...]


class Thing(NamedTuple):
    """A thing on a topic.

    Attributes:
        names: the names of its handles.
        publisher: the node whose message shows it.
    """

    names: List[str]
    publisher: str


class News(NamedTuple):
    """Changes that a view has to show.

    Attributes:
        handles: {name: the handle, or None if it is shown no more}.
        let_go: the names of handles whose drags have ended: they are to be shown where the scene has them, as a hand
            has moved them.
        said: each handle and the text to be shown at it.
    """

    handles: Dict[str, Optional[Handle]]
    let_go: Set[str]
    said: List[Tuple[Handle, str]]


class Scene:
    """Everything that can be dragged, thing by thing, and who shows it.

    Args:
        settings: what the user has chosen for all handles.

    Attributes:
        settings: the same.
    """

    def __init__(self, settings: Settings) -> None:
        self._lock = threading.RLock()
        self.settings = settings
        self._changed: Set[str] = set()  # names of handles that no view has taken news of yet
        self._let_go: Set[str] = set()
        self._said: List[Tuple[Handle, str]] = []
        self._handles: Dict[str, Handle] = {}
        self._duplicates = Duplicates()
        self._uses = node.Uses()
        self._before: Dict[str, Handle] = {}  # by its name: the last one before its node went on
        self._holds: Dict[str, Hold] = {}
        self._things: Dict[str, Dict[Key, Thing]] = {}  # by topic
        self._lives: Dict[Tuple[str, Key], Tuple[rospy.Time, rospy.Time]] = {}  # (topic, key) -> shown from, and until

    # For views and drags.

    def news(self) -> News:
        """Everything that is new since the view has last asked."""
        with self._lock:
            is_shown, handles = self._duplicates.is_shown, self._handles
            changed = {name: handles.get(name) if is_shown(name) else None for name in self._changed}
            found = News(changed, self._let_go, self._said)
            self._changed, self._let_go, self._said = set(), set(), []
            return found

    def handle(self, name: str) -> Optional[Handle]:
        """The handle of that name, or None. Another message has shown it since if it is another object than before."""
        with self._lock:
            return self._handles.get(name)

    def grasped(self, name: str, pose: Optional[PoseTuple]) -> Optional[Handle]:
        """The handle that a hand takes hold of; None if there is none of that name.

        It is the one before its node went on, if the view has still shown that: a patrol has gone on to its next target
        in the moment of the grasp.

        Args:
            pose: where the view has shown it then; None if that is not known.
        """
        with self._lock:
            handle, before = self._handles.get(name), self._before.get(name)
            if handle is None or before is None or pose is None or name in self._holds:
                return handle
            was_there = distance(pose[:3], before.pose[:3]) < distance(pose[:3], handle.pose[:3])
            return before if was_there else handle

    def shared(self, handle: Handle) -> List[Set[values.Source]]:
        """Of each tracked number of a handle, the sources that move other things as well, as of `node.Uses`."""
        with self._lock:
            return self._uses.shared(handle.name, handle.tracked)

    def names(self) -> List[str]:
        """The names of all handles that are shown."""
        with self._lock:
            return [name for name in self._handles if self._duplicates.is_shown(name)]

    def origin(self, name: str) -> Tuple[str, str]:
        """(topic, publisher) of the last message that shows a handle; ('', '') if there is none of that name."""
        with self._lock:
            for topic, things in self._things.items():
                for thing in things.values():
                    if name in thing.names:
                        return topic, thing.publisher
            return '', ''

    def topics(self) -> Dict[str, str]:
        """{topic: the frame of one of its things} for each topic that shows something to drag."""
        with self._lock:
            found = {}
            for topic, things in self._things.items():
                names = [name for thing in things.values() for name in thing.names]
                if names:
                    found[topic] = self._handles[names[0]].frame
            return found

    def say(self, handle: Handle, text: str) -> None:
        """Show a message at a handle."""
        with self._lock:
            self._said.append((handle, text))

    # For drags.

    def hold(self, name: str) -> None:
        """A drag of a handle begins: messages do not move it until the drag is over."""
        with self._lock:
            self._holds[name] = Hold()

    def let_go(self, name: str, request: Optional[node.ChangeRequest] = None) -> None:
        """The hand has let go of a handle.

        Args:
            request: what has changed, if sources have followed: the handle stays where it was dropped until a message
                says so too. By default it goes back to where the last message has it.
        """
        with self._lock:
            hold = self._holds.pop(name, None)
            if request is not None and hold is not None:
                hold.drop(request, self._handles.get(name))
                self._holds[name] = hold
            self._let_go.add(name)

    def put_back(self, name: str) -> None:
        """Have views show a handle where it is, as a hand that does not hold it has moved it."""
        with self._lock:
            self._let_go.add(name)

    def is_held(self, name: str) -> bool:
        """True for a handle that is to be left alone."""
        with self._lock:
            hold = self._holds.get(name)
            if hold is None:
                return False
            # A thing that was removed after the drop is not shown any more: no message can end the wait for it. It is
            # looked up here, and not when it is removed, as a node may delete a thing and add it in one message.
            if hold.is_over() or (name not in self._handles and not hold.is_in_hand()):
                del self._holds[name]
                return False
            return True

    # For messages.

    def take(self, topic: str, message: genpy.Message, is_shown: bool, basis: Optional[Basis] = None) -> None:
        """Follow a message of any type that is watched.

        Args:
            topic: its name.
            message: an ordinary message, with tracked values in it.
            is_shown: whether RViz shows it by itself.
            basis: as that of a Handle.
        """
        publisher = (message._connection_header or {}).get('callerid', '')
        faults: List[Optional[str]] = []
        if message._type in MARKER_TYPES:
            is_shown = is_shown and not self.settings.draws_all
            with self._lock:
                things = self._things.setdefault(topic, {})
                for marker in message.markers if message._type == MarkerArray._type else [message]:
                    with contained(f'a marker of {publisher} on {topic} cannot be read'):
                        faults.append(self._take_marker(topic, things, marker, publisher, is_shown, basis))
        else:
            faults.append(self._take_other(topic, message, publisher, basis))
        for fault in filter(None, faults):
            rospy.logwarn_throttle_identical(WARNING_PERIOD, '{} on {}: {}'.format(publisher, topic, fault))

    def show(self, topic: str, handle: Handle, publisher: str) -> None:
        """Show the only handle of a topic, made of a message of a type that need not be one that is seen."""
        with self._lock:
            self._put(topic, self._things.setdefault(topic, {}), (), [handle], publisher)

    def show_frame(self, topic: str, frame: str, handle: Optional[Handle], publisher: str) -> bool:
        """Show a handle on a frame whose transform is plain, or none any more; False if a hand holds that, or waits for
        a message that shows it where it was dropped."""
        with self._lock:
            things, key = self._things.setdefault(topic, {}), ('plain', frame)
            if handle is None and any(map(self.is_held, things[key].names if key in things else ())):
                return False
            self._put(topic, things, key, [] if handle is None else [handle], publisher)
            return True

    def expire(self) -> None:
        """Drop the things whose lifetime is over, or begins later: a simulation has set the clock back."""
        with self._lock:
            now = rospy.Time.now()
            for topic, key in [whose for whose, (start, end) in self._lives.items() if not start <= now < end]:
                self._delete(topic, self._things[topic], key)

    def keep_publishers(self, topic: str, publishers: Collection[str]) -> None:
        """Drop what publishers other than these have shown on a topic."""
        with self._lock:
            things = self._things.get(topic, {})
            for key in [key for key, thing in things.items() if thing.publisher not in publishers]:
                self._delete(topic, things, key)

    def _take_other(self, topic: str, message: genpy.Message, publisher: str, basis: Optional[Basis]) -> Optional[str]:
        """Follow a message that is not a marker; what is wrong with it, or None."""
        kind = kind_of(type(message))
        if kind is None:
            return None
        named = list(kind.handles(topic, message, self.settings))  # not locked: it may ask for robot_description
        for _, handle in named:
            if handle is not None:
                handle.basis = basis
        with self._lock:
            things = self._things.setdefault(topic, {})
            if any(handle is not None and not handle.frame for _, handle in named):
                return 'the message has no frame_id'
            if kind.is_partial:
                for name, handle in named:
                    self._put(topic, things, (name,), [] if handle is None else [handle], publisher)
                    self._live(topic, (name,), kind.lifetime(topic))
            else:
                self._put(topic, things, (), [handle for _, handle in named if handle is not None], publisher)
        return None

    def _take_marker(
        self,
        topic: str,
        things: Dict[Key, Thing],
        marker: Marker,
        publisher: str,
        is_shown: bool,
        basis: Optional[Basis],
    ) -> Optional[str]:
        """Follow a marker; what is wrong with it, or None."""
        key = (marker.ns, marker.id)
        if marker.action == Marker.DELETE:
            self._delete(topic, things, key)
        elif marker.action == Marker.DELETEALL:
            for key in list(things):
                self._delete(topic, things, key)
        elif marker.action == Marker.ADD:
            handles = markers.marker_handles(topic, marker, is_shown, self.settings)
            fault = handles and _fault(marker)
            if fault:
                return 'marker {}/{} {}'.format(*key, fault)
            for handle in handles:
                handle.basis = basis
            self._put(topic, things, key, handles, publisher)
            self._live(topic, key, marker.lifetime)
        else:
            return 'marker {}/{} has the unknown action {}'.format(*key, marker.action)
        return None

    def _live(self, topic: str, key: Key, lifetime: rospy.Duration) -> None:
        """A thing is shown for a while from now on, a duration; 0 means until it is deleted."""
        if key in self._things[topic] and lifetime:
            now = rospy.Time.now()
            self._lives[topic, key] = now, now + lifetime
        else:
            self._lives.pop((topic, key), None)

    def _put(self, topic: str, things: Dict[Key, Thing], key: Key, handles: Iterable[Handle], publisher: str) -> None:
        names = []
        for handle in handles:
            self._put_handle(handle)
            names.append(handle.name)
        before = things.get(key)
        if before is not None and before.names != names:
            for name in set(before.names).difference(names):
                self._drop_handle(name)
        if names:
            things[key] = Thing(names, publisher)
        else:
            things.pop(key, None)

    def _delete(self, topic: str, things: Dict[Key, Thing], key: Key) -> None:
        thing = things.pop(key, None)
        for name in thing.names if thing is not None else ():
            self._drop_handle(name)
        self._lives.pop((topic, key), None)

    def _put_handle(self, handle: Handle) -> None:
        name = handle.name
        old = self._handles.get(name)
        has_other_sources = self._uses.put(name, handle.tracked, handle.whole)
        if old is not None and (has_other_sources or _has_gone_on(old, handle)):
            self._before[name] = old
        self._handles[name] = handle
        if name in self._holds:
            self._holds[name].see(handle)
        self._changed.update(self._duplicates.put(handle))
        self._changed.add(name)

    def _drop_handle(self, name: str) -> None:
        if self._handles.pop(name, None) is not None:
            self._uses.drop(name)
            self._before.pop(name, None)
            self._changed.update(self._duplicates.drop(name))
            self._changed.add(name)


def _has_gone_on(old: Handle, handle: Handle) -> bool:
    """Return whether a thing is elsewhere although its sources have the same values."""
    if old.pose == handle.pose:
        return False
    return values.source_values(list(old.tracked)) == values.source_values(list(handle.tracked))


def _fault(marker: Marker) -> Optional[str]:
    """Why a marker cannot be shown, or None."""
    if not marker.header.frame_id:
        return 'has no frame_id'
    if marker.type not in markers.KINDS:
        return 'has the unknown type %d' % marker.type
    pose, scale, color = marker.pose, marker.scale, marker.color
    numbers = (*pose_tuple(pose), scale.x, scale.y, scale.z, color.r, color.g, color.b, color.a)
    isfinite = math.isfinite
    if (
        not all(map(isfinite, numbers))
        or not all(isfinite(point.x) and isfinite(point.y) and isfinite(point.z) for point in marker.points)
        or not all(isfinite(c.r) and isfinite(c.g) and isfinite(c.b) and isfinite(c.a) for c in marker.colors)
    ):
        return 'has a number that is not finite'
    return None
