"""A path that is led: the hand leads a thing along it, and it becomes rows below that of the thing."""

from typing import Callable, Collection, List, NamedTuple, Optional, Sequence

from rosslt import files, node, values
from rosslt.markers import Drags, Handle, Scene, solve_waypoints
from rosslt.markers.geometry import PoseTuple
from rosslt.teach.devices import NotTaught
from rosslt.teach.rows import TIMEOUT, checked_place, places_of
from rosslt.teach.thinning import thinned

#: The part of the tolerance that is left for rounding the numbers of the rows.
RESERVED = 0.2


class Led(NamedTuple):
    """A path from taking hold to letting go.

    Attributes:
        handle: the thing, as it was when the hand took hold.
        shared: as of `Scene.shared`.
        poses: where the hand has had it, in order.
    """

    handle: Handle
    shared: Sequence[Collection[values.Source]]
    poses: List[PoseTuple]


class Written(NamedTuple):
    """Rows that were added to a file.

    Attributes:
        poses: how many poses they were made of.
        rows: how many rows they are.
        where: FILE:LINE of the row above them, as its node has read it.
        untaken: as of `node.untaken_in`.
    """

    poses: int
    rows: int
    where: str
    untaken: str


class Recording:
    """Records what a hand does to a handle of a scene, and has the thing go back as the hand lets go.

    To a hand, it is a `Drags`. A thing of a live script stays meanwhile: the text of the script would follow each
    step, and keep the digits of the longest.

    Args:
        drags: the hands of the scene.
        scene: has the handles.
        tolerance: how far a recorded pose may be from the way between rows, in metres.
        lever: how many metres an angle of 1 rad counts as.
        name_of: what a source is called, for people.

    Attributes:
        ended: the path that has ended, until it is written.
    """

    def __init__(
        self, drags: Drags, scene: Scene, tolerance: float, lever: float, name_of: Callable[[values.Source], str]
    ) -> None:
        self._drags, self._scene, self._name_of = drags, scene, name_of
        self._tolerance, self._lever = tolerance, lever
        self._led: Optional[Led] = None
        self._is_in_script = False
        self.ended: Optional[Led] = None

    # As Drags.

    def hold(self, name: str, hand: str, frame: str, pose: PoseTuple) -> bool:
        """A hand takes hold of a handle, and a path begins there."""
        handle = self._scene.handle(name)
        if handle is None or not self._drags.hold(name, hand, frame, pose):
            return False
        self._led = Led(handle, self._scene.shared(handle), [pose])
        return True

    def keep(self, name: str, hand: str) -> None:
        """A hand still holds a handle."""
        self._drags.keep(name, hand)

    def move(self, name: str, frame: str, pose: PoseTuple, hand: str) -> bool:
        """A hand has moved a handle."""
        if self._led is not None:
            self._led.poses.append(pose)
        if self._is_in_script:
            self._drags.keep(name, hand)
            return True
        return self._drags.move(name, frame, pose, hand)

    def release(self, name: str, frame: str, pose: PoseTuple, hand: str) -> None:
        """A hand has let go of a handle: its path has ended, and it goes back."""
        del frame, pose
        self.ended, self._led = self._led, None
        self._drags.let_go_back(name, hand)

    # For the teacher.

    def check(self, handle: Handle) -> None:
        """Check that rows can be added for a thing.

        Raises:
            ChangeRejected: that row, its list or its node is locked.
            NotTaught: none of its numbers is in a row of alike ones, or that is not as its node has read it.
        """
        self._is_in_script = node.is_in_script(checked_place(handle.tracked, self._scene.shared(handle)))

    def write(self, led: Led) -> Written:
        """Add the rows of a path to the file that the thing comes from.

        Raises:
            NotTaught: nothing is written, as it did not move, a waypoint cannot be reached, its numbers are not all in
                one row of alike ones, or the file cannot be written.
        """
        try:
            return self._write(led)
        except (values.Error, files.FileError, node.SourceUnreachable) as error:
            raise NotTaught(f'nothing is written: {error}') from None

    def _write(self, led: Led) -> Written:
        kept = thinned(led.poses, (1.0 - RESERVED) * self._tolerance, self._lever)
        if len(kept) < 2:
            raise NotTaught(f'it stayed where it was, within {self._tolerance:g} m')
        resolution = 0.5 * RESERVED * self._tolerance / max(1.0, 2.0 * self._lever)
        waypoints = solve_waypoints(
            led.handle, [led.poses[index] for index in kept], led.shared, resolution, TIMEOUT, self._name_of
        )
        if not waypoints[0]:
            raise NotTaught('it has no numbers that change on the way')
        places = places_of(list(waypoints[0]))
        made = node.row_additions(places, [list(one.values()) for one in waypoints], TIMEOUT)
        untaken = made.write(TIMEOUT)
        return Written(len(led.poses), len(waypoints), made.record.place, untaken)
