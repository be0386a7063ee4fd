"""Forward kinematics: where the joints and links of a robot are, given the positions of its joints."""

import functools
import math
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Tuple

from rosslt import node
from rosslt.markers.geometry import AXES, IDENTITY, PoseTuple, Rotation, Vector, normalized, product, rotate_vector


class Place(NamedTuple):
    """A place and a rotation in space.

    Attributes:
        frame: the link that the rest is relative to.
        position: x, y and z, in metres.
        rotation: a quaternion (x, y, z, w) of length 1.
        moved_by: the joints that move it, from that link outward.
    """

    frame: str
    position: Sequence[float]
    rotation: Sequence[float]
    moved_by: Tuple[node.Joint, ...] = ()

    @property
    def pose(self) -> PoseTuple:
        """The position and the orientation."""
        x, y, z = self.position
        return (x, y, z, *normalized(*self.rotation))


def position_of(joint: node.Joint, positions: Mapping[str, Any]) -> Any:
    """The position of a joint, its own or what follows from the joint that it mimics; None if it is not known.

    Args:
        positions: {name of a joint: its position}, tracked or plain, in radians or metres.
    """
    own, mimic = positions.get(joint.name), joint.mimic
    if own is not None or mimic is None:
        return own
    followed = positions.get(mimic.joint)
    return None if followed is None else mimic.multiplier * followed + mimic.offset


class Kinematics:
    """The places of the joints and links of a robot, each in the frame of the first link before it of which all joints
    between have known positions: the root, if all have.

    Args:
        robot: how it is made.
        positions: {name of a joint: its position}, in radians or metres.
    """

    def __init__(self, robot: node.Robot, positions: Mapping[str, float]) -> None:
        self._robot, self._positions = robot, positions
        self._links: Dict[str, Place] = {}

    def joint(self, joint: node.Joint) -> Place:
        """Return the place of a joint for its position 0."""
        link = self.link(joint.parent)
        position = _plus(link.position, rotate_vector(link.rotation, joint.position))
        rotation = product(link.rotation, turned(joint.roll_pitch_yaw))
        return link._replace(position=position, rotation=rotation)

    def link(self, link: str) -> Place:
        """Return the place of a link."""
        way: List[node.Joint] = []
        while link not in self._links:
            joint = self._robot.holding.get(link)
            if joint is None or not (joint.is_fixed or position_of(joint, self._positions) is not None):
                self._links[link] = Place(link, (0.0, 0.0, 0.0), IDENTITY)
            else:
                way.append(joint)
                link = joint.parent
        for joint in reversed(way):
            start, by = self.joint(joint), position_of(joint, self._positions)
            self._links[joint.child] = start if joint.is_fixed else behind(start, joint, by)
        return self._links[way[0].child if way else link]

    def way(self, joint: node.Joint, position: Sequence[float]) -> Tuple[float, ...]:
        """Return a column of the Jacobian: the speed with which a joint moves a position along x, y and z, and turns it
        around them, in metres and radians for each of its radians or metres."""
        start = self.joint(joint)
        x, y, z = axis = rotate_vector(start.rotation, joint.axis)
        if not joint.is_turning:
            return (*axis, 0.0, 0.0, 0.0)
        a, b, c = (there - here for there, here in zip(position, start.position))
        return y * c - z * b, z * a - x * c, x * b - y * a, x, y, z


@functools.lru_cache(maxsize=None)
def turned(roll_pitch_yaw: Vector) -> Rotation:
    """The rotation of a URDF's `rpy`: about x, then y, then z of what it is relative to, in radians."""
    result = IDENTITY
    for axis, angle in zip(AXES, roll_pitch_yaw):
        result = product(_around(axis, angle), result)
    return result


def behind(start: Place, joint: node.Joint, by: float) -> Place:
    """Return the place of the link behind a joint, given the place of the joint and its position."""
    moved_by = (*start.moved_by, joint)
    if joint.is_turning:
        return start._replace(rotation=product(start.rotation, _around(joint.axis, by)), moved_by=moved_by)
    way = [part * by for part in rotate_vector(start.rotation, joint.axis)]
    return start._replace(position=_plus(start.position, way), moved_by=moved_by)


def _around(axis: Vector, angle: float) -> Rotation:
    sine = math.sin(0.5 * angle)
    x, y, z = (part * sine for part in axis)
    return x, y, z, math.cos(0.5 * angle)


def _plus(first: Sequence[float], second: Sequence[float]) -> List[float]:
    return [a + b for a, b in zip(first, second)]
