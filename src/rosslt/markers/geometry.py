"""Rotations as plain tuples (x, y, z, w) and vectors as (x, y, z), with the operations that handles need."""

import math
from typing import Sequence, Tuple

Vector = Tuple[float, float, float]
Rotation = Tuple[float, float, float, float]

#: (x, y, z, qx, qy, qz, qw), the rotation of length 1.
PoseTuple = Tuple[float, float, float, float, float, float, float]

IDENTITY: Rotation = (0.0, 0.0, 0.0, 1.0)

#: The rotations that turn the x axis, along which a control acts, onto the x, y and z axis of a frame.
HALF = math.sqrt(0.5)
ONTO_AXIS: Tuple[Rotation, ...] = (IDENTITY, (0.0, 0.0, HALF, HALF), (0.0, -HALF, 0.0, HALF))

AXES: Tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def normalized(x: float, y: float, z: float, w: float) -> Rotation:
    """The rotation with length 1; all zero, as in a message that nobody filled in, is not a rotation."""
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if length == 0.0:
        return IDENTITY
    return x / length, y / length, z / length, w / length


def inverse(rotation: Sequence[float]) -> Rotation:
    """The rotation back."""
    x, y, z, w = rotation
    return -x, -y, -z, w


def product(first: Sequence[float], second: Sequence[float]) -> Rotation:
    """The rotation `second`, then `first`."""
    ax, ay, az, aw = first
    bx, by, bz, bw = second
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate_vector(rotation: Sequence[float], vector: Sequence[float]) -> Vector:
    """A vector turned by a rotation."""
    x, y, z, _ = product(product(rotation, (*vector, 0.0)), inverse(rotation))
    return x, y, z


def onto(axis: Sequence[float]) -> Rotation:
    """A rotation that turns the x axis onto a direction of length 1."""
    x, y, z = axis
    if x < -1.0 + 1e-9:
        return 0.0, 0.0, 1.0, 0.0
    return normalized(0.0, -z, y, 1.0 + x)


def distance(first: Sequence[float], second: Sequence[float]) -> float:
    """The distance between two points."""
    return math.sqrt(sum((a - b) ** 2 for a, b in zip(first, second)))


def are_same_rotation(first: Sequence[float], second: Sequence[float], tolerance: float = 1e-6) -> bool:
    """Return whether two unit quaternions are the same rotation, as a quaternion and its negative are."""
    return abs(sum(a * b for a, b in zip(first, second))) > 1.0 - tolerance


def without_noise(start: Sequence[float], end: Sequence[float], noise: float) -> Tuple[float, ...]:
    """The end of a move, if coordinates that differ from the start by noise alone are those of the start."""
    return tuple([a if abs(b - a) <= noise * max(1.0, abs(a)) else b for a, b in zip(start, end)])


def turn_without_noise(start: Rotation, end: Rotation, noise: float) -> Rotation:
    """The end of a turn, made exact if it is around an axis of the frame or of the thing except for noise."""
    for is_in_frame in (True, False):
        turn = product(end, inverse(start)) if is_in_frame else product(inverse(start), end)
        clean = tuple([0.0 if abs(part) <= noise else part for part in turn[:3]])
        if clean.count(0.0) >= 2:
            turn = normalized(clean[0], clean[1], clean[2], turn[3])
            return product(turn, start) if is_in_frame else product(start, turn)
    return end
