"""`rosslt graph` shows how provenance flows, through nodes that do not own it too."""

import os
import re
from xml.etree import ElementTree

import pytest

from support.shell import failure, lines, on_terminal, rosslt

pytestmark = pytest.mark.rostest


def test_each_location_has_the_fields_that_it_reaches_and_the_nodes_on_the_way(nodes):
    flow = lines('graph', '/gate', '/pose')
    assert ['/talker/radius', '/gate', 'pose.position.x,pose.position.y', '/talker'] in flow
    assert ['/talker/radius', '/pose', 'position.x,position.y', '/talker,/relay'] in flow
    assert ['/talker/~parking/0', '/pose', 'position.y', '/talker,/relay'] in flow
    assert ['/talker/frame', '/gate', 'header.frame_id', '/talker'] in flow
    # what is not published reaches nothing
    assert {line[0] for line in flow} == {
        '/talker/radius',
        '/talker/~parking/0',
        '/talker//height',
        '/talker/frame',
        '/talker/fixed',
    }


def test_it_is_a_tree_on_a_terminal(nodes):
    printed = on_terminal('graph')
    assert re.search(
        r'^/talker/radius  \[talker\.py:\d+:\d+\]\n'
        r'  /talker -> /gate: pose\.position\.x y\n'
        r'    /relay -> /pose: position\.x y$',
        printed,
        re.MULTILINE,
    )


def test_the_drawing_leads_from_the_location_through_the_nodes_to_the_topics(nodes):
    dot = rosslt('graph', '--dot').stdout
    names = {label: name for name, label in re.findall(r'^  (\w+) \[.*label="([^"\\]*)', dot, re.MULTILINE)}
    for start, end in (('radius', '/talker'), ('/talker', '/gate'), ('/gate', '/relay'), ('/relay', '/pose')):
        assert f'\n  {names[start]} -> {names[end]}' in dot


def test_graphviz_draws_it(nodes):
    drawing = ElementTree.fromstring(rosslt('graph', '--svg').stdout)
    texts = {text.text for text in drawing.iter('{http://www.w3.org/2000/svg}text')}
    assert {'/talker', '/relay', '/gate', '/pose', 'radius', 'position.x y z'} <= texts


def test_it_says_so_where_no_provenance_passes(nodes):
    assert failure('graph', '/rosout', '--time', '0.2') == 'rosslt graph: no message with provenance within 0.2 s'
    assert failure('graph', '/nothing') == 'rosslt graph: nobody publishes /nothing'


def test_it_says_so_where_graphviz_is_not_there(nodes, tmp_path):
    for name in ('rosslt', 'python3', 'env'):
        found = next(
            os.path.join(folder, name)
            for folder in os.environ['PATH'].split(':')
            if os.path.exists(os.path.join(folder, name))
        )
        (tmp_path / name).symlink_to(found)
    assert (
        failure('graph', '--svg', '/gate', '--time', '0.5', PATH=str(tmp_path))
        == 'rosslt graph: found no command dot: install graphviz'
    )
