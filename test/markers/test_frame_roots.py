"""The root of most frames, in tf's own buffer."""

import pytest
import tf2_ros
from geometry_msgs.msg import TransformStamped

from rosslt.markers import most_common_root


@pytest.fixture
def buffer():
    made = tf2_ros.BufferCore()
    for parent, child in [('map', 'odom'), ('odom', 'base: 1'), ('world', 'camera'), ('a', 'b'), ('b', 'a')]:
        transform = TransformStamped()
        transform.header.frame_id, transform.child_frame_id = parent, child
        transform.transform.rotation.w = 1.0
        made.set_transform_static(transform, 'test')
    return made


@pytest.mark.parametrize(
    ('frames', 'root'),
    [
        (['base: 1'], 'map'),
        (['camera', 'base: 1', 'odom'], 'map'),
        (['camera', 'map'], 'map'),
        (['camera', 'camera', 'map'], 'world'),
        (['unknown', 'unknown', 'odom'], 'unknown'),
        ([], ''),
    ],
)
def test_the_root_of_most_frames(buffer, frames, root):
    assert most_common_root(buffer, frames) == root


def test_frames_that_hang_on_each_other_end_somewhere(buffer):
    assert most_common_root(buffer, ['a']) in ('a', 'b')
