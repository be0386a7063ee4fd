"""Single elements of 32 bits, in messages of an unmodified node: tracked, and forced to what 32 bits can hold."""

import struct

import pytest
from geometry_msgs.msg import Point32
from sensor_msgs.msg import LaserScan, PointCloud
from std_msgs.msg import Float32MultiArray

from rosslt import values
from support.shell import rosslt as command
from support.unmodified import Listener, Unmodified

SCANNER = """
import math
import numpy as np
import rospy
from geometry_msgs.msg import Point32
from sensor_msgs.msg import ChannelFloat32, LaserScan, PointCloud
from std_msgs.msg import Float32MultiArray

rospy.init_node('scanner')
scans = rospy.Publisher('scan', LaserScan, queue_size=1)
clouds = rospy.Publisher('cloud', PointCloud, queue_size=1)
cells = rospy.Publisher('cells', Float32MultiArray, queue_size=1)
wall = 2.3
near = 0.7
height = 0.4
voltage = 15.4
while not rospy.is_shutdown():
    scan = LaserScan(angle_min=-0.6, angle_increment=0.1, range_max=10.0)
    scan.ranges = [min(wall / math.cos(scan.angle_min + i * scan.angle_increment), scan.range_max) for i in range(13)]
    strength = np.full(13, 47.3, dtype=np.float32)
    strength[4] = near * 3
    scan.intensities = strength
    scans.publish(scan)
    cloud = PointCloud()
    cloud.points = [Point32(0.1 * i, wall, height) for i in range(3)]
    cloud.channels.append(ChannelFloat32('intensity', strength[3:6]))
    clouds.publish(cloud)
    each = np.array([voltage, near], dtype=np.float32)
    third = each[0] / np.float32(3)
    cells.publish(data=[each[0], third, np.float32(near) * np.float32(0.3), float(each[1]) + 1, each[1]])
    rospy.sleep(0.03)
"""


def single(number):
    """The number of 32 bits that is nearest to one of 64."""
    return struct.unpack('<f', struct.pack('<f', number))[0]


@pytest.fixture(scope='module')
def scanner(master, tmp_path_factory):
    with Unmodified(tmp_path_factory.mktemp('scanner'), 'scanner', SCANNER.lstrip()) as started:
        yield started


def test_the_messages_are_those_of_the_plain_node(master, tmp_path):
    seen = []
    for tracked in (False, True):
        started = Unmodified(tmp_path, 'scanner', SCANNER.lstrip(), tracked=tracked)
        with started, Listener('scan', LaserScan) as scans, Listener('cells', Float32MultiArray) as cells:
            seen.append((values.untracked(list(scans.last.ranges)), values.untracked(list(cells.last.data))))
    assert seen[0] == seen[1]


def test_elements_of_32_bits_are_tracked(scanner):
    with Listener('scan', LaserScan) as heard:
        assert all(map(values.is_tracked, heard.last.ranges))
        assert all(map(values.is_tracked, heard.last.intensities))
    with Listener('cloud', PointCloud) as heard:
        assert values.is_tracked(heard.last.points[2].y)
        assert all(map(values.is_tracked, heard.last.channels[0].values))
    with Listener('cells', Float32MultiArray) as heard:
        assert all(map(values.is_tracked, heard.last.data))


@pytest.mark.parametrize(
    ('field', 'target', 'kind', 'read'),
    [
        ('scan/ranges[3]', 0.7, LaserScan, lambda message: message.ranges[3]),
        ('scan/ranges[6]', 1.1, LaserScan, lambda message: message.ranges[6]),
        ('scan/intensities[4]', 3.3, LaserScan, lambda message: message.intensities[4]),
        ('scan/intensities[5]', 0.1, LaserScan, lambda message: message.intensities[5]),
        ('cloud/points[1].y', -0.3, PointCloud, lambda message: message.points[1].y),
        ('cloud/channels[0].values[1]', 12.7, PointCloud, lambda message: message.channels[0].values[1]),
        ('cells/data[0]', 16.1, Float32MultiArray, lambda message: message.data[0]),
        ('cells/data[1]', 4.9, Float32MultiArray, lambda message: message.data[1]),
        ('cells/data[2]', 0.33, Float32MultiArray, lambda message: message.data[2]),
        ('cells/data[3]', 2.2, Float32MultiArray, lambda message: message.data[3]),
        ('cells/data[4]', 123456.789, Float32MultiArray, lambda message: message.data[4]),
    ],
)
def test_an_element_is_forced_to_its_target_rounded_to_32_bits(scanner, field, target, kind, read):
    with Listener(field.split('/')[0], kind) as heard:
        for wanted in (target, target * 1.7):
            result = command('force', '/' + field, repr(wanted))
            assert (result.returncode, result.stderr) == (0, '')
            # within one step of the numbers of 32 bits there
            heard.comes(lambda message, wanted=wanted: abs(read(message) - single(wanted)) <= 2.0**-23 * abs(wanted))


def test_a_target_between_two_numbers_of_32_bits_is_not_reached(scanner):
    assert command('set', '/scanner/near', '0.7').returncode == 0
    result = command('force', '/cells/data[3]', '1e-7')
    assert result.returncode == 1
    assert 'now sends 1.1920928955078125e-07 instead of 1e-07' in result.stderr


def test_a_part_of_several_elements_is_forced_together(scanner):
    with Listener('cloud', PointCloud) as heard:
        result = command('force', '/cloud/points[1]', '{x: 0.9, y: 1.3, z: 0.7}')
        assert (result.returncode, result.stderr) == (0, '')
        heard.comes(lambda message: message.points[1] == Point32(*map(single, (0.9, 1.3, 0.7))))
