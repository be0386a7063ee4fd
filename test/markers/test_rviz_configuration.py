"""The displays of rviz.launch, and how they come."""

from rosslt.markers.rviz.configuration import DISPLAYS, configuration, displays_of, merged
from rosslt.markers.rviz.robot import parts_of
from rosslt.markers.scene.by_type import KINDS
from rosslt.markers.scene.scene import MARKER_TYPES

#: Types that RViz has no display of their own for: frames and robots have one for all.
SHOWN_OTHERWISE = {'sensor_msgs/JointState', 'tf2_msgs/TFMessage'}


def displays(types, **options):
    made = configuration(types, options.get('fixed_frame', 'world'), options.get('has_robot', False))
    return {display['Name']: display for display in made['Visualization Manager']['Displays']}


def test_every_kind_of_message_that_can_be_dragged_is_shown():
    assert set(DISPLAYS) | SHOWN_OTHERWISE == {*MARKER_TYPES, *KINDS}


def test_each_topic_has_a_display_of_its_own_beside_frames_and_handles():
    found = displays({'/ball': 'visualization_msgs/Marker', '/waypoint': 'geometry_msgs/PoseStamped'})
    assert found['/ball']['Marker Topic'] == '/ball'
    assert found['/waypoint']['Topic'] == '/waypoint'
    assert found['Handles']['Update Topic'] == '/slt_visualization/update'
    assert 'Frames' in found
    assert 'Robot' not in found
    assert 'Robot' in displays({}, has_robot=True)


def shown(*names_and_topics):
    return [{'Class': 'rviz/Pose', 'Name': name, 'Topic': topic, 'Color': 'mine'} for name, topic in names_and_topics]


def test_each_topic_is_shown_once_and_what_a_person_has_changed_stays():
    present = shown(('/goal', '/goal'), ('/goal', '/goal'), ('my home', '/home'), ('my home, too', '/home'))
    wanted = displays_of({'/goal': 'geometry_msgs/PoseStamped', '/home': 'geometry_msgs/PoseStamped'}, has_robot=False)
    once = [present[0], present[2], present[3]]
    assert merged(present, wanted) == once
    assert merged(once, wanted) == once


def test_what_is_gone_goes_with_its_robot():
    types = {'/goal': 'geometry_msgs/PoseStamped', '/ball': 'visualization_msgs/Marker'}
    own = configuration(types, 'world', has_robot=True)['Visualization Manager']['Displays']
    left = configuration({'/ball': types['/ball']}, 'world', has_robot=False)['Visualization Manager']['Displays']
    added = shown(('my goal', '/goal'))
    assert merged(own + added, displays_of({'/ball': types['/ball']}, has_robot=False)) == left + added


def test_a_topic_of_another_type_has_another_display():
    (made,) = merged(shown(('/goal', '/goal')), displays_of({'/goal': 'nav_msgs/Path'}, has_robot=False))
    assert made['Class'] == 'rviz/Path'


def test_a_robot_is_known_by_its_joints_and_the_links_they_hold():
    arm = '<robot><link name="base"/><joint name="hip"><parent link="base"/><child link="leg"/></joint></robot>'
    assert parts_of(arm) == {'hip', 'leg'}
    assert parts_of('no robot') == set()
