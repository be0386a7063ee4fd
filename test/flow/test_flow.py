"""The flow of provenance: through which nodes a location reaches which fields."""

from geometry_msgs.msg import Point

from rosslt import values
from rosslt.flow import Flow, ProvenanceMap

RADIUS, SHIFT = values.Source('/talker', 1), values.Source('/relay', 2)


def flow(subscribers):
    """`/talker` publishes its radius on `/gate`, and `/relay` publishes on `/pose` what it hears, and its shift."""
    found = ProvenanceMap()
    radius = values.track(2.0, RADIUS)
    found.add('/gate', '/talker', Point(radius, radius + 1, 0.0))
    found.add('/pose', '/relay', Point(radius + values.track(1.0, SHIFT), 0.0, 0.0))
    return Flow(found, subscribers)


def test_the_way_of_a_source_names_every_node_on_it():
    assert flow({'/gate': ['/relay'], '/pose': []}).paths(RADIUS) == [
        ('/gate', ['x', 'y'], ['/talker']),
        ('/pose', ['x'], ['/talker', '/relay']),
    ]


def test_a_node_that_heard_of_a_source_on_no_topic_is_told_and_said_to_be_unknown():
    steps = flow({}).steps(RADIUS)
    assert [(step.publisher, step.is_known) for step in steps] == [('/talker', True), ('/relay', False)]


def test_a_drawing_leads_through_the_nodes_that_publish_the_source_and_through_no_others():
    edges = flow({'/gate': ['/relay', '/listener'], '/pose': ['/talker']}).edges([RADIUS])
    assert edges == {
        (('location', RADIUS), ('node', '/talker')): [],
        (('node', '/talker'), ('topic', '/gate')): ['x', 'y'],
        (('topic', '/gate'), ('node', '/relay')): [],
        (('node', '/relay'), ('topic', '/pose')): ['x'],
        (('topic', '/pose'), ('node', '/talker')): [],
    }


def test_two_nodes_that_hear_each_other_are_told_once():
    paths = flow({'/gate': ['/relay'], '/pose': ['/talker']}).paths(RADIUS)
    assert [nodes for _, _, nodes in paths] == [['/talker'], ['/talker', '/relay']]
