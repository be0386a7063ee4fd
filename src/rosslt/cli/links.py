"""Links of robots as things that can be forced: where one is, is computed of each JointState, with provenance."""

import math
from typing import Any, Collection, Dict, Iterator, Mapping, Optional, Tuple

import rospy
from sensor_msgs.msg import JointState

from rosslt import node, values
from rosslt.cli.failure import Failure, did_you_mean
from rosslt.cli.output import few
from rosslt.markers import RobotPose, Settings, joint_limits
from rosslt.msg import LinkPose
from rosslt.node import Heard

_ATAN2, _ASIN = values.MATH['atan2'], values.MATH['asin']


class Link:
    """A link of a robot, of which each message about the positions of the joints makes a `LinkPose`.

    Args:
        topic: where the positions of the joints come.
        robot: how it hangs together.
        name: of the link.
        base: the link that its pose is told in: one that it hangs on.

    Attributes:
        topic: the same.
        title: what it is called for people.
    """

    def __init__(self, topic: str, robot: node.Robot, name: str, base: str) -> None:
        self.topic, self._robot, self._name, self._base = topic, robot, name, base
        self.title = f'{name} in {base}'
        self._joints = list(_before(robot, name, base))
        self._limits: Tuple[Any, ...] = ()  # of the joints in the last message

    def stream(self, listener: node.Listener) -> 'LinkStream':
        """The poses of the link, as messages."""
        return LinkStream(listener, self)

    def forcing(self, *arguments: Any) -> 'LinkForcing':
        """A Forcing of the link; the arguments are those of a Forcing."""
        forcing = LinkForcing(*arguments)
        forcing.link = self
        return forcing

    def message(self, state: JointState) -> Optional[LinkPose]:
        """The pose of the link as a message says; None if that does not have all joints before it."""
        if len(state.name) != len(state.position):
            return None
        named = zip(reversed(state.name), reversed(state.position))
        pose = RobotPose(
            self.topic, self._robot, {name: value for name, value in named if math.isfinite(value)}, Settings()
        )
        if any(pose.position(joint) is None for joint in self._joints):
            return None
        self._limits = pose.limits
        place, (x, y, z, w) = pose.with_provenance(self._name, (0.0, 0.0, 0.0), self._base)
        message = LinkPose(child_frame_id=self._name)
        message.header.frame_id = self._base
        message.position.x, message.position.y, message.position.z = place
        turned = message.orientation
        turned.roll = _ATAN2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        turned.pitch = _ASIN(2.0 * (w * y - z * x))
        turned.yaw = _ATAN2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return message

    def solve(
        self, part: Any, wanted: Any, sources: Optional[Collection[values.Source]], limits: Mapping[str, Any]
    ) -> Dict[values.Source, Any]:
        """Solve for a part of the last message, within the limits of the joints.

        Args:
            part, wanted, sources, limits: as of `solve_by_effect`.

        Raises:
            values.NotInvertible: it cannot come there, or a joint would come beyond its limits.
        """
        bounds = joint_limits.narrowed(limits['bounds'], self._limits)
        found = node.solve_by_effect(part, wanted, sources, {**limits, 'bounds': bounds})
        joint_limits.check(self._limits, found)
        return found


class LinkStream:
    """The poses of a link, as a Listener has messages.

    Args:
        listener: of the positions of the joints.
        link: makes poses of them.
    """

    def __init__(self, listener: node.Listener, link: Link) -> None:
        self._listener, self._link = listener, link

    def clear(self) -> None:
        """Forget what has come."""
        self._listener.clear()

    def why_nothing(self, timeout: float) -> str:
        """Say why nothing has come, as a Listener does."""
        return self._listener.why_nothing(timeout)

    def next_before(self, end: float) -> Optional[Heard]:
        """The next pose, or None if there is none until a time of `time.monotonic`."""
        while True:
            heard = self._listener.next_before(end)
            message = self._link.message(heard.message) if heard is not None else None
            if heard is None or message is not None:
                return heard and heard._replace(message=message)


class LinkForcing(node.Forcing):
    """Forces where a link is, within the limits of the joints."""

    link: Link

    def solve(self, part: Any, limits: Mapping[str, Any]) -> Dict[values.Source, Any]:
        """Solve for a part of a pose."""
        return self.link.solve(part, self.wanted, self.sources, limits)


def find_link(types: Mapping[str, str], link: str, base: str) -> Link:
    """Find the robot that has a link.

    Args:
        types: {published topic: type of its messages}.
        link: its name.
        base: the link that its pose is told in; '' for the one that the robot stands on.

    Raises:
        Failure: there is no such link, several robots have it, or it does not hang on `base`.
    """
    topics = sorted(topic for topic, kind in types.items() if kind in (JointState._type, 'rosslt/JointStateTracked'))
    robots = {topic: robot for topic, robot in zip(topics, map(_robot_of, topics)) if robot.holding}
    having = [topic for topic, robot in robots.items() if link in robot.holding]
    if not having:
        links = sorted({one for robot in robots.values() for one in robot.holding})
        known = f'the links of robots are {few(links)}' if links else 'no JointState has a robot_description'
        raise Failure(f'{link} is not a link that hangs on another one{did_you_mean(link, links)}; {known}')
    if len(having) > 1:
        raise Failure(f'several robots have a link {link}: those of {" and ".join(having)}')
    robot = robots[having[0]]
    above = list(_above(robot, link))
    if base and base not in above:
        raise Failure(f'{link} does not hang on {base}{did_you_mean(base, above)}; it hangs on {few(above)}')
    return Link(having[0], robot, link, base or above[-1])


def _robot_of(topic: str) -> node.Robot:
    try:
        description = node.description_for(topic)
    except LookupError:
        return node.NO_ROBOT
    return node.robot_in(description, rospy.get_param(description))


def _above(robot: node.Robot, link: str) -> Iterator[str]:
    """The links that a link hangs on, from it inward."""
    while link in robot.holding:
        link = robot.holding[link].parent
        yield link


def _before(robot: node.Robot, link: str, base: str) -> Iterator[node.Joint]:
    """The moving joints between a link and one that it hangs on."""
    while link != base:
        joint = robot.holding[link]
        if not joint.is_fixed:
            yield joint
        link = joint.parent
