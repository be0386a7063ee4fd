"""Waypoints of a thing: the hand leads its ghost, which becomes a row below that of the thing at each press."""

from typing import Callable

from rosslt import values
from rosslt.markers import Handle, Scene, solve_waypoints
from rosslt.markers.geometry import PoseTuple
from rosslt.teach.devices import RESOLUTION
from rosslt.teach.ghost import Ghost
from rosslt.teach.presses import Answer
from rosslt.teach.rows import TIMEOUT, Appended, checked_place


class Appending(Ghost):
    """A ghost that becomes a row at each press; the thing stays, so that its own row is as in the file.

    Args:
        scene, name_of, say: as of a Ghost.
    """

    def __init__(self, scene: Scene, name_of: Callable[[values.Source], str], say: Callable[[str], None]) -> None:
        super().__init__(scene, name_of, say)
        self._appended = Appended()

    def release(self, name: str, frame: str, pose: PoseTuple, hand: str) -> None:
        """A hand has let go of a handle: its ghost goes away."""
        del pose, hand
        self._vanish(name, frame)

    def check(self, handle: Handle) -> None:
        """Check that rows can be added for a thing; raises as `checked_place` does."""
        checked_place(handle.tracked, self._scene.shared(handle))

    def append(self) -> Answer:
        """Do as a press says: where the ghost is becomes a row."""
        if self._handle is None:
            return Answer(False, 'nothing is written: no hand holds the thing; hold it, and press then')
        try:
            poses = [self._start, *[self._pose] * (self._pose != self._start)]
            found = solve_waypoints(self._handle, poses, self._shared, RESOLUTION, TIMEOUT, self._name_of)
        except values.Error as error:
            return Answer(False, f'nothing is written: {error}')
        return self._appended.append(self._handle.tracked, found[0] if found else {})
