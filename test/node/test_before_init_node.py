"""What holds for a node that reads locations and parameters, and makes publishers, before it calls `init_node`."""

import json

import pytest
import rosgraph

from support.processes import Node, wait_until

EARLY = """
    radius = rosslt.location(2.0, name='radius', maximum=9.0)
    diameter = 2 * radius
    goal = rosslt.location(Point(1.0, 2.0, 3.0), name='goal')
    speed = rosslt.get_param('/speed', 0.5)
    publisher = rosslt.Publisher('values', Float64, queue_size=1, latch=True)
    print(rosslt.explain(diameter), flush=True)
    rosslt.init_node('early')
    print(rosslt.explain(diameter), [str(source) for source in rosslt.sources(speed)], flush=True)
    total = diameter + rosslt.location(2.0, name='radius', maximum=9.0)
    print(len(rosslt.sources(total)), flush=True)
    publisher.publish(diameter)
    print(json.dumps(list(rosslt.force_value(diameter, 6.0).values())), flush=True)
    print(json.dumps(list(rosslt.force_value([speed, goal.x], [1.5, 7.0]).values())), flush=True)
    sys.stdin.readline()
    print(json.dumps(rosslt.untracked(rosslt.reevaluate([diameter, speed, goal.x]))), flush=True)
    rospy.spin()
    """

READER = """
    value = rosslt.wait_for_message('values', Float64, timeout=60.0).data
    print([source.node for source in rosslt.sources(value)], flush=True)
    print(json.dumps(list(rosslt.force_value(value, 8.0, timeout=5.0).values())), flush=True)
    rospy.spin()
    """


@pytest.mark.rostest
def test_what_was_read_before_init_node_is_the_nodes_from_then_on(master):
    with Node('early', EARLY, calls_init_node=True) as node:
        assert node.read_line() == '2 * 2.0 [radius, early.py:6:10]'
        line = node.read_line()
        assert 'radius, early.py:' in line
        assert "['/early#" in line
        assert node.read_line() == '1'
        assert json.loads(node.read_line()) == [[2.0, 3.0]]
        assert sorted(json.loads(node.read_line())) == [[0.5, 1.5], [1.0, 7.0]]
        with Node('reader', READER) as reader:
            assert reader.read_line() == "['/early']"
            assert json.loads(reader.read_line()) == [[3.0, 4.0]]
        parameters = rosgraph.Master('/test')
        wait_until(lambda: parameters.getParam('/early/rosslt/radius') == 4.0, 'the parameter follows')
        node.process.stdin.write('\n')
        node.process.stdin.flush()
        assert json.loads(node.read_line()) == [8.0, 1.5, 7.0]
