"""A process that has done its work leaves the ROS graph, before it ends or as it ends."""

import signal

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


@pytest.mark.rostest
def test_the_master_has_no_address_of_a_node_that_has_ended(master):
    code = """
        rospy.loginfo('a parameter of rospy says whether this names topics')
        rospy.get_param_cached('~gains/p', 1.0)
        rospy.get_param_cached('/robot', {})
        print(rosslt.get_param('~speed', 2.0), flush=True)
        rospy.spin()
        """
    parameters = rosgraph.Master('/test')
    parameters.setParam('/robot', {'arm': {'length': 1.0}})
    with Node('ender', code) as node:
        assert node.read_line() == '2.0'
        assert parameters.lookupNode('/ender') != parameters.lookupNode('/ender/rosslt')
        assert node.stop(signal.SIGINT) == 0
        for name in ('/ender', '/ender/rosslt'):
            with pytest.raises(rosgraph.MasterError, match='unknown node'):
                parameters.lookupNode(name)
