"""An RViz configuration with a display for every topic that can be dragged, and RViz itself, opened with it."""

import collections
import os
import subprocess
import time
from typing import Any, Dict, List, NamedTuple, Sequence

import rosgraph
import rospkg
import rospy
import yaml

from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.topics import Watch

#: For how long no new topic may have come before RViz opens, in seconds.
QUIET = 1.5

SERVER = '/slt_visualization'
WORLD = 'world'


class DisplayKind(NamedTuple):
    """Which display RViz has for a type of message, and what it calls the topic."""

    display: str
    topic_property: str = 'Topic'


#: What RViz itself has displays for, among the types that can be dragged.
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
    ]
    if has_robot:
        displays.append(_display('rviz/RobotModel', 'Robot', {'Robot Description': 'robot_description'}))
    for topic, kind in sorted(types.items()):
        if kind in DISPLAYS:
            row = DISPLAYS[kind]
            displays.append(_display(row.display, topic, {row.topic_property: topic}))
    displays.append(
        _display(
            'rviz/InteractiveMarkers',
            'Handles',
            {
                'Update Topic': SERVER + '/update',
                'Show Descriptions': False,
                'Show Axes': False,
                'Show Visual Aids': False,
            },
        )
    )
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


def open_rviz(arguments: Sequence[str] = ()) -> int:
    """Look for topics that can be dragged, and open RViz with all of them; its exit status once it is closed.

    Args:
        arguments: handed on to RViz.

    Raises:
        ValueError: a private parameter has a value that it cannot have.
    """
    wait = rospy.get_param('~wait', 5.0)
    if isinstance(wait, bool) or not isinstance(wait, (int, float)) or wait < 0.0:
        raise ValueError('the parameter ~wait is {!r} instead of a number of seconds'.format(wait))
    scene = Scene(Settings())
    Watch(scene)
    frames = _found(scene, float(wait))
    types = dict(rosgraph.Master(rospy.get_name()).getTopicTypes())
    shown = {topic: types[topic] for topic in frames if topic in types}
    fixed_frame = rospy.get_param('~fixed_frame', '') or _most_common(list(frames.values()))
    text = yaml.safe_dump(configuration(shown, fixed_frame, rospy.has_param('robot_description')), sort_keys=False)
    path = os.path.join(rospkg.get_ros_home(), 'rosslt.rviz')
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, 'w', encoding='utf-8') as file:
        file.write(text)
    if shown:
        rospy.loginfo('RViz shows %s', ', '.join(sorted(shown)))
    else:
        rospy.logwarn('no topic with provenance was found within %g s: add what comes later in RViz itself', wait)
    return subprocess.call(['rviz', '-d', path, *arguments])


def _found(scene: Scene, wait: float) -> Dict[str, str]:
    """{topic: frame} of what can be dragged, once nothing new has come for a moment."""
    end, last_news = time.monotonic() + wait, time.monotonic()
    frames: Dict[str, str] = {}
    while time.monotonic() < end and not rospy.is_shutdown():
        found = scene.topics()
        if set(found) != set(frames):
            frames, last_news = found, time.monotonic()
        if frames and time.monotonic() - last_news > QUIET:
            break
        rospy.rostime.wallsleep(0.1)
    return frames


def _most_common(frames: List[str]) -> str:
    counted = collections.Counter(frame.lstrip('/') for frame in frames)
    return counted.most_common(1)[0][0] if counted else WORLD


def _display(kind: str, name: str, properties: Dict[str, Any]) -> Dict[str, Any]:
    return {'Class': kind, 'Name': name, **properties, 'Enabled': True, 'Value': True}
