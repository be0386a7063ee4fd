"""Handles on the links of a robot, each the link itself: it is pulled and turned by the joints before it."""

import functools
from typing import Any, Dict, List, Optional, Tuple

import numpy
from visualization_msgs.msg import Marker

from rosslt import node
from rosslt.markers.geometry import PoseTuple, Vector, rotate_vector
from rosslt.markers.scene.handle import Axes, CanChange, Handle, Limited, Motions, RankOf, Ring, Settings, has_source
from rosslt.markers.scene.handles import quaternion_factor, tracked_targets
from rosslt.markers.scene.kinematics import Kinematics, Place, position_of, turned
from rosslt.markers.scene.marker import COLOR, laid_over
from rosslt.markers.scene.rotations import SMALL, is_upright, rings_around
from rosslt.markers.scene.shapes import sphere
from rosslt.markers.scene.tracked_kinematics import with_provenance

#: The size of the ball on a link without a shape, relative to that on a pose, and its opacity.
BALL, BALL_ALPHA = 0.75, 0.6

#: The color of a part that has none: (red, green, blue).
GREY: Vector = (0.6, 0.6, 0.6)

#: The ways that a body has: three to go, and three to turn.
ALL_WAYS = 6

KINDS = {'box': Marker.CUBE, 'cylinder': Marker.CYLINDER, 'sphere': Marker.SPHERE, 'mesh': Marker.MESH_RESOURCE}


class RobotPose:
    """The pose of a robot, as a JointState gives it.

    Args:
        topic: where that was published.
        robot: how it is made.
        positions: {name of a joint: its position}, tracked or plain.
        settings: those of all handles.

    Attributes:
        topic, robot, settings: the same.
        plain: the places of its joints and links, in plain numbers.
    """

    def __init__(self, topic: str, robot: node.Robot, positions: Dict[str, Any], settings: Settings) -> None:
        self.topic, self.robot, self.settings, self._positions = topic, robot, settings, positions
        self.plain = Kinematics(robot, {name: float(position) for name, position in positions.items()})

    @functools.cached_property
    def elsewhere(self) -> Kinematics:
        """The places at other positions of the joints: an arm that is stretched out moves no way inward at present."""
        return Kinematics(self.robot, {name: 1.0 + 0.1 * index for index, name in enumerate(self._positions)})

    @functools.cached_property
    def limits(self) -> Tuple[Limited, ...]:
        """All joints that have tracked positions: a drag moves also what mimics a joint, or has the same source."""
        positions = [(joint, self.position(joint)) for joint in self.robot.joints.values()]
        return tuple(
            [Limited(joint.name, value, joint.lower, joint.upper) for joint, value in positions if has_source(value)]
        )

    def position(self, joint: node.Joint) -> Any:
        """The position of a joint, tracked or plain; None if it is not known."""
        return position_of(joint, self._positions)

    def with_provenance(self, link: str, point: Vector, base: str = '') -> Tuple[List[Any], List[Any]]:
        """Return the position of a point of a link, and its orientation, with the provenance of the joints before it.

        Args:
            link: its name.
            point: in its frame, in metres.
            base: the link that it is told in, one that the link hangs on; by default the first one of the robot.
        """
        joints, frame = [], base or self.plain.link(link).frame
        while link != frame:
            joints.append(self.robot.holding[link])
            link = joints[-1].parent
        return with_provenance(joints, list(map(self.position, joints)), point)

    def has_handle(self, link: str) -> bool:
        """Return whether a link has a handle, if it moves: it has a shape, or nothing hangs on it."""
        return link in self.robot.shapes or link in self.robot.ends


def link_name(topic: str, link: str) -> str:
    """The name of the handle on a link of the robot that a topic is about."""
    return '{}:link {}'.format(topic, link)


class RobotHandle(Handle):
    """A handle on a part of a robot, which moves as one, within the limits of its joints."""

    __slots__ = ('_pose',)
    _pose: RobotPose

    @property
    def whole(self) -> str:
        """The robot."""
        return self._pose.topic

    @property
    def limits(self) -> Tuple[Limited, ...]:  # type: ignore[override]
        """The limits of the robot's joints."""
        return self._pose.limits


class LinkHandle(RobotHandle):
    """A link, grabbed in the middle of its shapes, or by a ball: all joints before it move and turn it.

    Args:
        pose: of the robot.
        link: its name.
    """

    __slots__ = ('_grip', '_link')

    def __init__(self, pose: RobotPose, link: str) -> None:
        self._pose, self._link = pose, link
        shapes, count = pose.robot.shapes.get(link, ()), len(pose.robot.shapes.get(link, ())) or 1
        x, y, z = (sum(shape.position[axis] for shape in shapes) / count for axis in range(3))
        self._grip: Vector = (x, y, z)
        place = self._place_in(pose.plain)
        numbers = [pose.position(joint) for joint in place.moved_by]
        ball = BALL * pose.settings.ball_size
        # as thick as it is: arrows stand out of a long link sideways
        size = max([sorted(shape.size)[1] for shape in shapes if shape.kind != 'mesh'] or [2.5 * ball])
        draw_key = link, shapes, ball, place.frame, tuple(map(has_source, numbers))
        name = link_name(pose.topic, link)
        super().__init__(name, place.frame, place.pose, size, draw_key, numbers, lambda: self._drawn(ball))

    @property
    def draws_thing(self) -> bool:  # type: ignore[override]
        """True if nobody else draws the robot."""
        return self._pose.settings.draws_all

    def wanted(self, pose: PoseTuple, moved: bool, turned: bool) -> Tuple[List[Any], List[float]]:
        """The targets of a drag to a pose. A link that can do both is turned where it stands."""
        position, rotation = self._pose.with_provenance(self._link, self._grip)
        pairs: List[Tuple[Any, float]] = []
        if moved or (turned and self._goes_all_ways()):
            pairs += zip(position, pose[: 2 if self._pose.settings.is_planar else 3])
        if turned:
            factor = quaternion_factor(rotation, pose[3:])
            pairs += zip(rotation, (factor * part for part in pose[3:]))
        return tracked_targets(pairs)

    def motions(self, can_change: CanChange, rank_of: Optional[RankOf] = None) -> Motions:
        """The ways in which the joints before it move it, and, if it is fixed or at an end, turn it at present."""
        del rank_of
        ways = self._ways(self._pose.elsewhere, can_change)
        x, y, z = (any(abs(way[axis]) > SMALL for way in ways) for axis in range(3))
        axes: Axes = (x, y, z and not self._pose.settings.is_planar)
        robot, rotation = self._pose.robot, self.pose[3:]
        rings: Tuple[Ring, ...] = ()
        if ways and (robot.holding[self._link].is_fixed or self._link in robot.ends):
            spins = [(a, b, c) for _, _, _, a, b, c in self._ways(self._pose.plain, can_change) if a or b or c]
            rings = rings_around(rotation, spins)
        if self._pose.settings.is_planar:
            rings = tuple([ring for ring in rings if is_upright(ring, rotation)])
        return Motions(axes, is_in_frame=True, arrows=axes, rings=rings)

    def _goes_all_ways(self) -> bool:
        """Return whether the joints before it, that come from something, can move and turn it in all ways."""
        ways = self._ways(self._pose.elsewhere)
        return len(ways) >= ALL_WAYS and int(numpy.linalg.matrix_rank(ways)) == ALL_WAYS

    def _ways(self, kinematics: Kinematics, can_change: CanChange = has_source) -> List[Tuple[float, ...]]:
        """How the joints before it, that come from something and take changes, move and turn it: of each a
        `Kinematics.way`."""
        place = self._place_in(kinematics)
        positions = [(joint, self._pose.position(joint)) for joint in place.moved_by]
        joints = [joint for joint, position in positions if has_source(position) and can_change(position)]
        return [kinematics.way(joint, place.position) for joint in joints]

    def _place_in(self, kinematics: Kinematics) -> Place:
        """Return the place at which it is grabbed, given the places of its robot."""
        place = kinematics.link(self._link)
        offset = rotate_vector(place.rotation, self._grip)
        return place._replace(position=[a + b for a, b in zip(place.position, offset)])

    def _drawn(self, ball: float) -> List[Marker]:
        shapes = self._pose.robot.shapes.get(self._link)
        return [self._part(shape) for shape in shapes] if shapes else [sphere(ball, COLOR, BALL_ALPHA)]

    def _part(self, shape: node.Shape) -> Marker:
        part = sphere(0.0, shape.color or GREY)
        part.type, part.mesh_resource = KINDS[shape.kind], shape.mesh
        part.scale.x, part.scale.y, part.scale.z = shape.size
        position, orientation = part.pose.position, part.pose.orientation
        position.x, position.y, position.z = (a - b for a, b in zip(shape.position, self._grip))
        orientation.x, orientation.y, orientation.z, orientation.w = turned(shape.roll_pitch_yaw)
        if not self.draws_thing:
            laid_over(part)
        return part
