"""A process that has done its work leaves the ROS graph before it ends."""

import pytest
import rosgraph

from support.processes import Node

LEAVER = """
    import rosslt.node

    rosslt.location(2.0, name='radius')
    print('here', flush=True)
    sys.stdin.readline()
    rosslt.node.leave()
    print('left', rospy.is_shutdown(), flush=True)
    rosslt.node.leave()
    sys.stdin.readline()
    """


@pytest.mark.rostest
def test_the_master_has_forgotten_a_node_that_left_while_its_process_goes_on(master):
    parameters = rosgraph.Master('/test')
    with Node('leaver', LEAVER) as node:
        assert node.read_line() == 'here'
        assert parameters.lookupNode('/leaver')
        node.process.stdin.write('\n')
        node.process.stdin.flush()
        assert node.read_line() == 'left True'
        state = parameters.getSystemState()
        assert '/leaver' not in {name for part in state for _, nodes in part for name in nodes}
        node.process.stdin.write('\n')
        node.process.stdin.flush()
        assert node.process.wait(30) == 0
