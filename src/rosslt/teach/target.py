"""A target of a device of numbers: a location, or numbers of a topic, wherever they come from."""

import contextlib
import math
from typing import Any, Dict, List, Optional, Sequence

import rosgraph

from rosslt import messages, node, values
from rosslt.markers import NumbersHandle, Scene, robot_for
from rosslt.node import Heard
from rosslt.teach.devices import Joints, NotTaught, Numbers, is_number
from rosslt.teach.locations import LocationReader
from rosslt.teach.pairing import Field, NotYet, few, joint_names, no_joint, part_of


class Target:
    """Numbers that a device moves: one thing of a scene, made anew of each whole message.

    Of several publishers, it is about the first one whose message has the numbers, with sources.

    Args:
        scene: has the thing.
        field: has the numbers.
        device, topic: moves it, and sends on this topic.

    Attributes:
        name: of the thing.
        why: why there is none yet; '' if there is.
        left_out: what is to be said of joints that do not move.

    Raises:
        NotTaught: the node of a location does not tell its value.
    """

    def __init__(self, scene: Scene, field: Field, device: Numbers, topic: str) -> None:
        self._scene, self._field, self._device, self._topic = scene, field, device, topic
        self.name = field.name
        self.why, self.left_out = f'no message with provenance on {field.topic}', ''
        self._publisher = ''
        self._offered: Dict[str, List[str]] = {}  # the joints of the device, by who sends them
        self._joints: Sequence[Optional[node.Joint]] = ()
        self._reader = node.TopicReader(self._take, is_exact=True)
        self._location = LocationReader(field.place, self._take) if field.place is not None else None
        self.renew()
        types = dict(rosgraph.Master('/rosslt_teach').getPublishedTopics('/'))
        heard = {self._topic} if isinstance(device, Joints) else set()
        heard |= {field.topic} if field.place is None else set()
        self._reader.follow({one: types[one] for one in heard if one in types})

    def renew(self) -> None:
        """Ask for the value of a location: its node may have begun again since, with another one.

        Raises:
            NotTaught: there is no answer.
        """
        if self._location is not None:
            self._location.ask()

    def _take(self, heard: Heard) -> None:
        field = self._field
        if isinstance(self._device, Joints) and heard.topic == self._topic:
            self._offered[heard.publisher] = [str(values.untracked(name)) for name in heard.message.name]
        if heard.topic != field.topic or self._publisher not in ('', heard.publisher):
            return
        try:
            handle = self._handle(field, heard.message)
        except (NotTaught, ValueError) as error:
            self.why = str(error)
            return
        self._publisher, self.why = heard.publisher, ''
        self._scene.show(field.topic, handle, heard.publisher)

    def _handle(self, field: Field, message: messages.Message) -> NumbersHandle:
        part, type_, path = part_of(field, message)
        if field.topic == self._topic and messages.path_steps(path) == messages.path_steps(self._device.path):
            raise NotTaught(f'{field.name} is the device itself: each movement would move it on and on')
        if isinstance(self._device, Joints):
            numbers = self._of_joints(self._device, field, part, type_, joint_names(message, path))
        elif field.joint:
            numbers = [self._of_joint(field, part, joint_names(message, path))]
        elif is_number(part):
            numbers = [part]
        else:
            more = ': name a number of it' if field.place is None else ''
            raise NotTaught(f'{field.name} is a {type_}, and no number{more}')
        if not all(map(values.is_tracked, numbers)):
            raise NotYet(f'{field.name} has no source; `rosslt doctor {field.topic}` says why')
        if not all(math.isfinite(number) for number in numbers):
            raise NotYet(f'{field.name} is not finite')
        return NumbersHandle(self.name, numbers, self._joints)

    def _of_joint(self, field: Field, part: Sequence[Any], names: Sequence[str]) -> Any:
        """The position of the joint that is meant."""
        positions = dict(zip(names, part))
        if field.joint not in positions:
            raise NotYet(no_joint(field, list(positions)))
        if not self._joints:
            self._joints = [robot_for(field.topic).joints.get(field.joint)]
        return positions[field.joint]

    def _of_joints(self, device: Joints, field: Field, part: Any, type_: str, names: Sequence[str]) -> Sequence[Any]:
        """The numbers of the joints that the device moves; of the first message, those that both have."""
        if not names or not type_.endswith(']') or len(part) != len(names):
            raise NotTaught(f'{field.name} is a {type_}, and has no joints by name')
        found = {field.joint: self._of_joint(field, part, names)} if field.joint else dict(zip(names, part))
        if not device.names:
            if not self._offered:
                raise NotYet(f'no message on {self._topic}')
            offered = max(self._offered.values(), key=lambda one: len(set(one) & set(names)))
            both = [name for name in found if name in offered and device.may_move(name)]
            if not both:
                raise NotYet(
                    f'no joint of {field.name} ({few(list(found))}) is among those of {self._topic} ({few(offered)}): '
                    'name a joint in both alike'
                )
            # an array of plain numbers has no sources, and neither has a joint that its node only measures
            moved = [name for name in both if values.is_tracked(found[name])]
            if not moved:
                return [found[name] for name in both]
            robot = robot_for(field.topic)
            self._joints = [robot.joints.get(name) for name in moved]
            stay = [name for name in found if name not in moved]
            self.left_out = f'{few(stay)} of {field.name} stays' if stay else ''
            device.names = moved
        with contextlib.suppress(KeyError):
            return [found[name] for name in device.names]
        raise NotYet(f'{field.name} has no joint {few([name for name in device.names if name not in found])} any more')
