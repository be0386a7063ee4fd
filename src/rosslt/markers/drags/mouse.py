"""The geometry of a mouse: it says where a thing is wanted.

A mouse says no more than a line, from the eye through the point under it. A thing that moves along one axis goes to the
point of that axis nearest the line, one that moves in a plane to where the line meets the plane: as in RViz.
"""

from typing import Optional, Sequence

from rosslt.markers.geometry import (
    AXES,
    PoseTuple,
    Rotation,
    Vector,
    inverse,
    normalized,
    product,
    rotate_vector,
)

#: A line that meets a plane, or an axis, at so small an angle (its sine) says nothing of where.
GRAZING = 0.02


def dragged(
    grabbed: Sequence[float], eye: Sequence[float], pointer: Sequence[float], axes: Sequence[int], turned: Rotation
) -> Optional[Vector]:
    """The vector by which a thing has to move so that its grabbed point is under the mouse.

    Args:
        grabbed: the point of the thing that was grabbed.
        eye: where the camera is.
        pointer: a point under the mouse.
        axes: those that the thing moves along: 0, 1 and 2 for x, y and z. One, two for their plane, or all three for
            the plane of the screen.
        turned: the rotation of these axes against the frame that all points are in.

    Returns:
        (x, y, z); None if the mouse does not say it, as the axis points at the eye, or the plane is seen edge on.
    """
    line = difference(pointer, eye)
    length = dot(line, line) ** 0.5
    if length == 0.0 or not axes:
        return None
    line = scaled(line, 1.0 / length)
    if len(axes) == 1:
        return _along(grabbed, eye, line, rotate_vector(turned, AXES[axes[0]]))
    if len(axes) == 2:
        (normal,) = {0, 1, 2}.difference(axes)
        return _in_plane(grabbed, eye, line, rotate_vector(turned, AXES[normal]))
    return difference(pointer, grabbed)


def turned_by(before: Sequence[float], after: Sequence[float], start: Sequence[float]) -> Rotation:
    """The rotation of a thing, of `start`, after a control beside it has turned from `before` to `after`."""
    return normalized(*product(product(after, inverse(before)), start))


def into(frame: PoseTuple, point: Sequence[float]) -> Vector:
    """A point of the world in the coordinates of a frame, whose pose in the world is given."""
    return rotate_vector(inverse(frame[3:]), difference(point, frame))


def _along(grabbed: Sequence[float], eye: Sequence[float], line: Vector, axis: Vector) -> Optional[Vector]:
    slant = dot(line, axis)
    sine = 1.0 - slant * slant
    if sine < GRAZING**2:
        return None
    between = difference(eye, grabbed)
    return scaled(axis, (dot(between, axis) - slant * dot(between, line)) / sine)


def _in_plane(grabbed: Sequence[float], eye: Sequence[float], line: Vector, normal: Vector) -> Optional[Vector]:
    slope = dot(line, normal)
    if abs(slope) < GRAZING:
        return None
    way = dot(difference(grabbed, eye), normal) / slope
    if way <= 0.0:  # behind the eye
        return None
    return difference([a + way * b for a, b in zip(eye, line)], grabbed)


def difference(first: Sequence[float], second: Sequence[float]) -> Vector:
    """The vector from the second point to the first."""
    return first[0] - second[0], first[1] - second[1], first[2] - second[2]


def dot(first: Sequence[float], second: Sequence[float]) -> float:
    """The scalar product."""
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def scaled(vector: Sequence[float], factor: float) -> Vector:
    """A vector times a factor."""
    return vector[0] * factor, vector[1] * factor, vector[2] * factor
