"""The kinds of handles: on a thing with a pose, on a point of a thing, and on a size of a thing."""

import math
from typing import Any, Callable, Hashable, Iterable, List, Optional, Sequence, Tuple, Union

from geometry_msgs.msg import Point, Point32, Pose
from visualization_msgs.msg import Marker

from rosslt import values
from rosslt.markers.geometry import (
    AXES,
    IDENTITY,
    PoseTuple,
    Rotation,
    Vector,
    inverse,
    normalized,
    rotate_vector,
)
from rosslt.markers.scene.fillers import fills
from rosslt.markers.scene.handle import POINTS, SIZES, Axes, CanChange, Handle, Motions, RankOf, has_source
from rosslt.markers.scene.rotations import is_upright, rings_of
from rosslt.markers.scene.shapes import AXIS_COLORS, cube, pose_tuple, sphere

ORIGIN: Vector = (0.0, 0.0, 0.0)

#: The smallest size of a scaled thing that a drag can ask for, in metres: RViz draws nothing of size zero.
SMALLEST_SCALE = 1e-3

#: A plain part of a quaternion up to this is a small tilt, which does not say how long the quaternion is to be.
TILT = 1e-3

#: The rounding error of a computation with floats.
ROUNDING = 1e-12


def movable_axes(coordinates: Iterable[Any], can_change: CanChange) -> Axes:
    """True for each of x, y and z that is tracked and has a source that takes changes."""
    x, y, z = (has_source(value) and can_change(value) for value in coordinates)
    return x, y, z


class PoseHandle(Handle):
    """A thing with a position and an orientation, either of which may be tracked in part.

    Args:
        name: unique, and the same for the same thing in the next message.
        frame: the frame that the pose is in.
        pose: a geometry_msgs/Pose.
        size: how large the thing is, in metres.
        shape_key: what its shapes depend on.
        shapes: as those of a Handle.
        has_arrows: False if the shapes alone are to be grabbed, as there are many of their kind.
        is_planar: whether it moves in x and y and turns around z only.
        rank: as that of a Handle.
        has_points: whether the thing has tracked points, which move it as well.
        shows_turns: False if it looks alike however it is turned.
        draws_thing: as that of a Handle.
    """

    __slots__ = ('_fills', '_has_arrows', '_is_planar', '_orientation', 'draws_thing', 'position')
    position: Tuple[Any, ...]

    def __init__(
        self,
        name: str,
        frame: str,
        pose: Pose,
        size: float,
        shape_key: Hashable,
        shapes: Callable[[], List[Marker]],
        has_arrows: bool = True,
        is_planar: bool = False,
        rank: int = 0,
        has_points: bool = False,
        shows_turns: bool = True,
        draws_thing: bool = False,
    ) -> None:
        numbers = pose_tuple(pose)
        self.position, self._orientation = numbers[:3], numbers[3:]
        rotation = normalized(*map(float, self._orientation))
        x, y, z = map(float, self.position)
        x_moves, y_moves, z_moves = map(has_source, self.position)
        movable = (x_moves, y_moves, z_moves)
        self._fills = (
            has_points and fills(self.position, ORIGIN),
            (has_points or not shows_turns) and fills(self._orientation, IDENTITY),
        )
        draw_key = (
            movable,
            self._fills,
            tuple(map(has_source, self._orientation)),
            _body_direction(movable, rotation),
            frame,
            size,
            shape_key,
        )
        super().__init__(name, frame, (x, y, z, *rotation), size, draw_key, numbers, shapes, rank)
        self._has_arrows, self._is_planar, self.draws_thing = has_arrows, is_planar, draws_thing

    def wanted(self, pose: PoseTuple, moved: bool, turned: bool) -> Tuple[List[Any], List[float]]:
        """The targets of a drag to a pose."""
        pairs: List[Tuple[Any, float]] = []
        if moved:
            pairs.extend(zip(self.position, pose[: 2 if self._is_planar else 3]))
        if turned:
            factor = quaternion_factor(self._orientation, pose[3:])
            pairs.extend(zip(self._orientation, (factor * part for part in pose[3:])))
        return tracked_targets(pairs)

    def asked(self, can_change: CanChange) -> List[Any]:
        """Return the tracked values that a drag may ask to become others.

        Of a quaternion that nothing can turn, no number is asked; in 2D, a turn of what stands upright leaves the x and
        y of its quaternion 0.
        """
        parts: Tuple[Any, ...] = ()
        if self.motions(can_change).rings:
            is_tilted = any(abs(part) > ROUNDING for part in map(float, self._orientation[:2]))
            parts = self._orientation[2:] if self._is_planar and not is_tilted else self._orientation
        moving = self.position[:2] if self._is_planar else self.position
        return [number for number in (*moving, *parts) if has_source(number)]

    def motions(self, can_change: CanChange, rank_of: Optional[RankOf] = None) -> Motions:
        """The ways in which it can be moved."""
        position, orientation = self.position, self._orientation
        if rank_of is not None:
            position, orientation = (
                tuple(map(float, numbers)) if fills_only else numbers
                for numbers, fills_only in zip((position, orientation), self._fills)
            )
        movable = movable_axes(position, can_change)
        turnable = [part if has_source(part) and can_change(part) else float(part) for part in orientation]
        rings = rings_of(turnable, rank_of)
        if self._is_planar:
            movable = (movable[0], movable[1], False)
            rings = tuple([ring for ring in rings if is_upright(ring, self.pose[3:])])
        arrows = movable if self._has_arrows or sum(movable) == 1 else (False, False, False)
        return Motions(movable, True, arrows, rings)


class PointHandle(Handle):
    """A point in the coordinates of a thing, such as a corner of a line strip; drawn as a sphere.

    Args:
        name, frame: as those of a PoseHandle.
        pose: the pose of the thing that has the point.
        point: has the coordinates `x`, `y` and `z`.
        size: the diameter of the sphere, in metres.
        color: the color of the sphere, (red, green, blue).
        is_planar, rank: as those of a PoseHandle.
        thing: as that of a Handle.
        thing_at: the x, y and z of the thing, tracked or plain.
    """

    __slots__ = ('_base', '_is_planar', '_point', '_thing_at')
    level = POINTS

    def __init__(
        self,
        name: str,
        frame: str,
        pose: PoseTuple,
        point: Union[Point, Point32],
        size: float,
        color: Vector,
        is_planar: bool = False,
        rank: int = 1,
        thing: str = '',
        thing_at: Sequence[Any] = ORIGIN,
    ) -> None:
        self._base, self._is_planar, self._thing_at = pose, is_planar, thing_at
        self._point: Tuple[Any, ...] = (point.x, point.y, point.z)
        x, y, z = rotate_vector(pose[3:], tuple(map(float, self._point)))
        draw_key = tuple(map(has_source, self._point)), frame, size, color
        there = pose[0] + x, pose[1] + y, pose[2] + z, *pose[3:]
        super().__init__(name, frame, there, size, draw_key, self._point, lambda: [sphere(size, color)], rank, thing)

    @property
    def position(self) -> Optional[Tuple[Any, ...]]:  # type: ignore[override]
        """The tracked or plain x, y and z where it stands, if they are coordinates of its frame."""
        return self._point if self._base == (0.0, 0.0, 0.0, *IDENTITY) else None

    def wanted(self, pose: PoseTuple, moved: bool, turned: bool) -> Tuple[List[Any], List[float]]:
        """The targets of a drag to a pose; a point has nothing but its position."""
        del moved, turned
        offset = tuple(a - b for a, b in zip(pose[:3], self._base))
        local = rotate_vector(inverse(self._base[3:]), offset)
        moved_with = [
            with_its_thing(number, self._thing_at, rotate_vector(self._base[3:], axis))
            for number, axis in zip(self._point, AXES)
        ]
        return tracked_targets(zip(moved_with, local[: 2 if self._is_planar else 3]))

    def asked(self, can_change: CanChange) -> List[Any]:
        """Return the tracked values that a drag may ask to become others."""
        del can_change
        return [number for number in self._point[: 2 if self._is_planar else 3] if has_source(number)]

    def motions(self, can_change: CanChange, rank_of: Optional[RankOf] = None) -> Motions:
        """The ways in which it can be moved: along the axes of the thing."""
        del rank_of
        x, y, z = movable_axes(self._point, can_change)
        return Motions((x, y, z and not self._is_planar))


class ScaleHandle(Handle):
    """A handle that changes a thing's size along one axis: a small cube on its side.

    Args:
        name, frame: as those of a PoseHandle.
        pose: the pose of the thing.
        start: where the size is measured from, in the coordinates of the thing.
        axis: 0, 1 or 2 for x, y or z of the thing, along which the handle moves.
        reach: how far out the handle stands for each metre of the size: 0.5 if the thing grows both ways.
        scale: the size itself.
        size: the side of the cube, in metres.
        thing: as that of a Handle.
        thing_at: as that of a PointHandle.
    """

    __slots__ = ('_axis', '_direction', '_reach', '_scale', '_start', '_thing_at')
    level = SIZES

    def __init__(
        self,
        name: str,
        frame: str,
        pose: PoseTuple,
        start: Sequence[float],
        axis: int,
        reach: float,
        scale: Any,
        size: float,
        thing: str = '',
        thing_at: Sequence[Any] = ORIGIN,
    ) -> None:
        rotation = pose[3:]
        self._thing_at = thing_at
        self._start = tuple(a + b for a, b in zip(pose, rotate_vector(rotation, start)))
        self._direction = rotate_vector(rotation, tuple(float(index == axis) for index in range(3)))
        self._axis, self._reach, self._scale = axis, reach, scale
        out = reach * float(scale)
        x, y, z = (a + out * b for a, b in zip(self._start, self._direction))
        draw_key, color = (axis, frame, size), AXIS_COLORS[axis]
        place = x, y, z, *rotation
        super().__init__(name, frame, place, size, draw_key, [scale], lambda: [cube(size, color)], thing=thing)

    @property
    def is_upright(self) -> bool:
        """True if it moves along z of its frame."""
        return math.isclose(abs(self._direction[2]), 1.0)

    def wanted(self, pose: PoseTuple, moved: bool, turned: bool) -> Tuple[List[Any], List[float]]:
        """The target of a drag to a pose; a size moves along its axis, and no other way."""
        del moved, turned
        out = sum((a - b) * c for a, b, c in zip(pose, self._start, self._direction))
        # A mesh with a negative scale is mirrored, and stays so.
        side = math.copysign(1.0, self._scale)
        number = with_its_thing(self._scale, self._thing_at, self._direction, self._reach)
        return [number], [side * max(side * out / self._reach, SMALLEST_SCALE)]

    def motions(self, can_change: CanChange, rank_of: Optional[RankOf] = None) -> Motions:
        """The ways in which it can be moved: along its axis of the thing."""
        del rank_of
        is_free = can_change(self._scale)
        return Motions((is_free and self._axis == 0, is_free and self._axis == 1, is_free and self._axis == 2))


def with_its_thing(number: Any, thing_at: Iterable[Any], direction: Vector, reach: float = 1.0) -> Any:
    """A number by which a handle stands on a thing, plus what moves the handle as well if the thing moves with that
    number: a box that stands on the ground grows, and its middle rises.

    Args:
        number: tracked or plain.
        thing_at: the x, y and z of the thing.
        direction: in which the number moves the handle.
        reach: how far it does, for each unit of the number.
    """
    moved, own = number, set(values.sources([number]))
    for coordinate, part in zip(thing_at, direction):
        if own and part and has_source(coordinate):
            for source, value, slope in values.linearized(coordinate):
                if slope and source in own:
                    moved = moved + part * slope / reach * (values.track(value, source) - value)
    return moved


def _body_direction(movable: Axes, rotation: Rotation) -> Optional[Vector]:
    """The line that a body moves along, or the normal of its plane, in its own, turned coordinates.

    It is all of a rotation that the drawing of a body depends on: a thing that turns about z stays as it is drawn.
    """
    axes = [axis for axis in range(3) if movable[axis]]
    if not axes:
        return None
    (axis,) = axes if len(axes) == 1 else {0, 1, 2}.difference(axes) or {2}
    if rotation == IDENTITY:
        return AXES[axis]
    x, y, z = rotate_vector(inverse(rotation), AXES[axis])
    return round(x, 9) + 0.0, round(y, 9) + 0.0, round(z, 9) + 0.0


def quaternion_factor(orientation: Sequence[Any], rotation: Sequence[float]) -> float:
    """By what a rotation of length 1 is multiplied to be asked of a quaternion, any multiple of which is that rotation.

    Plain parts stay as they are: if some are not 0, the multiple is the one that has them, or comes nearest.
    """
    plain = [(part, goal) for part, goal in zip(orientation, rotation) if not has_source(part) and abs(part) > TILT]
    square = sum(goal * goal for _, goal in plain)
    if square > ROUNDING:
        return float(sum(part * goal for part, goal in plain)) / square
    present = tuple(map(float, orientation))
    # A quaternion and its negative are the same rotation: ask for the one that is nearer.
    factor = sum(a * b for a, b in zip(present, rotation))
    length = sum(a * a for a in present) ** 0.5 or 1.0
    return -length if factor < 0.0 else length


def tracked_targets(pairs: Iterable[Tuple[Any, float]]) -> Tuple[List[Any], List[float]]:
    """The tracked values, and their targets, among pairs of a value and its target."""
    tracked, targets = [], []
    for value, target in pairs:
        if has_source(value):
            tracked.append(value)
            # To turn a target into the coordinates of a thing and back costs a few digits: what stays, stays exactly.
            is_same = math.isclose(value, target, rel_tol=ROUNDING, abs_tol=ROUNDING)
            targets.append(float(value) if is_same else target)
    return tracked, targets
