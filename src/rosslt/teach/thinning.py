"""The fewest waypoints that say a movement: those of Douglas and Peucker, in position and angle together.

The distance of a pose from the way between two waypoints is that from the nearest place on it which is not behind
the place of the pose before. Times do not count, as rows have none: a pause needs no waypoint, nor does a change of the
speed. But a movement that goes back needs one where it turns round.
"""

import math
from typing import List, Sequence, Union

import numpy

from rosslt.markers.geometry import PoseTuple

#: How far a thing turns from one waypoint to the next at most, in radians: half a turn goes both ways.
MOST_TURN = 0.75 * math.pi


def thinned(poses: Sequence[PoseTuple], tolerance: float, lever: float) -> List[int]:
    """The indices of the poses that say a movement.

    Args:
        poses: of shape (n, 7); each is x, y, z in metres, and a quaternion qx, qy, qz, qw of length 1.
        tolerance: how far each pose may be from the way between the waypoints around it, in metres.
        lever: how many metres an angle of 1 rad counts as.

    Returns:
        Indices in rising order, the first and the last among them; of a thing that stays where it is, the first alone.
    """
    if len(poses) == 0:
        return []
    led = numpy.asarray(poses, dtype=float)
    kept: List[int] = [0]
    waiting = [(0, len(led) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last == first:
            continue
        between = _parting(led[first : last + 1], tolerance, lever)
        if between:
            waiting += [(first + between, last), (first, first + between)]
        else:
            kept.append(last)
    kept = _without_needless(led, kept, tolerance, lever)
    is_still = numpy.max(distances([*led, led[0]], lever)) <= tolerance
    return kept[:1] if is_still else kept


def distances(poses: Union[Sequence[PoseTuple], numpy.ndarray], lever: float) -> numpy.ndarray:
    """Measure how far each of some poses is from the way between the first and the last one, in metres.

    On that way, position and rotation change evenly, the rotation by less than half a turn.

    Args:
        poses: of shape (n, 7), as in `thinned`.
        lever: how many metres an angle of 1 rad counts as.

    Returns:
        An array of shape (n,).
    """
    led = numpy.asarray(poses, dtype=float)
    moved = led[:, :3] - led[0, :3]
    turned = _rotation_vectors(led[0, 3:], led[:, 3:])
    along = numpy.hstack([moved, lever * turned])
    length = along[-1] @ along[-1]
    parts = numpy.clip(along @ along[-1] / length, 0.0, 1.0) if length else numpy.zeros(len(led))
    parts = numpy.maximum.accumulate(parts)
    angles = numpy.linalg.norm(turned[-1]) * parts / 2.0
    axis = turned[-1] / (numpy.linalg.norm(turned[-1]) or 1.0)
    there = numpy.column_stack([numpy.sin(angles)[:, None] * axis, numpy.cos(angles)])
    between = _products(_inverse(there), _products(_inverse(led[0, 3:]), led[:, 3:]))
    angle = 2.0 * numpy.arctan2(numpy.linalg.norm(between[:, :3], axis=1), numpy.abs(between[:, 3]))
    return numpy.hypot(numpy.linalg.norm(moved - parts[:, None] * moved[-1], axis=1), lever * angle)


def _parting(led: numpy.ndarray, tolerance: float, lever: float) -> int:
    """The index of the pose at which a way has to be parted; 0 if the straight way is near enough."""
    off = distances(led, lever)
    furthest = int(numpy.argmax(off))
    if off[furthest] > tolerance:
        return furthest
    is_long = numpy.linalg.norm(_rotation_vectors(led[0, 3:], led[-1:, 3:])) > MOST_TURN
    return len(led) // 2 if is_long and len(led) > 2 else 0


def _without_needless(led: numpy.ndarray, kept: List[int], tolerance: float, lever: float) -> List[int]:
    """The waypoints without those between whose neighbours the way is near enough as well."""
    index = 1
    while index < len(kept) - 1:
        if not _parting(led[kept[index - 1] : kept[index + 1] + 1], tolerance, lever):
            del kept[index]
        else:
            index += 1
    return kept


def _rotation_vectors(reference: numpy.ndarray, rotations: numpy.ndarray) -> numpy.ndarray:
    """The axes of the rotations from a reference, in its frame, each as long as its angle: an array of shape (n, 3)."""
    turns = _products(_inverse(reference), rotations)
    turns = turns * numpy.where(turns[:, 3:] < 0.0, -1.0, 1.0)
    sines = numpy.linalg.norm(turns[:, :3], axis=1)
    angles = 2.0 * numpy.arctan2(sines, turns[:, 3])
    return turns[:, :3] * (angles / numpy.where(sines > 0.0, sines, 1.0))[:, None]


def _inverse(rotations: numpy.ndarray) -> numpy.ndarray:
    return rotations * numpy.array([-1.0, -1.0, -1.0, 1.0])


def _products(first: numpy.ndarray, second: numpy.ndarray) -> numpy.ndarray:
    """The rotations `second`, then `first`."""
    axis, other = numpy.broadcast_arrays(first[..., :3], second[..., :3])
    w, v = first[..., 3:], second[..., 3:]
    vectors = w * other + v * axis + numpy.cross(axis, other)
    return numpy.concatenate([vectors, w * v - numpy.sum(axis * other, axis=-1, keepdims=True)], axis=-1)
