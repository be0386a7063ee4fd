"""Tells when another thing has taken the name of one, as the next target of a patrol does."""

from typing import Dict, Set

from rosslt import values
from rosslt.markers.geometry import PoseTuple, distance
from rosslt.markers.scene.handle import Handle


class Leaps:
    """Follows the handles of all names.

    A thing has leapt if it comes from other sources now; or if it stood still, was at another place in the next message
    although its sources had the same values, and stands still there. What moves by itself does not leap.
    """

    def __init__(self) -> None:
        self._before: Dict[str, Handle] = {}  # by name: the last one before it leapt
        self._still: Set[str] = set()
        self._may_have: Set[str] = set()  # as far as two messages tell

    def put(self, old: Handle, handle: Handle, has_other_sources: bool) -> bool:
        """A message shows a handle that had a former message; return whether it is known now that it has leapt."""
        name = handle.name
        if has_other_sources:
            self._before[name] = old
            self._still.discard(name)
            self._may_have.discard(name)
            return False  # its sources say so
        if old.pose == handle.pose:
            self._still.add(name)
            has_leapt = name in self._may_have
            self._may_have.discard(name)
            return has_leapt
        self._may_have.discard(name)
        if name in self._still:
            self._still.discard(name)
            if values.source_values(list(old.tracked)) == values.source_values(list(handle.tracked)):
                self._before[name] = old
                self._may_have.add(name)
        return False

    def may_have(self, name: str) -> bool:
        """Return whether the last message shows a thing elsewhere, and the next one tells whether it has leapt."""
        return name in self._may_have

    def drop(self, name: str) -> None:
        """Nothing of that name is shown any more."""
        self._before.pop(name, None)
        self._still.discard(name)
        self._may_have.discard(name)

    def grasped_at(self, pose: PoseTuple, handle: Handle) -> Handle:
        """The handle that a hand takes hold of at a place: the one before a leap if that is nearer than the present one.

        Whoever has the present one need not wait for what the next message tells.
        """
        before = self._before.get(handle.name)
        if before is not None and distance(pose[:3], before.pose[:3]) < distance(pose[:3], handle.pose[:3]):
            return before
        self._may_have.discard(handle.name)
        return handle
