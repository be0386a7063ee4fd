"""Handles: what can be dragged, and which numbers it would change.

A handle is made anew of every message, so that it always holds the values with their latest provenance. Its
`look` is all that its drawing depends on: two handles of equal name and look differ in their pose alone. The
board asks for the drawing, an InteractiveMarker, only where the look has changed.
"""

import math

from rosslt import values
from rosslt.markers import controls
from rosslt.markers.geometry import inverse, normalized, rotated
from rosslt.markers.reach import turnable_directions

#: The smallest size of a scaled thing that a drag can ask for, in metres: RViz draws nothing of size zero.
SMALLEST_SCALE = 1e-3

#: How large the controls are against the thing: RViz has arrows begin at half of that, outside the thing.
ARROW_SCALE = 1.5

#: What a computation with floats may be off.
ROUNDING = 1e-12


def can_change(value):
    """Whether a value has a source."""
    return type(value) is not float and values.is_tracked(value)


def movable_of(coordinates, can_move):
    """For x, y and z: whether it is tracked, and has a source that takes changes."""
    return tuple([can_change(value) and can_move(value) for value in coordinates])


def _tracked_targets(pairs):
    """Of pairs of a value and its target: the tracked values, and their targets."""
    pairs = [(value, target) for value, target in pairs if can_change(value)]
    # To turn a target into the coordinates of a thing and back costs a few digits: what stays, stays exactly.
    return [value for value, _ in pairs], [
        float(value) if math.isclose(value, target, rel_tol=ROUNDING, abs_tol=ROUNDING) else target
        for value, target in pairs
    ]


class PoseHandle:
    """A thing with a position and an orientation, either of which may be tracked in part.

    Args:
        name: unique, and the same for the same thing in the next message.
        frame: the frame that the pose is in.
        pose: a geometry_msgs/Pose.
        size: how large the thing is, in metres.
        look: what its shapes depend on; hashable.
        shapes: makes the Markers to grab, posed relative to the thing.
        has_arrows: False where the shapes alone are to be grabbed, as there are many of their kind.
    """

    __slots__ = ('name', 'frame', 'pose', 'look', 'size', '_position', '_orientation', '_shapes', '_has_arrows')

    def __init__(self, name, frame, pose, size, look, shapes, has_arrows=True):
        position, orientation = pose.position, pose.orientation
        self.name, self.frame = name, frame
        self._position = (position.x, position.y, position.z)
        self._orientation = (orientation.x, orientation.y, orientation.z, orientation.w)
        rotation = normalized(*map(float, self._orientation))
        self.pose = (*map(float, self._position), *rotation)
        self.size, self._shapes, self._has_arrows = size, shapes, has_arrows
        movable = tuple(map(can_change, self._position))
        # A body that moves along some of the axes only has them in its own, turned coordinates.
        turn = rotation if any(movable) and not all(movable) else None
        self.look = (movable, tuple(map(can_change, self._orientation)), turn, frame, size, look)

    @property
    def tracked(self):
        """The values that a drag can change."""
        return [value for value in (*self._position, *self._orientation) if can_change(value)]

    def wanted(self, pose, moved, turned):
        """What a drag to a pose asks for.

        Args:
            pose: (x, y, z, qx, qy, qz, qw).
            moved, turned: whether the drag has changed the position, and the orientation.

        Returns:
            ([tracked value], [what it should become]).
        """
        pairs = []
        if moved:
            pairs.extend(zip(self._position, pose[:3]))
        if turned:
            present = tuple(map(float, self._orientation))
            # A quaternion and its negative are the same rotation: ask for the one that is nearer.
            factor = sum(a * b for a, b in zip(present, pose[3:]))
            length = sum(a * a for a in present) ** 0.5 or 1.0
            factor = -length if factor < 0.0 else length
            pairs.extend(zip(self._orientation, (factor * part for part in pose[3:])))
        return _tracked_targets(pairs)

    def draw(self, can_move):
        """The interactive marker, without a menu.

        Args:
            can_move: tells of a tracked value whether it has a source that takes changes.
        """
        movable = movable_of(self._position, can_move)
        parts = [controls.arrow(axis) for axis in range(3) if movable[axis] and (self._has_arrows or sum(movable) == 1)]
        turnable = [part if can_change(part) and can_move(part) else float(part) for part in self._orientation]
        parts.extend(controls.ring(name, direction) for name, direction in turnable_directions(turnable))
        parts.append(controls.body(movable, self._shapes(), self.pose[3:], has_menu=bool(self.tracked)))
        return controls.interactive_marker(self.name, self.frame, self.pose, ARROW_SCALE * self.size, parts)


class PointHandle:
    """A point in the coordinates of a thing, such as a corner of a line strip; drawn as a sphere.

    Args:
        name, frame: as of a PoseHandle.
        pose: of the thing that has the point, (x, y, z, qx, qy, qz, qw).
        point: has the coordinates `x`, `y` and `z`.
        size: the diameter of the sphere, in metres.
        color: (red, green, blue) of the sphere.
    """

    __slots__ = ('name', 'frame', 'pose', 'look', '_base', '_point', 'size', '_color')

    def __init__(self, name, frame, pose, point, size, color):
        self.name, self.frame = name, frame
        self._base = pose
        self._point = (point.x, point.y, point.z)
        self.size, self._color = size, color
        offset = rotated(pose[3:], tuple(map(float, self._point)))
        self.pose = (*(a + b for a, b in zip(pose, offset)), *pose[3:])
        self.look = (tuple(map(can_change, self._point)), frame, size, color)

    @property
    def tracked(self):
        """The values that a drag can change."""
        return [value for value in self._point if can_change(value)]

    def wanted(self, pose, moved, turned):
        """What a drag to a pose asks for, as of a PoseHandle."""
        del moved, turned  # a point has nothing but its position
        offset = tuple(a - b for a, b in zip(pose[:3], self._base))
        local = rotated(inverse(self._base[3:]), offset)
        return _tracked_targets(zip(self._point, local))

    def draw(self, can_move):
        """The interactive marker, as of a PoseHandle."""
        movable = movable_of(self._point, can_move)
        parts = [controls.body(movable, [controls.sphere(self.size, self._color)])]
        return controls.interactive_marker(self.name, self.frame, self.pose, ARROW_SCALE * self.size, parts)


class ScaleHandle:
    """One of the three sizes of a thing: a small cube on its side.

    Args:
        name, frame: as of a PoseHandle.
        pose: of the thing, (x, y, z, qx, qy, qz, qw).
        start: where the size is measured from, in the coordinates of the thing.
        axis: 0, 1 or 2 for x, y or z of the thing, along which the handle moves.
        reach: how far out the handle stands for each metre of the size: 0.5 where the thing grows both ways.
        scale: the size itself.
        size: of the cube, in metres.
    """

    __slots__ = ('name', 'frame', 'pose', 'look', '_start', '_direction', '_axis', '_reach', '_scale', 'size')

    def __init__(self, name, frame, pose, start, axis, reach, scale, size):
        self.name, self.frame = name, frame
        rotation = pose[3:]
        self._start = tuple(a + b for a, b in zip(pose, rotated(rotation, start)))
        self._direction = rotated(rotation, tuple(float(index == axis) for index in range(3)))
        self._axis, self._reach, self._scale, self.size = axis, reach, scale, size
        out = reach * float(scale)
        self.pose = (*(a + out * b for a, b in zip(self._start, self._direction)), *rotation)
        self.look = (axis, frame, size)

    @property
    def tracked(self):
        """The values that a drag can change."""
        return [self._scale]

    def wanted(self, pose, moved, turned):
        """What a drag to a pose asks for, as of a PoseHandle."""
        del moved, turned  # it moves along its axis, and no other way
        out = sum((a - b) * c for a, b, c in zip(pose, self._start, self._direction))
        return [self._scale], [max(out / self._reach, SMALLEST_SCALE)]

    def draw(self, can_move):
        """The interactive marker, as of a PoseHandle."""
        movable = [index == self._axis and can_move(self._scale) for index in range(3)]
        parts = [controls.body(movable, [controls.cube(self.size, controls.AXIS_COLORS[self._axis])])]
        return controls.interactive_marker(self.name, self.frame, self.pose, ARROW_SCALE * self.size, parts)
