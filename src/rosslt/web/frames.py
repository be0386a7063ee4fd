"""The frames of tf, shown as branches of the page's tree of things, so that things in a frame move with it."""

from typing import ContextManager, Dict, Optional
from urllib.parse import quote

import rospy
import tf2_ros
import viser

from rosslt.markers import geometry, heard_frames, most_common_root

AT_ORIGIN: geometry.PoseTuple = (0.0, 0.0, 0.0, *geometry.IDENTITY)


class Frames:
    """The frames that things stand in.

    Args:
        server: viser's.
        lock: of the page.
        fixed: the frame that stands still; by default the one at the root of those that things stand in.
    """

    def __init__(self, server: viser.ViserServer, lock: ContextManager[bool], fixed: str = '') -> None:
        self._server, self._lock = server, lock
        self._chosen = self._fixed = fixed.lstrip('/')
        self._buffer = heard_frames()
        self._branches: Dict[str, viser.FrameHandle] = {}
        self._poses: Dict[str, Optional[geometry.PoseTuple]] = {}

    def branch(self, frame: str) -> str:
        """The name of the branch for things in a frame."""
        frame = frame.lstrip('/')
        with self._lock:
            if frame not in self._branches:
                name = '/' + quote(frame, safe='')
                self._branches[frame] = self._server.scene.add_frame(name, show_axes=False, visible=False)
                self._poses[frame] = None
                self._place(frame)
            return str(self._branches[frame].name)

    def pose(self, frame: str) -> geometry.PoseTuple:
        """The pose of a frame on the page, as far as known."""
        return self._poses.get(frame.lstrip('/')) or AT_ORIGIN

    def update(self) -> None:
        """Put all frames where tf has them now."""
        with self._lock:
            for frame in self._branches:
                self._place(frame)

    def find_root(self) -> None:
        """Have the root of most frames stand still, unless a different frame was chosen."""
        with self._lock:
            if not self._chosen and self._branches:
                self._fixed = most_common_root(self._buffer, self._branches)

    def _place(self, frame: str) -> None:
        pose = self._look_up(frame)
        if pose == self._poses[frame]:
            return
        branch, before = self._branches[frame], self._poses[frame]
        self._poses[frame] = pose
        if pose is not None:
            branch.position, branch.wxyz = pose[:3], (pose[6], *pose[3:6])
        if (pose is None) != (before is None):
            branch.visible = pose is not None

    def _look_up(self, frame: str) -> Optional[geometry.PoseTuple]:
        if frame == self._fixed:
            return AT_ORIGIN
        if not self._fixed:
            return None
        try:
            found = self._buffer.lookup_transform(self._fixed, frame, rospy.Time()).transform
        except tf2_ros.TransformException:
            return None
        move, turn = found.translation, found.rotation
        rotation = geometry.normalized(float(turn.x), float(turn.y), float(turn.z), float(turn.w))
        return (float(move.x), float(move.y), float(move.z), *rotation)
