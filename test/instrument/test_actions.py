"""A node that sends goals of an action again and again: what is in them is forced, as of any other topic."""

from move_base_msgs.msg import MoveBaseActionGoal

from rosslt import node
from support.unmodified import Listener, Unmodified

PATROL = """
import actionlib
import rospy
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

rospy.init_node('patroller')
waypoints = [[1.5, 2.5], [4.0, 3.5]]
client = actionlib.SimpleActionClient('patrolled', MoveBaseAction)
client.wait_for_server()
rate = rospy.Rate(5)
while not rospy.is_shutdown():
    for waypoint in waypoints:
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id = 'map'
        goal.target_pose.pose.position.x = waypoint[0]
        goal.target_pose.pose.position.y = waypoint[1]
        goal.target_pose.pose.orientation.w = 1.0
        client.send_goal(goal)
        client.wait_for_result()
        rate.sleep()
"""

#: An action takes some time. If it ended before `send_goal` has returned, actionlib's client would miss its end and
#: wait for ever, also under plain rospy: `simple_action_client.py` sets `gh` only then.
SERVER = """
import actionlib
import rospy
from move_base_msgs.msg import MoveBaseAction

def execute(_):
    rospy.sleep(0.1)
    server.set_succeeded()

rospy.init_node('patrolled_server')
server = actionlib.SimpleActionServer('patrolled', MoveBaseAction, execute, False)
server.start()
rospy.spin()
"""


def test_a_goal_that_is_sent_again_is_forced_although_its_id_is_another_one(master, tmp_path):
    with Unmodified(tmp_path, 'patrolled_server', SERVER, tracked=False), Unmodified(
        tmp_path, 'patroller', PATROL
    ), Listener('patrolled/goal', MoveBaseActionGoal) as goals:
        outcome = node.force_field('/patrolled/goal', 'goal.target_pose.pose.position.y', 2.75, timeout=30)
        assert outcome.is_reached
        (change,) = outcome.changes.values()
        assert change.new == 2.75
        other = {2.5: 3.5, 3.5: 2.5}[change.old]
        goals.comes(lambda message: message.goal.target_pose.pose.position.y == 2.75)
        goals.comes(lambda message: message.goal.target_pose.pose.position.y == other)
