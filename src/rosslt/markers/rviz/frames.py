"""RViz's fixed frame, and which other frames transforms join to it.

An RViz that is shown an interactive marker in a frame that nothing joins to its fixed frame shows none at all.
"""

from typing import Dict, Optional, Set

import rospy

from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.topics import Graph
from rosslt.markers.tf_frames import heard_frames, most_common_root


class FixedFrame:
    """RViz's fixed frame: the one that a person has chosen, or the root of the frames of most topics: a frame that is
    dragged would run away from the mouse if it was the one that stands still.

    Args:
        scene: shows what is in which frame.
        chosen: by a person; '' if nobody has chosen one.

    Attributes:
        name: its name; '' if nothing is shown yet.
        topics: {topic that can be dragged: the frame of one of its things}.
        buffer: of tf.
    """

    def __init__(self, scene: Scene, chosen: str = '') -> None:
        self._scene, self._chosen = scene, chosen.lstrip('/')
        self.name = self._chosen
        self.topics: Dict[str, str] = {}
        self.buffer = heard_frames()

    def look(self, graph: Graph) -> None:
        """Take in what the scene shows; a topic that shows nothing for a while counts until it is gone."""
        found = {**self.topics, **self._scene.topics()}
        self.topics = {topic: frame.lstrip('/') for topic, frame in found.items() if topic in graph.types}
        self.name = self._chosen or most_common_root(self.buffer, self.topics.values())


class JoinedFrames:
    """The frames that tf joins to RViz's fixed frame.

    Args:
        fixed: that frame.
    """

    def __init__(self, fixed: FixedFrame) -> None:
        self._fixed = fixed
        self._is_joined: Dict[str, bool] = {}
        self._apart: Set[str] = set()
        self._told: Optional[Set[str]] = None  # an earlier run may have left others

    def has(self, frame: str) -> bool:
        """Return whether a frame was joined at the last `update`, or is joined now if nobody has asked before."""
        frame = frame.lstrip('/')
        if frame not in self._is_joined:
            self._is_joined[frame] = self._find(frame)
        return self._is_joined[frame]

    def update(self) -> bool:
        """Ask tf again; returns whether any frame has been joined since, or come apart."""
        before, self._is_joined = self._is_joined, {frame: self._find(frame) for frame in self._is_joined}
        return self._is_joined != before

    def tell(self, parameter: str) -> None:
        """Say which frames with things in them are apart, once they are so at two calls in a row.

        Args:
            parameter: its name, which `rosslt doctor` reads: a list of [frame, fixed frame].
        """
        fixed = self._fixed.name
        apart = {frame for frame in self._fixed.topics.values() if not self._find(frame)}
        lasting, self._apart = apart & self._apart, apart
        for frame in sorted(lasting - (self._told or set())):
            rospy.logwarn(
                'RViz gets no handles of what is in the frame %s: no transform joins it to %s, the root of the frames '
                'of most topics (the parameter ~fixed_frame chooses a different one)',
                frame,
                fixed,
            )
        if lasting != self._told:
            self._told = lasting
            rospy.set_param(parameter, [[frame, fixed] for frame in sorted(lasting)])

    def _find(self, frame: str) -> bool:
        fixed = self._fixed.name
        return not fixed or frame == fixed or bool(self._fixed.buffer.can_transform(fixed, frame, rospy.Time()))
