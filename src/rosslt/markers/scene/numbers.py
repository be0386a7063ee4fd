"""Handles on numbers that are nowhere in space, as a gain, or the positions of joints by name."""

from typing import Any, List, Optional, Sequence, Tuple

from rosslt import node, values
from rosslt.markers.geometry import PoseTuple
from rosslt.markers.scene.handle import CanChange, Handle, Motions, RankOf
from rosslt.markers.scene.joints import kept_within


class NumbersHandle(Handle):
    """A handle on numbers. Its pose is those numbers, as many as they are, instead of a pose; views do not draw it.

    Args:
        name: of the handle.
        numbers: tracked.
        joints: the joint that each is the position of, None for one that is not known; by default none is.
    """

    __slots__ = ('_joints',)

    def __init__(self, name: str, numbers: Sequence[Any], joints: Sequence[Optional[node.Joint]] = ()) -> None:
        self._joints = joints or [None] * len(numbers)
        place: Any = tuple(float(values.untracked(number)) for number in numbers)
        super().__init__(name, '', place, 0.0, len(numbers), numbers, list)

    def wanted(self, pose: PoseTuple, moved: bool, turned: bool) -> Tuple[List[Any], List[float]]:
        """The numbers, and where the hand has them."""
        return self.tracked, list(pose)

    def rounded(self, pose: Sequence[float]) -> List[float]:
        """Where a hand has the numbers, those of them whole that only take whole numbers."""
        whole = [isinstance(values.untracked(number), int) for number in self.tracked]
        return [round(number) if is_whole else number for number, is_whole in zip(pose, whole)]

    def settled(self, start: PoseTuple, pose: PoseTuple, noise: float) -> PoseTuple:
        """Return the value as it is: it is not reported in 32 bits."""
        return pose

    def limited(self, targets: List[float], turn: float) -> Tuple[List[float], str]:
        """The targets within the limits of the joints, and which limits stop them."""
        found = [
            (target, '') if joint is None else kept_within(joint, target, present)
            for joint, target, present in zip(self._joints, targets, self.pose)
        ]
        return [kept for kept, _ in found], '; '.join(told for _, told in found if told)

    def motions(self, can_change: CanChange, rank_of: Optional[RankOf] = None) -> Motions:
        """Along one way, if any number takes changes."""
        del rank_of
        return Motions((any(map(can_change, self.tracked)), False, False), is_in_frame=True)
