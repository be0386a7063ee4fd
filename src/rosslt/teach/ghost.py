"""A dry run: the hand leads a ghost of the thing, and it is said what a drag there would change."""

from typing import Callable, Collection, List, Optional, Sequence

import rospy
from visualization_msgs.msg import Marker, MarkerArray

from rosslt import node, values
from rosslt.markers import GHOST, Handle, Scene, plan_drag, pose_message, refusal
from rosslt.markers.geometry import PoseTuple, product, rotate_vector
from rosslt.teach.devices import RESOLUTION

#: The alpha of a ghost.
ALPHA = 0.5

#: How long the owners of the numbers may take to answer, in seconds.
TIMEOUT = 2.0


class Ghost:
    """Shows where a hand has a handle of a scene, and changes nothing.

    To a hand, it is a `Drags`.

    Args:
        scene: has the handles.
        name_of: what a source is called, for people.
        say: is called with what letting go would have changed.
    """

    def __init__(self, scene: Scene, name_of: Callable[[values.Source], str], say: Callable[[str], None]) -> None:
        self._scene, self._name_of, self._say = scene, name_of, say
        self._publisher = rospy.Publisher(GHOST, MarkerArray, queue_size=1, latch=True)
        self._handle: Optional[Handle] = None
        self._shared: Sequence[Collection[values.Source]] = ()

    def hold(self, name: str, hand: str, frame: str, pose: PoseTuple) -> bool:
        """A hand takes hold of a handle, and its ghost appears."""
        del hand
        self._handle = self._scene.handle(name)
        if self._handle is None:
            return False
        self._shared, self._start = self._scene.shared(self._handle), pose
        self._show(frame, pose)
        return True

    def keep(self, name: str, hand: str) -> None:
        """A hand still holds a handle."""

    def move(self, name: str, frame: str, pose: PoseTuple, hand: str) -> bool:
        """A hand has moved a handle: its ghost goes there."""
        del name, hand
        self._show(frame, pose)
        return True

    def release(self, name: str, frame: str, pose: PoseTuple, hand: str) -> None:
        """A hand has let go of a handle: its ghost goes away, and it is said what would have changed."""
        del hand
        handle = self._handle
        self._vanish(name, frame)
        if handle is not None:
            self._say(self._planned(handle, pose))

    def _vanish(self, name: str, frame: str) -> None:
        self._handle = None
        gone = Marker(action=Marker.DELETEALL)
        gone.header.frame_id = frame  # without one, RViz takes it before a ghost that still waits
        self._publisher.publish([gone])
        self._scene.put_back(name)  # the view of the hand has it where the ghost was

    def _planned(self, handle: Handle, pose: PoseTuple) -> str:
        """Return the changes that a drag of a thing to a pose would make."""
        node.directory().learn(values.sources(handle.tracked), TIMEOUT)
        try:
            plan, stop = plan_drag(handle, self._start, pose, self._shared, RESOLUTION, TIMEOUT, self._name_of)
        except values.Error as error:
            return f'would be refused: {refusal(error)}'
        changed = [
            f'{self._name_of(source)} {plan.before[source]!r} -> {new!r}'
            for source, new in plan.after.items()
            if new != plan.before[source]
        ]
        return 'would change ' + (', '.join(changed) or 'nothing') + (f'; {stop}' if stop else '')

    def _show(self, frame: str, pose: PoseTuple) -> None:
        self._pose = pose
        shown: List[Marker] = []
        for number, shape in enumerate(self._handle.shapes() if self._handle is not None else ()):
            shape.header.frame_id, shape.ns, shape.id = frame, 'ghost', number
            place = shape.pose
            inner = (place.orientation.x, place.orientation.y, place.orientation.z, place.orientation.w)
            offset = rotate_vector(pose[3:], (place.position.x, place.position.y, place.position.z))
            x, y, z = (at + by for at, by in zip(pose[:3], offset))
            shape.pose = pose_message((x, y, z, *product(pose[3:], inner)))
            for color in (shape.color, *shape.colors):
                color.a = ALPHA
            shown.append(shape)
        self._publisher.publish(shown)
