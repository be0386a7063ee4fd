"""Values as people type them."""

import os

import pytest
from geometry_msgs.msg import Pose, PoseArray

from rosslt.cli.failure import Failure
from rosslt.cli.fields import parse_scalar, path_where


def test_a_text_that_no_node_could_be_sent_is_refused():
    with pytest.raises(ValueError, match='is not UTF-8'):
        parse_scalar(os.fsdecode(b'caf\xe9'), 'str')
    assert parse_scalar('caf\xe9', 'str') == 'caf\xe9'


@pytest.mark.parametrize('text', ['inf', '-inf', 'nan', '1e999'])
def test_a_number_that_is_not_finite_is_refused(text):
    with pytest.raises(ValueError, match='is not finite'):
        parse_scalar(text, 'float')


@pytest.mark.parametrize(('text', 'found'), [('3', 'poses[1]'), ('3.0', 'poses[1]'), ('0.25', None), ('wide', None)])
def test_a_number_is_found_however_it_is_written(text, found):
    array = PoseArray(poses=[Pose(), Pose()])
    array.poses[1].position.x = 3.0
    path = path_where(array, 'poses/position', {'position/x': text})
    assert path == (found and found + '.position')


@pytest.mark.parametrize(('index', 'found'), [(1, 'poses[1].position'), (0, None)])
def test_an_element_with_an_index_has_to_meet_the_conditions(index, found):
    array = PoseArray(poses=[Pose(), Pose()])
    array.poses[1].position.x = 3.0
    assert path_where(array, f'poses[{index}]/position', {'position/x': '3'}) == found
    array.header.frame_id = 'map'
    assert path_where(array, f'poses[{index}]/position', {'header/frame_id': 'map'}) == f'poses[{index}].position'
    with pytest.raises(Failure, match="has no field 'child'"):
        path_where(array, f'poses[{index}]/position', {'child': 'base'})
