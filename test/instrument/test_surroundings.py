"""What a node asks of the ROS around it, parameters and frames, is what it is without provenance."""

import pytest
import rospy
from geometry_msgs.msg import PointStamped
from std_msgs.msg import Float64

from rosslt import node, values
from support.unmodified import Listener, Unmodified

PARAMETERS = """
import rospy
rospy.init_node('asks')
def say(function):
    try:
        print(function())
    except Exception as error:
        print(type(error).__name__, error)
for i in range(2):
    rospy.set_param('~gain', 1.5 + i)
    rospy.set_param('~tree', {'a': 1 + i, 'b': [1, 2 * i]})
    say(lambda: rospy.get_param('~gain'))
    say(lambda: rospy.get_param('~tree'))
    say(lambda: rospy.get_param('~tree/b')[1] + rospy.get_param('~tree/a'))
    say(lambda: sorted(rospy.get_param('~')))
    rospy.set_param('~tree/a', 7.5)
    say(lambda: (rospy.get_param('~tree'), rospy.get_param('~tree/a')))
    rospy.delete_param('~gain')
    say(lambda: rospy.get_param('~gain', 'gone'))
    say(lambda: rospy.get_param('~gain', 5))
    say(lambda: rospy.get_param('~gain'))
    rospy.delete_param('~tree')
    say(lambda: rospy.get_param('~tree/a', 'gone'))
    for default in (None, 1.5, 2, [1, 2.5], 'text', {}):
        say(lambda: rospy.get_param('~never', default))
    say(lambda: rospy.get_param('~never'))
    say(lambda: rospy.delete_param('~never'))
"""

DEFAULTS = """
import rospy
from std_msgs.msg import Float64
rospy.init_node('defaults')
first, second = rospy.Publisher('first', Float64, queue_size=1), rospy.Publisher('second', Float64, queue_size=1)
while not rospy.is_shutdown():
    first.publish(rospy.get_param('~height', 1.5))
    second.publish(rospy.get_param('~height', 4.0))
    rospy.sleep(0.02)
"""

EARLY = """
import rospy
from geometry_msgs.msg import PointStamped
speed, places = rospy.get_param('/early/speed'), rospy.get_param('/early/places')
print(speed, places, type(speed) is float, rospy.get_param('/early/never', 'unset'))
rospy.init_node('early')
pub = rospy.Publisher('early', PointStamped, queue_size=1)
p = PointStamped()
p.header.frame_id = rospy.get_param('/early/frame')
while not rospy.is_shutdown():
    p.point.x, p.point.y, p.point.z = speed * 2, places['b'][1], places['a']
    pub.publish(p)
    rospy.sleep(0.02)
"""

FAILING = """
import math, rospy, threading
from geometry_msgs.msg import Pose
from std_msgs.msg import Float64
rospy.init_node('failing')
rospy.init_node('failing')  # rospy takes it a second time
speed = 1.5
def work():
    math.sqrt(speed - 2)
worker = threading.Thread(target=work, name='worker')
worker.start()
worker.join()
rospy.Publisher('nobody', Float64, queue_size=1).publish(Float64)  # rospy looks at what it sends to somebody
pose = Pose()
pose.position = (speed, 2.0, 3.0)
rospy.Publisher('no_pose', Pose, queue_size=1).publish(pose)
print('sent', flush=True)
"""

OPTIONS = """
import actionlib, os, rospy, sys, threading
from move_base_msgs.msg import MoveBaseAction, MoveBaseResult
from std_msgs.msg import Float64
rospy.init_node('options')
n, hz = rospy.get_param('~n', 4), rospy.get_param('~hz', 50.0)
heard = threading.Event()
pub = rospy.Publisher('~a', Float64, queue_size=n, latch=rospy.get_param('~latch', True))
sub = rospy.Subscriber('~a', Float64, lambda message: heard.set(), queue_size=n, buff_size=n * 1024)
other = rospy.Publisher('~b', Float64, None, False, False, None, n)
rate = rospy.Rate(hz)
timer = rospy.Timer(rospy.Duration(1 / hz), lambda event: pub.publish(hz))
rate.sleep()
rospy.sleep(1 / hz)
rospy.sleep(rospy.Duration(0, n))
server = actionlib.SimpleActionServer('drive', MoveBaseAction, lambda goal: server.set_succeeded(), False)
server.start()
client = actionlib.SimpleActionClient('drive', MoveBaseAction)
print(client.wait_for_server(rospy.Duration(n * 15)), heard.wait(n * 15), rospy.Time(n), rospy.Duration(hz))
rospy.wait_for_service('~get_loggers', n * 15)
timer.shutdown()
sys.stdout.flush()
os._exit(0)  # the server's thread does not end
"""

#: Parameters become dicts, and dicts become parameters.
SHAPES = """
import rospy
rospy.init_node('shapes')
while rospy.get_param('~goal', None) is None:
    rospy.set_param('~goal', {'x': 1.5, 'y': 2.5})
print(rospy.get_param('~goal/x'), sorted(rospy.get_param('~goal').items()))
rospy.set_param('~m', {'y': 1.5})
print(rospy.get_param('~m/y'))
rospy.set_param('~m', 4.5)
print(rospy.get_param('~m'), rospy.get_param('~m/y', 2.5))
rospy.set_param('~m', {'y': {'z': 3.5}})
print(rospy.get_param('~m/y'), rospy.get_param('~m'))
rospy.set_param('~m/y', 0.5)
print(rospy.get_param('~m'), rospy.get_param('~m/y'))
for value in ([3.5], {'a': 1.5}, [4.5, {'b': 2}], {'a': {'b': 2.5}}, 'word', {'a': 3.5}):
    rospy.set_param('~k', value)
    print(rospy.get_param('~k'))
rospy.set_param('~n', 2.5)
for _ in range(2):
    print(rospy.get_param('~n'), rospy.get_param('~n/y', 1.5), rospy.get_param('~n/y', {'z': 0.5}))
print(rospy.get_param('~unset/y', 1.5), rospy.get_param('~unset', 2.5), rospy.get_param('~unset/y', 1.5))
"""

#: Reads its own namespace, and all that there is, once its literal has been changed.
OWN = """
import rospy
from geometry_msgs.msg import PointStamped
rospy.init_node('own')
pub = rospy.Publisher('own', PointStamped, queue_size=1)
def gain():
    return 0.5
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x = gain()
    if p.point.x == 0.75:
        p.header.frame_id = f"{rospy.get_param('~')} {rospy.get_param('/')['own']}"
    pub.publish(p)
    rospy.sleep(0.03)
"""

LISTENING = """
import rospy, tf
from geometry_msgs.msg import PointStamped
rospy.init_node('listening')
broadcaster, listener = tf.TransformBroadcaster(), tf.TransformListener()
looked, moved = (rospy.Publisher(name, PointStamped, queue_size=1) for name in ('looked', 'moved'))
point = PointStamped()
point.header.frame_id = 'camera'
point.point.x = 0.25
while not rospy.is_shutdown():
    broadcaster.sendTransform((1.5, 0, 2), (0, 0, 0, 1), rospy.Time.now(), 'camera', 'map')
    try:
        (trans, rot) = listener.lookupTransform('/map', '/camera', rospy.Time(0))
    except (tf.LookupException, tf.ConnectivityException, tf.ExtrapolationException):
        rospy.sleep(0.02)
        continue
    found = PointStamped()
    found.point.x, found.point.y, found.point.z = trans
    looked.publish(found)
    moved.publish(listener.transformPoint('map', point))
    rospy.sleep(0.02)
"""


@pytest.mark.parametrize(('name', 'code'), [('asks', PARAMETERS), ('shapes', SHAPES), ('options', OPTIONS)])
def test_parameters_say_what_they_say_without_provenance(master, tmp_path, name, code):
    plain = Unmodified(tmp_path, name, code, tracked=False).end()
    assert plain[0] == 0
    if rospy.has_param('/' + name):
        rospy.delete_param('/' + name)
    assert Unmodified(tmp_path, name, code).end() == plain


def test_each_call_has_its_own_default_until_the_parameter_is_set(master, tmp_path):
    with Unmodified(tmp_path, 'defaults', DEFAULTS), Listener('first', Float64) as first, Listener(
        'second', Float64
    ) as second:
        assert (first.next().data, second.next().data) == (1.5, 4.0)
        node.force_value(first.next().data, 2.5)
        first.comes(lambda message: message.data == 2.5)
        second.comes(lambda message: message.data == 2.5)


def test_what_is_kept_for_changed_literals_is_not_in_what_a_node_reads_of_its_own_namespace(master, tmp_path):
    rospy.set_param('/own', {'speed': 1.5})
    with Unmodified(tmp_path, 'own', OWN), Listener('own', PointStamped) as heard:
        node.force_value(heard.comes(lambda message: values.is_tracked(message.point.x)).point.x, 0.75)
        assert heard.comes(lambda message: message.header.frame_id).header.frame_id == "{'speed': 1.5} {'speed': 1.5}"


def test_the_listener_of_tf_keeps_provenance(master, tmp_path):
    with Unmodified(tmp_path, 'listening', LISTENING), Listener('looked', PointStamped) as looked, Listener(
        'moved', PointStamped
    ) as moved:
        assert looked.next().point.x == 1.5
        x = moved.comes(lambda message: values.is_tracked(message.point.x)).point.x
        assert x == 1.75
        node.force_value(looked.comes(lambda message: values.is_tracked(message.point.x)).point.x, 3.5)
        looked.comes(lambda message: message.point.x == pytest.approx(3.5))
        moved.comes(lambda message: message.point.x == pytest.approx(3.75))


def test_parameters_that_are_read_before_there_is_a_node_are_sources_of_it(master, tmp_path):
    rospy.set_param('/early', {'speed': 0.5, 'places': {'a': 3, 'b': [1.0, 2.5]}, 'frame': 'map'})
    with Unmodified(tmp_path, 'early', EARLY) as started, Listener('early', PointStamped) as heard:
        point = heard.comes(lambda message: values.is_tracked(message.point.x)).point
        assert (point.x, point.y, point.z) == (1.0, 2.5, 3.0)
        for path, value in (('x', 2.0), ('y', -1.25), ('z', 4.5)):
            node.force_value(getattr(heard.last.point, path), value)
            heard.comes(lambda message: getattr(message.point, path) == value)  # noqa: B023
        assert rospy.get_param('/early/speed') == 1.0
        assert rospy.get_param('/early/places') == {'a': 4.5, 'b': [1.0, -1.25]}
        assert started.stop()[1].split('\n')[0] == "0.5 {'a': 3, 'b': [1.0, 2.5]} True unset"


def test_what_fails_in_a_thread_and_what_is_no_message_are_told_as_without_it(master, tmp_path):
    said = {tracked: Unmodified(tmp_path, 'failing', FAILING, tracked=tracked).end() for tracked in (False, True)}
    assert said[True] == said[False]
    code, output, errors = said[True]
    assert (code, output) == (0, 'sent\n')
    assert 'Exception in thread worker' in errors
    assert 'math.sqrt(speed - 2)' in errors
