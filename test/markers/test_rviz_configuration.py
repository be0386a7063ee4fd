"""The displays of rviz.launch, and how they come."""

from rosslt.markers.rviz.configuration import DISPLAYS, configuration
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
