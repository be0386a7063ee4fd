"""An RViz configuration with a display for every topic that can be dragged, and RViz itself, opened with it."""

import os
import subprocess
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import rosgraph
import rospkg
import rospy
import yaml
from std_msgs.msg import Bool, String

from rosslt import node
from rosslt.markers.faults import contained
from rosslt.markers.rviz.frames import FixedFrame
from rosslt.markers.rviz.robot import Robot
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.topics import Graph, Watch

#: The period in which new topics are looked for, in seconds. RViz gets those that came once none has come for so long.
PERIOD = 1.0

SERVER = '/slt_visualization'
WORLD = 'world'

#: The topic of a thing that is led in a dry run.
GHOST = '/slt_teach/ghost'


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
    'geometry_msgs/PoseWithCovarianceStamped': DisplayKind('rviz/PoseWithCovariance'),
    'nav_msgs/OccupancyGrid': DisplayKind('rviz/Map'),
    'nav_msgs/Odometry': DisplayKind('rviz/Odometry'),
    'nav_msgs/Path': DisplayKind('rviz/Path'),
    'visualization_msgs/Marker': DisplayKind('rviz/Marker', 'Marker Topic'),
    'visualization_msgs/MarkerArray': DisplayKind('rviz/MarkerArray', 'Marker Topic'),
}

#: The topics of the tools that RViz has until it has read its configuration.
OF_TOOLS = 'goal', 'initialpose'

#: The name of the display of the robot.
ROBOT = 'Robot'

_SUBJECTS = {
    **{kind.display: kind.topic_property for kind in DISPLAYS.values()},
    'rviz/RobotModel': 'Robot Description',
}


def configuration(types: Dict[str, str], fixed_frame: str, has_robot: bool) -> Dict[str, Any]:
    """An RViz configuration.

    Args:
        types: {topic: type of its messages}, those to be shown.
        fixed_frame: RViz's fixed frame.
        has_robot: whether a robot is to be shown.
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
        displays.append(_display('rviz/RobotModel', ROBOT, {'Robot Description': 'robot_description'}))
    for topic, kind in sorted(types.items()):
        if kind in DISPLAYS:
            row = DISPLAYS[kind]
            displays.append(_display(row.display, topic, {row.topic_property: topic}))
    return displays


def merged(present: List[Dict[str, Any]], wanted: List[Dict[str, Any]]) -> List[Dict[str, Any]]:
    """The displays of RViz with the wanted ones added, each once, and without those of topics that are gone.

    Args:
        present: as RViz has them; changes by a person stay, and so do displays that a person has added.
        wanted: as in `displays_of`.
    """
    missing = {_subject(display): display for display in wanted}
    kept = []
    for display in present:
        subject = _subject(display)
        if subject and display['Name'] in (subject[1], ROBOT) and subject not in missing:
            continue  # it is gone, or there already
        missing.pop(subject, None)
        kept.append(display)
    return [*kept, *missing.values()]


def _subject(display: Dict[str, Any]) -> Optional[Tuple[str, str]]:
    """(Class, topic or parameter) of a display; None if it shows neither a topic nor a parameter."""
    shown = display.get(_SUBJECTS.get(display['Class'], ''))
    return (display['Class'], shown) if shown else None


def open_rviz(arguments: Sequence[str] = ()) -> int:
    """Open RViz with all topics that can be dragged, as they come and go; its exit status once it is closed.

    Args:
        arguments: handed on to RViz.
    """
    shown = Shown(rospy.get_param('~fixed_frame', ''))
    path = os.path.join(rospkg.get_ros_home(), 'rosslt.rviz')
    os.makedirs(os.path.dirname(path), exist_ok=True)
    _write(path, configuration({}, shown.frame, has_robot=False))
    # of this process alone: a node of the same name that is about to end may have an RViz, too
    name = '{}_rviz_{}'.format(rospy.get_name(), os.getpid())
    process = subprocess.Popen(['rviz', '-d', path, *arguments, '__name:=' + name.rpartition('/')[2]])
    try:
        while process.poll() is None and not rospy.is_shutdown():
            with contained('RViz cannot be told what there is'):
                shown.update(name, path)
            rospy.rostime.wallsleep(PERIOD)
    finally:
        if process.poll() is None:
            process.terminate()
    return process.wait()


class Shown:
    """The displays that RViz has, and those that it is to get next.

    Args:
        fixed_frame: RViz's fixed frame; by default the root of most topics' frames.

    Attributes:
        frame: RViz's fixed frame.
    """

    def __init__(self, fixed_frame: str = '') -> None:
        self.frame = fixed_frame or WORLD
        scene, self._robot = Scene(Settings()), Robot()
        self._fixed = FixedFrame(scene, fixed_frame)
        # At present, at the last look, and as shown: {topic: type}, whether there is a robot, and the fixed frame.
        self._present: Tuple[Dict[str, str], bool, str] = {}, False, ''
        self._before = self._shown = self._present
        Watch(scene, also=[self._fixed.look, self._look])

    def _look(self, graph: Graph) -> None:
        _correct_types(graph, map(rospy.resolve_name, OF_TOOLS))
        has_robot = self._robot.is_there(graph.types, graph.publishers)
        shown = [*self._fixed.topics, *([GHOST] if GHOST in graph.types else [])]
        self._present = {topic: graph.types[topic] for topic in shown}, has_robot, self._fixed.name

    def update(self, rviz: str, path: str) -> None:
        """Have RViz show the present topics, once no more appear; changes that a person made in RViz are kept."""
        present, before = self._present, self._before
        self._before = present
        if present == self._shown or present != before:
            return
        try:
            _ask_rviz(rviz, 'save_config', path)
        except rospy.ServiceException:
            return  # it is still starting
        with open(path, encoding='utf-8') as file:
            saved = yaml.safe_load(file)
        manager = saved['Visualization Manager']
        manager['Displays'] = merged(manager['Displays'], displays_of(*present[:2]))
        frame = present[2] or self.frame
        if manager['Global Options']['Fixed Frame'] == self.frame:
            manager['Global Options']['Fixed Frame'] = frame
        self.frame = frame
        _write(path, saved)
        _ask_rviz(rviz, 'load_config_discarding_changes', path)
        self._shown = present
        rospy.loginfo('RViz shows %s', ', '.join(sorted(present[0])) or 'no topic')


def _correct_types(graph: Graph, topics: Iterable[str]) -> None:
    """Have the master know these topics by the types with which they are sent, for all who go by the master.

    It keeps what RViz has said of them for the tools that it begins with, although RViz has taken that back.
    """
    kept = {topic: graph.types[topic] for topic in topics if topic in graph.types}
    master, uri = rosgraph.Master(rospy.get_name()), rospy.get_node_uri()
    for topic, sent in node.sent_types(kept, graph.publishers).items():
        if sent != kept[topic]:
            master.registerPublisher(topic, sent, uri)
            master.unregisterPublisher(topic, uri)


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
