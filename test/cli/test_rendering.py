"""Messages of any shape are shown as YAML that says the same as their JSON."""

import json

import pytest
import rospy
import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseArray
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Empty, Float64MultiArray, Header, MultiArrayDimension, String
from visualization_msgs.msg import Marker, MarkerArray

import rosslt
from rosslt.cli.fields import field_of, joined
from rosslt.cli.rendering import LONGEST_ARRAY, json_line, yaml_lines
from rosslt.node import Heard


def tracked(value, number=0):
    return rosslt.track(value, rosslt.Source('/node', number))


MESSAGES = {
    'flat': Point(tracked(1.5), 2.0, -0.0),
    'text': String(tracked('a: "b" # c\n')),
    'empty': Empty(),
    'time': Header(stamp=rospy.Time(3, 4), frame_id='world'),
    'array of messages': PoseArray(poses=[Pose(position=Point(tracked(1.0), 0, 0)), Pose()]),
    'array in an array': MarkerArray([Marker(points=[Point(1, tracked(2.0), 3), Point()], lifetime=rospy.Duration(1))]),
    'tracked scalars': JointState(name=['a', tracked('b')], position=[0.5, tracked(0.25)], effort=[1.0, 2.0]),
    'bytes': Image(data=b'\x00\x01\xff', height=tracked(1)),
    'deep': DiagnosticArray(status=[DiagnosticStatus(values=[KeyValue('k', tracked('v')), KeyValue('l', 'w')])]),
    'layout': Float64MultiArray(data=[tracked(1.0)]),
    'arrays without provenance': Float64MultiArray(data=[1.0, 2.0]),
}
MESSAGES['layout'].layout.dim = [MultiArrayDimension('x', 1, 1)]


class NoDirectory:
    """Stands for nodes that report nothing."""

    def of(self, source):
        return None


def as_json(message, path=''):
    return json.loads(
        json_line(Heard('/topic', '/node', message._type, message), field_of(message, path), path, NoDirectory())
    )


@pytest.mark.parametrize('message', MESSAGES.values(), ids=list(MESSAGES))
def test_yaml_and_json_say_the_same(message):
    assert (yaml.safe_load('\n'.join(yaml_lines(message))) or {}) == as_json(message)['value']


@pytest.mark.parametrize('message', MESSAGES.values(), ids=list(MESSAGES))
def test_each_tracked_field_has_its_provenance_beside_it(message):
    commented = [line for line in yaml_lines(message) if '  # ' in line and '[/node#0]' in line]
    assert len(commented) == len(as_json(message)['provenance'])


def test_a_path_in_the_json_leads_to_the_field():
    message = MESSAGES['array in an array']
    (path,) = as_json(message)['provenance']
    assert path == 'markers[0].points[0].y'
    assert field_of(message, path) == 2.0
    assert field_of(message, 'markers[0]/points[0]/y') == 2.0
    assert list(as_json(message, 'markers[0]/points')['provenance']) == [path]
    assert joined('markers[0]/points', '[0].y') == path


def test_a_long_array_without_provenance_is_shortened_for_people_alone():
    message = Float64MultiArray(data=[0.5] * 1000)
    assert max(map(len, yaml_lines(message))) < LONGEST_ARRAY + 20
    assert len(as_json(message)['value']['data']) == 1000


def test_numbers_that_are_not_finite_are_text_in_json():
    assert as_json(Point(float('nan'), float('inf'), 0.0))['value'] == {'x': 'nan', 'y': 'inf', 'z': 0.0}
