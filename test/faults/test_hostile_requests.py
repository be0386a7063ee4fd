"""Hostile peers: requests that make no sense, and a node that floods the topic of changes."""

import pytest

from support.history_harness import location_id
from support.hostile_requests import play
from support.processes import Node, wait_until
from support.shell import lines, rosslt

FLOOD = """
    from rosslt.msg import SourceChange
    publisher = rospy.Publisher('/rosslt/source_change', SourceChange, queue_size=1000)
    location_id, number = int(sys.argv[1]), 0
    while not rospy.is_shutdown():
        number += 1
        node, value = (('/flooded', '1.5'), ('/flooded', '[1]'), ('/other', '1.5'), ('no name', ''))[number % 4]
        publisher.publish(node, location_id, value, '/flood')
        if number == 100:
            print('flooding', flush=True)
        if number % 50 == 0:
            time.sleep(0.01)  # some thousands a second, which leaves others a processor
    """


@pytest.mark.parametrize('seed', range(5))
def test_every_request_is_answered_or_refused_and_no_location_has_a_value_that_it_may_not_have(seed):
    answered, refused = play(seed, 1000)
    assert answered > 300
    assert refused > 30


@pytest.mark.slow
@pytest.mark.rostest
def test_a_node_that_floods_the_topic_of_changes_does_not_keep_others_from_changing(master):
    owner = "rosslt.location(1.0, name='x', maximum=1000.0)\nrosslt.location(1.0, name='y')\nrospy.spin()"
    with Node('flooded', owner):
        wait_until(lambda: len(lines('list', '/flooded')) == 2, 'both locations are there')
        with Node('flood', FLOOD, str(location_id('x')), wait_for=None) as flood:
            assert flood.read_line() == 'flooding'
            for number in range(3):
                changed = rosslt('set', '/flooded/y', str(number + 2))
                assert changed.returncode == 0, changed.stderr
                assert rosslt('get', '/flooded/y').stdout == f'{number + 2}.0\n'
            assert rosslt('get', '/flooded/x').stdout == '1.5\n'
