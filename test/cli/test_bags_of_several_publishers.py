"""Bags of topics that several nodes publish, and of types that have the same fields: each message stays what it was."""

import json

import genpy
import pytest
import rosbag
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import Float64

from rosslt import Source, track
from support.filling import in_band
from support.shell import lines, rosslt

NO_MASTER = {'ROS_MASTER_URI': 'http://localhost:1'}


def test_rosbag_has_the_table_of_connections_that_is_set(tmp_path):
    with rosbag.Bag(str(tmp_path / 'empty.bag'), 'w') as bag:
        assert bag._topic_connections == {}, 'this rosbag has another one: cli/bags.py needs another way to say which'


def record(path, sent):
    """Write a bag of (topic, publisher, message), each on a connection of its own, as `rosbag record` does."""
    with rosbag.Bag(str(path), 'w') as bag:
        for second, (topic, publisher, message) in enumerate(sent, 1):
            header = {
                'topic': topic,
                'type': message._type,
                'md5sum': message._md5sum,
                'message_definition': message._full_text,
                'callerid': publisher,
            }
            bag._topic_connections.clear()  # else it would write on the connection of the topic's first message
            raw = message._type, in_band(message), message._md5sum, type(message)
            bag.write(topic, raw, genpy.Time(second), raw=True, connection_header=header)
    return str(path)


def told(path):
    with rosbag.Bag(path) as bag:
        return [
            (header['callerid'].decode(), raw[0], message)
            for (_, raw, _, header), (_, message, _) in zip(
                bag.read_messages(raw=True, return_connection_header=True), bag.read_messages()
            )
        ]


def located(value, node):
    return track(value, Source(node, 1))


@pytest.mark.parametrize('other', [Point(4.0, located(5.0, '/two'), 6.0), Float64(located(5.0, '/two'))])
def test_what_if_keeps_the_publisher_and_the_type_of_each_message(tmp_path, other):
    first = Point(located(1.0, '/one'), 2.0, 3.0)
    path = record(tmp_path / 'run.bag', [('/point', '/one', first), ('/point', '/two', other)] * 3)
    out = str(tmp_path / 'out.bag')
    assert lines('bag', path, '--set', '/one#1=7', '-o', out) == [['/point', '6', '3']]
    expected = [('/one', first._type, Point(7.0, 2.0, 3.0)), ('/two', other._type, other)] * 3
    assert [(publisher, type_, str(message)) for publisher, type_, message in told(out)] == [
        (publisher, type_, str(message)) for publisher, type_, message in expected
    ]


def test_types_of_the_same_fields_keep_their_names(tmp_path):
    sent = [('/point', '/one', Point(1.0, 2.0, 3.0)), ('/vector', '/one', Vector3(located(4.0, '/one'), 5.0, 6.0))]
    path = record(tmp_path / 'run.bag', sent)
    for topic, _, message in sent:
        printed = rosslt('echo', '--bag', path, '--json', topic, **NO_MASTER).stdout
        assert json.loads(printed)['type'] == message._type
