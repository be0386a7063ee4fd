"""`rosslt bag` and `rosslt echo --bag` read what rosbag recorded, with and without the nodes that published it."""

import json
import re

import pytest
import rosbag
from std_msgs.msg import String

from support.shell import failure, lines, on_terminal, record_bag, rosslt

pytestmark = pytest.mark.rostest

NO_MASTER = {'ROS_MASTER_URI': 'http://localhost:1'}


@pytest.fixture(scope='module', params=['', '--lz4'], ids=['plain', 'compressed'])
def bag(request, nodes, tmp_path_factory):
    """A bag of a few messages of /gate (in-band) and of /pose (of a tracked type)."""
    path = tmp_path_factory.mktemp('bags') / 'run.bag'
    record_bag(path, 5, *request.param.split(), '/gate', '/pose')
    return str(path)


def test_for_each_topic_it_says_which_sources_reach_which_fields(bag):
    held = lines('bag', bag)
    assert ['/gate', 'geometry_msgs/PoseStamped', '5', '5', '/talker/radius', 'pose.position.x,pose.position.y'] in held
    assert ['/pose', 'rosslt/PoseTracked', '5', '5', '/talker/~parking/0', 'position.y'] in held


def test_it_is_readable_on_a_terminal(bag):
    printed = on_terminal('bag', bag)
    assert '/gate  geometry_msgs/PoseStamped, 5 messages, 5 with provenance\n' in printed
    assert '  /talker/radius      -> pose.position.x y\n' in printed


def test_without_a_master_sources_have_their_ids(bag):
    result = rosslt('bag', bag, **NO_MASTER)
    assert result.returncode == 0
    sources = {line.split('\t')[4] for line in result.stdout.splitlines()}
    assert len(sources) == 5
    assert all(source.startswith('/talker#') for source in sources)


@pytest.fixture(scope='module')
def bag_with_names(nodes, tmp_path_factory):
    """A bag that also holds what /talker says of its locations."""
    folder = tmp_path_factory.mktemp('named')
    with rosbag.Bag(str(folder / 'run.bag'), 'w') as both:
        # each ends by itself when it has so many messages of its one topic
        for topic, count in (('/gate', 5), ('/talker/rosslt/locations', 1)):
            part = str(folder / 'part.bag')
            record_bag(part, count, topic)
            with rosbag.Bag(part) as recorded:
                for name, raw, stamp, header in recorded.read_messages(raw=True, return_connection_header=True):
                    both.write(name, raw, stamp, raw=True, connection_header=header)
    return str(folder / 'run.bag')


def test_a_bag_that_holds_the_names_is_explained_without_the_nodes(bag_with_names):
    result = rosslt('bag', bag_with_names, **NO_MASTER)
    sources = {line.split('\t')[4] for line in result.stdout.splitlines() if line.startswith('/gate')}
    assert {'/talker/radius', '/talker/frame', '/talker/~parking/0', '/talker//height'} <= sources
    printed = rosslt('echo', '--bag', bag_with_names, '--once', '/gate/pose/position/x', **NO_MASTER).stdout
    assert printed.startswith('pose.position.x\t7.0\t3 * 2.0 [radius, talker.py:')
    explained = rosslt('explain', '--bag', bag_with_names, '/gate/pose/position/x', **NO_MASTER).stdout.split('\t')
    assert explained[3:5] == ['/talker/radius', '2.0']
    assert re.fullmatch(r'/.*/talker\.py:\d+:\d+\n', explained[5])
    result = rosslt('echo', '--bag', bag_with_names, '--once', '--json', '/gate/pose/position/x', **NO_MASTER)
    assert result.stderr == ''
    described = json.loads(result.stdout)
    assert described['provenance']['pose.position.x']['sources'][0]['name'] == 'radius'


def test_echo_prints_recorded_messages_with_their_provenance(bag):
    printed = lines('echo', '--bag', bag, '-n', '2', '/gate/pose/position/x')
    assert len(printed) == 4
    assert printed[0][:2] == ['pose.position.x', '7.0']
    assert printed[0][2].startswith('3 * 2.0 [radius, talker.py:')
    result = rosslt('echo', '--bag', bag, '--once', '/pose/position/x', **NO_MASTER)
    assert result.stdout.startswith('position.x\t7.0\t3 * 2.0 [/talker#')


def test_a_topic_without_provenance_has_a_line_too(tmp_path):
    path = str(tmp_path / 'plain.bag')
    with rosbag.Bag(path, 'w') as written:
        written.write('/words', String('hello'))
    assert lines('bag', path) == [['/words', 'std_msgs/String', '1', '0', '', '']]
    assert '/words  std_msgs/String, 1 message, none with provenance' in on_terminal('bag', path)


def test_it_says_why_it_cannot_read(bag, tmp_path):
    assert (
        failure('bag', str(tmp_path / 'no.bag'))
        == f'rosslt bag: cannot read {tmp_path}/no.bag: No such file or directory'
    )
    (tmp_path / 'text.bag').write_text('hello', encoding='utf-8')
    assert 'does not appear to be a bag file' in failure('bag', str(tmp_path / 'text.bag'))
    assert (
        failure('echo', '--bag', bag, '/nothing') == 'rosslt echo: run.bag has no topic /nothing, it has /gate, /pose'
    )
    with open(bag, 'rb') as whole:
        (tmp_path / 'cut.bag').write_bytes(whole.read()[:2000])
    assert 'rosslt bag: ' in failure('bag', str(tmp_path / 'cut.bag'))


def test_a_bag_with_a_record_of_an_unknown_connection_is_called_unreadable(tmp_path):
    path = tmp_path / 'damaged.bag'
    with rosbag.Bag(str(path), 'w') as written:
        for _ in range(2):
            written.write('/words', String('hello'))
    held = path.read_bytes()
    # the numbers of connections are behind `conn=`; the index at the end stays right, what it leads to is not
    first = held.index(b'conn=', held.index(b'hello') - 60) + len(b'conn=')
    path.write_bytes(held[:first] + b'\x07' + held[first + 1 :])
    for arguments in (['bag', str(path)], ['echo', '--bag', str(path), '/words']):
        result = rosslt(*arguments, **NO_MASTER)
        assert (result.returncode, result.stdout) == (1, '')
        assert result.stderr.startswith(f'rosslt {arguments[0]}: cannot read {path}: ')
        assert 'Traceback' not in result.stderr


def test_an_empty_name_is_no_bag():
    assert failure('bag', '') == 'rosslt bag: found an empty name in the place of the bag'
