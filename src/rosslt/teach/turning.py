"""Rotations as vectors: the axis, as long as the angle in radians."""

import math

from rosslt.markers.geometry import Rotation, Vector


def rotation_vector(rotation: Rotation) -> Vector:
    """The axis of a rotation, as long as its angle, which is at most half a turn."""
    x, y, z, w = rotation if rotation[3] >= 0.0 else tuple(-part for part in rotation)
    sine = math.sqrt(x * x + y * y + z * z)
    return scaled((x, y, z), 2.0 * math.atan2(sine, w) / sine) if sine else (0.0, 0.0, 0.0)


def rotation_of(turn: Vector) -> Rotation:
    """The rotation around an axis by its length, in radians."""
    angle = math.sqrt(sum(part * part for part in turn))
    x, y, z = scaled(turn, math.sin(angle / 2.0) / angle) if angle else (0.0, 0.0, 0.0)
    return x, y, z, math.cos(angle / 2.0)


def scaled(vector: Vector, factor: float) -> Vector:
    """A vector, so many times as long."""
    return vector[0] * factor, vector[1] * factor, vector[2] * factor
