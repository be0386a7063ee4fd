"""tf2_ros' buffer, whose lookups know where their numbers came from.

tf2 computes in C++, where provenance is lost. Its lookups
stand; beside them, the transforms that have provenance are kept here, and each lookup is computed once more from
them, over the frames that lie between. If the two results agree, the numbers with provenance replace those of tf2.
"""

import math
import threading
from typing import Any, Dict, List, Optional, Set, Tuple, Union

import rospy
import tf2_ros

from rosslt import messages
from rosslt.node.tf.samples import Motion, MovingSamples, Sample, StaticSamples, matching, motion_of
from rosslt.values import is_tracked

#: The default time that tf2 keeps transforms, in seconds.
DEFAULT_CACHE_TIME = 10.0

#: The maximal difference from tf2's numbers, relative to the size, or absolute below 1.
TOLERANCE = 1e-9


class Buffer(tf2_ros.Buffer):
    """`tf2_ros.Buffer`, whose lookups know where their numbers came from.

    Args:
        cache_time, debug: as in `tf2_ros.Buffer`.
    """

    def __init__(self, cache_time: Optional[rospy.Duration] = None, debug: bool = True) -> None:
        self._duration = rospy.Duration(DEFAULT_CACHE_TIME) if cache_time is None else cache_time
        self._frames_lock = threading.Lock()
        self._forget()
        super().__init__(cache_time, debug)

    def set_transform(self, transform: messages.Message, authority: str) -> None:
        """Override `tf2_ros.Buffer.set_transform`; the numbers of the transform may be tracked."""
        super().set_transform(transform, authority)
        self._keep(transform, False)

    def set_transform_static(self, transform: messages.Message, authority: str) -> None:
        """Override `tf2_ros.Buffer.set_transform_static`; the numbers of the transform may be tracked."""
        super().set_transform_static(transform, authority)
        self._keep(transform, True)

    def clear(self) -> None:
        """Forget all transforms."""
        super().clear()
        with self._frames_lock:
            self._forget()

    def lookup_transform_core(self, target_frame: str, source_frame: str, time: object) -> messages.Message:
        """Override `tf2_ros.Buffer.lookup_transform_core`; the result keeps provenance."""
        found = super().lookup_transform_core(target_frame, source_frame, time)
        if self._samples:
            _attach(found.transform, self._motion(target_frame, source_frame, found.header.stamp))
        return found

    def lookup_transform_full_core(
        self, target_frame: str, target_time: object, source_frame: str, source_time: object, fixed_frame: str
    ) -> Any:
        """Override `tf2_ros.Buffer.lookup_transform_full_core`; the result keeps provenance."""
        found = super().lookup_transform_full_core(target_frame, target_time, source_frame, source_time, fixed_frame)
        if self._samples:
            first = self.lookup_transform_core(fixed_frame, source_frame, source_time)
            second = self.lookup_transform_core(target_frame, fixed_frame, target_time)
            _attach(found.transform, motion_of(second.transform).after(motion_of(first.transform)))
        return found

    def _forget(self) -> None:
        self._parents: Dict[str, str] = {}
        self._static: Set[str] = set()
        # Only for frames with provenance: without them, lookups cost almost nothing extra.
        self._samples: Dict[str, Union[StaticSamples, MovingSamples]] = {}

    def _keep(self, transform: messages.Message, is_static: bool) -> None:
        """Take note of a transform: of its frames, and of its numbers from the first time on that they are tracked."""
        child, parent = _without_slash(transform.child_frame_id), _without_slash(transform.header.frame_id)
        with self._frames_lock:
            if is_static and child not in self._parents:
                self._static.add(child)  # as in tf2, what a frame is at first it stays
            self._parents[child] = parent
            samples = self._samples.get(child)
            if samples is None:
                if not messages.has_tracked_leaf(transform.transform):
                    return
                samples = StaticSamples() if child in self._static else MovingSamples(self._duration.to_nsec())
                self._samples[child] = samples
            samples.add(_nanoseconds(transform.header.stamp), Sample(parent, motion_of(transform.transform)))

    def _motion(self, target: str, source: str, stamp: object) -> Optional[Motion]:
        """Compute the motion that takes points from the source frame to the target frame, with provenance.

        Returns:
            None if no part of it is tracked, or if it is not known.
        """
        with self._frames_lock:
            up, down = _to_common(self._ancestors(source), self._ancestors(target))
            rising = [self._sample(child, parent, stamp) for child, parent in zip(up, up[1:])]
            falling = [self._sample(child, parent, stamp) for child, parent in zip(down, down[1:])]
        frames = up + down[-2::-1]
        steps = rising + [motion and motion.inverse() for motion in reversed(falling)]
        if not any(steps):
            return None
        motions: List[Motion] = []
        reached = 0  # how many of the frames are passed
        for place, step in enumerate([*steps, None]):
            is_end = place == len(steps)
            if step is None and not is_end:
                continue
            if reached < place:  # frames without provenance, of which tf2 knows all
                try:
                    plain = super().lookup_transform_core(frames[place], frames[reached], stamp)
                except tf2_ros.TransformException:
                    return None
                motions.append(motion_of(plain.transform))
            if step is not None:
                motions.append(step)
            reached = place + 1
        result = motions[0]
        for motion in motions[1:]:
            result = motion.after(result)
        return result

    def _ancestors(self, frame: str) -> List[str]:
        """A frame, its parent, and so on."""
        frames = [frame]
        while frames[-1] in self._parents and len(frames) <= len(self._parents):
            frames.append(self._parents[frames[-1]])
        return frames

    def _sample(self, child: str, parent: str, stamp: object) -> Optional[Motion]:
        """Return the tracked pose of a frame in its parent at a time; None if it is plain or unknown."""
        samples = self._samples.get(child)
        sample = samples.at(_nanoseconds(stamp)) if samples else None
        return sample.motion if sample and sample.parent == parent else None


def _to_common(up: List[str], down: List[str]) -> Tuple[List[str], List[str]]:
    """Two lists of ancestors, up to the first that they have in common; empty if there is none."""
    common = next((frame for frame in up if frame in down), None)
    if common is None:
        return [], []
    return up[: up.index(common) + 1], down[: down.index(common) + 1]


def _attach(transform: messages.Message, motion: Optional[Motion]) -> None:
    """Replace plain numbers by equal tracked ones; none is replaced if one of them differs."""
    if motion is None:
        return
    parts = (transform.translation, transform.rotation)
    places = [(part, name) for part in parts for name in part.__slots__]
    for (part, name), number in zip(places, matching(motion, motion_of(transform), TOLERANCE)):
        if is_tracked(number):
            setattr(part, name, number)


def _nanoseconds(time: Any) -> int:
    """A time as tf2 has it: it gets times from Python in seconds, as a float, which holds them to 0.2 microseconds."""
    seconds = time.to_sec()
    whole = math.floor(seconds)
    return whole * 10**9 + round((seconds - whole) * 1e9)


def _without_slash(frame: str) -> str:
    return frame[1:] if frame.startswith('/') else frame
