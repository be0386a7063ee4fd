"""The transforms of a frame over time, as tf2 keeps them, with provenance."""

import bisect
from typing import Any, List, NamedTuple, Optional, Sequence, Tuple

from rosslt.messages import Message
from rosslt.node.tf.quaternions import Numbers, products, quaternion_conjugate, quaternion_multiply, rotated
from rosslt.values import MATH, is_tracked, sources, to_float, untracked

#: Between two rotations that differ by less, in radians, the weights of both are taken for constants: how they depend
#: on the angle is lost in its rounding errors.
MIN_TURN = 1e-4


class Motion(NamedTuple):
    """A rotation `(x, y, z, w)`, and then a translation `(x, y, z)` in metres."""

    translation: Numbers
    rotation: Numbers

    def after(self, first: 'Motion') -> 'Motion':
        """The motion `first`, and then this one."""
        moved = rotated(first.translation, self.rotation)
        return Motion(
            tuple([a + b for a, b in zip(moved, self.translation)]),
            quaternion_multiply(self.rotation, first.rotation),
        )

    def inverse(self) -> 'Motion':
        """The motion back."""
        back = quaternion_conjugate(self.rotation)
        return Motion(tuple([-part for part in rotated(self.translation, back)]), back)


def motion_of(transform: Message) -> Motion:
    """The Motion of a geometry_msgs/Transform; ints become floats, as in tf2."""
    moved, turned = transform.translation, transform.rotation
    return Motion(_floats(moved.x, moved.y, moved.z), _floats(turned.x, turned.y, turned.z, turned.w))


def _floats(*numbers: object) -> Numbers:
    return tuple([to_float(number) if isinstance(number, int) else number for number in numbers])


class Sample(NamedTuple):
    """A pose of a frame in its parent frame."""

    parent: str
    motion: Motion


class StaticSamples:
    """The transform of a frame that does not move: the last one that was set."""

    def __init__(self) -> None:
        self._sample: Optional[Sample] = None

    def add(self, _stamp: int, sample: Sample) -> None:
        """Set the sample, for all time."""
        self._sample = sample

    def at(self, _stamp: int) -> Optional[Sample]:
        """The sample, whatever the moment."""
        return self._sample


class MovingSamples:
    """The transforms of a frame over time; they are kept, and interpolated between, as tf2 does it.

    Args:
        duration: how long samples are kept, in nanoseconds.
    """

    def __init__(self, duration: int) -> None:
        self._duration = duration
        self._stamps: List[int] = []
        self._samples: List[Sample] = []

    def add(self, stamp: int, sample: Sample) -> None:
        """Add a sample; one that is too old, or of a moment of which there is one, counts for nothing."""
        stamps = self._stamps
        if stamps and stamp + self._duration < stamps[-1]:
            return
        place = bisect.bisect_left(stamps, stamp)
        if place < len(stamps) and stamps[place] == stamp:
            return
        stamps.insert(place, stamp)
        self._samples.insert(place, sample)
        old = bisect.bisect_left(stamps, stamps[-1] - self._duration)
        del stamps[:old], self._samples[:old]

    def at(self, stamp: int) -> Optional[Sample]:
        """The sample of a moment in nanoseconds, between two of them an interpolated one; None outside of them."""
        place = bisect.bisect_left(self._stamps, stamp)
        if place == len(self._stamps):
            return None
        newer = self._samples[place]
        if self._stamps[place] == stamp:
            return newer
        if place == 0:
            return None
        older, start = self._samples[place - 1], self._stamps[place - 1]
        if older.parent != newer.parent:
            return older
        ratio = (stamp - start) / (self._stamps[place] - start)
        return Sample(newer.parent, _between(older.motion, newer.motion, ratio))


def _between(older: Motion, newer: Motion, ratio: float) -> Motion:
    """The motion that is the part `ratio` of the way from one to another."""
    return Motion(
        tuple([_mean(a, b, ratio) for a, b in zip(older.translation, newer.translation)]),
        _slerp(older.rotation, newer.rotation, ratio),
    )


def _mean(older: Any, newer: Any, ratio: float) -> Any:
    return newer if _is_same(older, newer) else (1 - ratio) * older + ratio * newer


def _is_same(older: object, newer: object) -> bool:
    """Return whether two numbers are equal and have the same sources, so that they need no interpolation."""
    return older == newer and sources(older) == sources(newer)


def _slerp(older: Numbers, newer: Numbers, ratio: float) -> Numbers:
    """The rotation between two, as tf2's Quaternion::slerp has it."""
    if all(map(_is_same, older, newer)):
        return newer
    plain_older, plain_newer = untracked(older), untracked(newer)
    if _dot(plain_older, plain_newer) < 0:
        newer, plain_newer = _negative(newer), _negative(plain_newer)
    angle = _angle(plain_older, plain_newer)
    first, second = 1 - ratio, ratio
    if angle > 0:
        if angle > MIN_TURN and is_tracked([*older, *newer]):
            angle = _angle(older, newer)
        sin = MATH['sin']
        first, second = sin((1 - ratio) * angle) / sin(angle), sin(ratio * angle) / sin(angle)
    return tuple([products((first, a), (second, b)) for a, b in zip(older, newer)])


def _angle(older: Sequence[object], newer: Sequence[object]) -> Any:
    """The angle between two rotations as directions in four dimensions, in radians."""
    cosine = _dot(older, newer) / MATH['sqrt'](_dot(older, older) * _dot(newer, newer))
    return MATH['acos'](cosine) if cosine < 1 else 0.0


def _dot(first: Sequence[object], second: Sequence[object]) -> Any:
    return products(*zip(first, second))


def _negative(rotation: Numbers) -> Numbers:
    return tuple([-part for part in rotation])


def matching(motion: Motion, expected: Motion, tolerance: float) -> Tuple[Any, ...]:
    """The numbers of a motion; the quaternion gets the sign of the expected one.

    Returns:
        Translation and rotation, 7 numbers; none if one is further off than the tolerance, against its size or 1
        if it is smaller.
    """
    turned = motion.rotation
    if _dot(untracked(turned), expected.rotation) < 0:
        turned = _negative(turned)
    numbers = (*motion.translation, *turned)
    pairs = zip(untracked(numbers), (*expected.translation, *expected.rotation))
    return numbers if all(abs(a - b) <= tolerance * max(1.0, abs(b)) for a, b in pairs) else ()
