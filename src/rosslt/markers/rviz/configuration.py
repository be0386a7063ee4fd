"""An RViz configuration with a display for every topic that can be dragged, and RViz itself, opened with it."""

import collections
import os
import subprocess
from typing import Any, Dict, List, NamedTuple, Sequence

import rosgraph
import rospkg
import rospy
import yaml
from std_msgs.msg import Bool, String

from rosslt.markers.faults import contained
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.topics import Watch

#: The period in which new topics are looked for, in seconds. RViz gets those that came once none has come for so long.
PERIOD = 1.0

SERVER = '/slt_visualization'
WORLD = 'world'


class DisplayKind(NamedTuple):
    """RViz's display for a type of message, and its name for the topic there."""

    display: str
    topic_property: str = 'Topic'


#: The displays of RViz for types that can be dragged.
DISPLAYS = {
    'geometry_msgs/PointStamped': DisplayKind('rviz/PointStamped'),
    'geometry_msgs/PolygonStamped': DisplayKind('rviz/Polygon'),
    'geometry_msgs/PoseArray': DisplayKind('rviz/PoseArray'),
    'geometry_msgs/PoseStamped': DisplayKind('rviz/Pose'),
    'nav_msgs/Path': DisplayKind('rviz/Path'),
    'visualization_msgs/Marker': DisplayKind('rviz/Marker', 'Marker Topic'),
    'visualization_msgs/MarkerArray': DisplayKind('rviz/MarkerArray', 'Marker Topic'),
}


def configuration(types: Dict[str, str], fixed_frame: str, has_robot: bool) -> Dict[str, Any]:
    """An RViz configuration.

    Args:
        types: {topic: type of its messages}, those to be shown.
        fixed_frame: RViz's fixed frame.
        has_robot: whether there is a robot_description.
    """
    displays = [
        _display('rviz/Grid', 'Grid', {'Color': '130; 130; 135', 'Alpha': 0.5}),
        _display('rviz/TF', 'Frames', {'Show Arrows': False}),
        *displays_of(types, has_robot),
        _display(
            'rviz/InteractiveMarkers',
            'Handles',
            {
                'Update Topic': SERVER + '/update',
                'Show Descriptions': False,
                'Show Axes': False,
                'Show Visual Aids': False,
            },
        ),
    ]
    return {
        'Panels': [{'Class': 'rviz/Displays', 'Name': 'Displays'}],
        'Visualization Manager': {
            'Class': '',
            'Name': 'root',
            'Displays': displays,
            'Global Options': {'Background Color': '48; 48; 48', 'Fixed Frame': fixed_frame, 'Frame Rate': 30},
            'Tools': [
                {'Class': 'rviz/Interact', 'Hide Inactive Objects': True},
                {'Class': 'rviz/MoveCamera'},
                {'Class': 'rviz/FocusCamera'},
            ],
            'Views': {'Current': {'Class': 'rviz/Orbit', 'Name': 'Current View', 'Target Frame': '<Fixed Frame>'}},
        },
        'Window Geometry': {'X': 60, 'Y': 60, 'Width': 1200, 'Height': 800},
    }


def displays_of(types: Dict[str, str], has_robot: bool) -> List[Dict[str, Any]]:
    """The displays of topics, {topic: type of its messages}, and of the robot."""
    displays = []
    if has_robot:
        displays.append(_display('rviz/RobotModel', 'Robot', {'Robot Description': 'robot_description'}))
    for topic, kind in sorted(types.items()):
        if kind in DISPLAYS:
            row = DISPLAYS[kind]
            displays.append(_display(row.display, topic, {row.topic_property: topic}))
    return displays


def open_rviz(arguments: Sequence[str] = ()) -> int:
    """Open RViz with all topics that can be dragged, and add those that come later; its exit status once it is closed.

    Args:
        arguments: handed on to RViz.
    """
    shown = Shown(rospy.get_param('~fixed_frame', ''))
    path = os.path.join(rospkg.get_ros_home(), 'rosslt.rviz')
    os.makedirs(os.path.dirname(path), exist_ok=True)
    _write(path, configuration({}, shown.frame, has_robot=False))
    name = '{}_rviz'.format(rospy.get_name())
    process = subprocess.Popen(['rviz', '-d', path, *arguments, '__name:=' + name.rpartition('/')[2]])
    try:
        while process.poll() is None and not rospy.is_shutdown():
            with contained('what has come cannot be added to RViz'):
                shown.add_to(name, path)
            rospy.rostime.wallsleep(PERIOD)
    finally:
        if process.poll() is None:
            process.terminate()
    return process.wait()


class Shown:
    """The topics that RViz shows, and those that it is to show next.

    Args:
        fixed_frame: RViz's fixed frame; by default the one that most topics use.

    Attributes:
        frame: RViz's fixed frame.
    """

    def __init__(self, fixed_frame: str = '') -> None:
        self._chosen_frame, self.frame = fixed_frame, fixed_frame or WORLD
        self._scene = Scene(Settings())
        Watch(self._scene)
        self._master = rosgraph.Master(rospy.get_name())
        self._types: Dict[str, str] = {}  # of the topics that RViz shows
        self._has_robot = False
        self._found: Dict[str, str] = {}  # {topic: frame} of all that can be dragged

    def add_to(self, rviz: str, path: str) -> None:
        """Add the displays of what has come to RViz, which keeps what a person has changed in it."""
        if not self._has_news():
            return
        try:
            _ask_rviz(rviz, 'save_config', path)
        except rospy.ServiceException:
            return  # it is still starting
        with open(path, encoding='utf-8') as file:
            present = yaml.safe_load(file)
        manager = present['Visualization Manager']
        before = self.frame
        manager['Displays'] += self._take_new()
        if manager['Global Options']['Fixed Frame'] == before:
            manager['Global Options']['Fixed Frame'] = self.frame
        _write(path, present)
        _ask_rviz(rviz, 'load_config_discarding_changes', path)
        rospy.loginfo('RViz shows %s', ', '.join(sorted(self._types)))

    def _has_news(self) -> bool:
        """Look what can be dragged; True where RViz lacks some of it, and nothing more has come since the last look."""
        found = self._scene.topics()
        is_quiet = found.keys() <= self._found.keys()
        self._found.update(found)
        has_new_robot = not self._has_robot and rospy.has_param('robot_description')
        return is_quiet and (has_new_robot or not self._found.keys() <= self._types.keys())

    def _take_new(self) -> List[Dict[str, Any]]:
        """The displays of what RViz does not show yet; the fixed frame is the one that most topics use."""
        types = dict(self._master.getTopicTypes())
        new = {topic: types.get(topic, '') for topic in self._found if topic not in self._types}
        self._types.update(new)
        had_robot, self._has_robot = self._has_robot, self._has_robot or rospy.has_param('robot_description')
        frames = collections.Counter(frame.lstrip('/') for frame in self._found.values())
        self.frame = self._chosen_frame or max(frames, key=lambda frame: frames[frame], default=WORLD)
        return displays_of(new, self._has_robot and not had_robot)


class SendFilePath:
    """The type of RViz's services, which Debian has for C++ only."""

    _type, _md5sum = 'rviz/SendFilePath', '*'
    _request_class, _response_class = String, Bool


def _ask_rviz(rviz: str, service: str, path: str) -> None:
    """Have RViz save its configuration in a file, or load it from there.

    Raises:
        rospy.ServiceException: it does not.
    """
    if not rospy.ServiceProxy('{}/{}'.format(rviz, service), SendFilePath)(path).data:
        raise rospy.ServiceException('RViz refuses {} of {}'.format(service, path))


def _write(path: str, made: Dict[str, Any]) -> None:
    with open(path, 'w', encoding='utf-8') as file:
        yaml.safe_dump(made, file, sort_keys=False)


def _display(kind: str, name: str, properties: Dict[str, Any]) -> Dict[str, Any]:
    return {'Class': kind, 'Name': name, **properties, 'Enabled': True, 'Value': True}
