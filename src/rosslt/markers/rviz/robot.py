"""Decides whether RViz draws the robot of `robot_description`: without poses of its parts, it draws a white heap.

The parameter server keeps the description when the robot's nodes have ended.
"""

import collections
from typing import Any, Callable, Dict, FrozenSet, List, Set
from xml.etree import ElementTree

import rospy
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from rosslt import node, values


class Robot:
    """The joints and links of a robot that nodes send the poses of, on any of their topics."""

    def __init__(self) -> None:
        self._named: Dict[str, Set[str]] = collections.defaultdict(set)  # {node: joints and frames that it has named}
        self._reader = node.TopicReader(self._note)

    def is_there(self, types: Dict[str, str], publishers: Dict[str, List[str]]) -> bool:
        """Return whether a node publishes the joint states of the robot that is described, or transforms of its links.

        Args:
            types: {topic: its type}.
            publishers: {topic: the nodes that publish it}.
        """
        description = rospy.get_param('robot_description', '')
        if not description:
            return False
        naming = {topic: kind for topic, kind in types.items() if topic in publishers and kind in _NAMES_IN}
        self._reader.follow(naming)
        present = {name for topic in naming for name in publishers[topic]}
        return any(parts_of(description) & self._named[name] for name in present)

    def _note(self, heard: node.Heard) -> None:
        self._named[heard.publisher].update(map(values.untracked, _NAMES_IN[heard.type](heard.message)))


#: {type: the function that gives the names of the joints or the links that a message is about}.
_NAMES_IN: Dict[str, Callable[[Any], List[str]]] = {
    JointState._type: lambda state: state.name,
    TFMessage._type: lambda message: [transform.child_frame_id.lstrip('/') for transform in message.transforms],
}


def parts_of(urdf: str) -> FrozenSet[str]:
    """The names of a robot's joints, and of the links that they hold; none if the text is no URDF."""
    try:
        joints = list(ElementTree.fromstring(urdf).iter('joint'))
    except ElementTree.ParseError:
        return frozenset()
    held = [child.get('link', '') for joint in joints for child in joint.iter('child')]
    return frozenset(held + [joint.get('name', '') for joint in joints])
