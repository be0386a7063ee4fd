"""`rosslt graph --prov` writes W3C PROV-JSON: read back with prov, the reference implementation in Python."""

import os

import pytest
from prov.graph import prov_to_graph
from prov.model import (
    ProvActivity,
    ProvAgent,
    ProvAssociation,
    ProvAttribution,
    ProvDerivation,
    ProvDocument,
    ProvEntity,
    ProvGeneration,
    ProvSpecialization,
    ProvUsage,
)

from support.processes import Node, wait_until
from support.shell import failure, lines, rosslt

pytestmark = pytest.mark.rostest

CHANGED = """
    rosslt.location(2.0, name='gain', minimum=0.5, maximum=10.0)
    rosslt.location('a', name='text')
    rospy.spin()
    """


def written(path, *options):
    """The document that the command writes, in which nothing contradicts anything else."""
    result = rosslt('graph', '--prov', str(path), *options)
    assert (result.returncode, result.stdout, result.stderr) == (0, '', '')
    document = ProvDocument.deserialize(str(path), format='json')
    document.unified()
    return document


def pairs(document, kind):
    """The two things that each relation of a kind is about."""
    return {tuple(str(value) for _, value in one.formal_attributes[:2]) for one in document.get_records(kind)}


def attributes(document, identifier):
    (record,) = document.get_record(identifier)
    return {str(name): value for name, value in record.attributes}


def test_locations_are_entities_of_their_nodes_and_fields_are_derived_from_them(nodes, tmp_path):
    document = written(tmp_path / 'graph.json')
    radius = attributes(document, 'location:/talker/radius')
    assert (radius['prov:value'], radius['rosslt:minimum'], radius['rosslt:maximum']) == (2.0, 0.5, 10.0)
    assert 'talker.py:' in radius['prov:location']
    # what is not published is a location, too
    assert attributes(document, 'location:/talker/is/on')['prov:value'] is True
    assert ('location:/talker/radius', 'node:/talker') in pairs(document, ProvAttribution)
    derived = pairs(document, ProvDerivation)
    assert ('field:/gate/pose.position.x', 'location:/talker/radius') in derived
    assert ('field:/pose/position.y', 'location:/talker/~parking/0') in derived
    assert ('field:/pose/position.y', 'node:/relay') in pairs(document, ProvAttribution)
    assert {str(agent.identifier) for agent in document.get_records(ProvAgent)} >= {'node:/talker', 'node:/relay'}


def test_changes_are_activities_that_used_one_value_and_generated_the_next(nodes, tmp_path):
    with Node('changed', CHANGED):
        wait_until(lambda: len(lines('list', '/changed')) == 2, 'both locations are there')
        for command in (
            ('set', '/changed/gain', '3.0'),
            ('set', '/changed/gain', '4.0'),
            ('undo', '/changed'),
            ('set', '/changed/text', 'b "c"'),
        ):
            assert rosslt(*command).returncode == 0, command
        document = written(tmp_path / 'changes.json', '--time', '0.1')
        values = {
            str(one.identifier): attributes(document, one.identifier)['prov:value']
            for one in document.get_records(ProvEntity)
            if str(one.identifier).startswith('value:/changed')
        }
        assert values == {
            'value:/changed/gain/1': 2.0,
            'value:/changed/gain/2': 3.0,
            'value:/changed/gain/3': 4.0,
            'value:/changed/text/1': 'a',
            'value:/changed/text/2': 'b "c"',
        }
        used = {entity: activity for activity, entity in pairs(document, ProvUsage)}
        made = dict(pairs(document, ProvGeneration))
        assert used['value:/changed/gain/1'] == made['value:/changed/gain/2']
        assert used['value:/changed/gain/2'] == made['value:/changed/gain/3']
        undone = {
            str(one.identifier): attributes(document, one.identifier)['rosslt:undone']
            for one in document.get_records(ProvActivity)
        }
        assert [undone[made[f'value:/changed/{name}']] for name in ('gain/2', 'gain/3', 'text/2')] == [
            False,
            True,
            False,
        ]
        assert ('value:/changed/gain/3', 'location:/changed/gain') in pairs(document, ProvSpecialization)
        assert ('value:/changed/gain/2', 'value:/changed/gain/1') in pairs(document, ProvDerivation)
        agents = {
            agent for activity, agent in pairs(document, ProvAssociation) if activity == made['value:/changed/gain/2']
        }
        assert 'node:/changed' in agents
        assert len(agents) == 2  # and who asked
        # a path leads from the value to the agents, in the graph that prov makes of it
        graph = prov_to_graph(document)
        names = {str(one.identifier): one for one in graph}
        assert names['node:/changed'] in graph[names[made['value:/changed/gain/2']]]
        assert attributes(document, 'location:/changed/gain')['prov:value'] == 3.0


def test_it_says_so_where_it_cannot_be_written(nodes, tmp_path):
    file = tmp_path / 'missing' / 'graph.json'
    assert (
        failure('graph', '--time', '0.1', '--prov', str(file))
        == f'rosslt graph: {file}: it cannot be written: No such file or directory'
    )


def test_it_says_so_where_prov_is_not_installed(nodes, tmp_path):
    (tmp_path / 'prov.py').write_text('raise ImportError("hidden")\n', encoding='utf-8')
    assert (
        failure('graph', '--time', '0.1', '--prov', '-', PYTHONPATH=f'{tmp_path}:{os.environ["PYTHONPATH"]}')
        == 'rosslt graph: found no Python package prov: install python3-prov'
    )
