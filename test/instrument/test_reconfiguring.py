"""A node with a dynamic_reconfigure server of its own: what its callback gets has the parameters as sources."""

import dynamic_reconfigure.msg
import dynamic_reconfigure.srv
import pytest
import rospy
from geometry_msgs.msg import PointStamped

import rosslt
from rosslt import node, values
from support.processes import wait_until
from support.shell import rosslt as command
from support.unmodified import Listener, Unmodified

RECONFIGURED = """
import types
import rospy
from dynamic_reconfigure.server import Server
from geometry_msgs.msg import PointStamped

def parameter(name, kind, default, low, high):
    return {'name': name, 'type': kind, 'level': 0, 'description': '', 'edit_method': '', 'default': default,
            'min': low, 'max': high}

def config_type():
    made = types.ModuleType('Config')
    parameters = [parameter('radius', 'double', 1.5, 0.0, 5.0), parameter('count', 'int', 3, 0, 9),
                  parameter('frame', 'str', 'map', '', '')]
    made.config_description = {'name': 'Default', 'type': '', 'state': True, 'cstate': 'true', 'id': 0, 'parent': 0,
                               'groups': [], 'parameters': parameters}
    made.min, made.max, made.defaults, made.level = (
        {one['name']: one[part] for one in parameters} for part in ('min', 'max', 'default', 'level'))
    made.all_level = 0
    return made

class Reconfigured:
    def __init__(self):
        self.server = Server(config_type(), self.reconfigure)
        self.pub = rospy.Publisher('reconfigured', PointStamped, queue_size=1)
    def reconfigure(self, config, level):
        print('reconfigured', level, flush=True)
        self.config, self.double = config, config.radius * 2
        return config
    def run(self):
        while not rospy.is_shutdown():
            p = PointStamped()
            p.header.frame_id = self.config.frame
            p.point.x, p.point.y, p.point.z = self.config['radius'], self.double, self.config.count * 1.0
            self.pub.publish(p)
            rospy.sleep(0.03)
rospy.init_node('reconfigured')
Reconfigured().run()
"""


def reconfigure(**doubles):
    request = dynamic_reconfigure.srv.ReconfigureRequest()
    request.config.doubles = [dynamic_reconfigure.msg.DoubleParameter(*one) for one in doubles.items()]
    answer = rospy.ServiceProxy('/reconfigured/set_parameters', dynamic_reconfigure.srv.Reconfigure)(request)
    return {one.name: one.value for one in answer.config.doubles}


def test_what_a_reconfigure_callback_gets_is_tracked_and_changed_either_way(master, tmp_path):
    started = Unmodified(tmp_path, 'reconfigured', RECONFIGURED.lstrip())
    with started, Listener('reconfigured', PointStamped) as heard:
        message = heard.comes(lambda message: values.is_tracked(message.point.x))
        assert (message.point.x, message.point.y, message.point.z) == (1.5, 3.0, 3.0)
        assert all(map(values.is_tracked, (message.point.y, message.point.z)))
        node.force_value(message.point.y, 4.0)
        heard.comes(lambda message: (message.point.x, message.point.y) == (2.0, 4.0))
        wait_until(lambda: reconfigure()['radius'] == 2.0, 'the server knows of it')
        assert reconfigure(radius=0.5) == {'radius': 0.5}
        message = heard.comes(lambda message: (message.point.x, message.point.y) == (0.5, 1.0))
        assert values.is_tracked(message.point.x)
        assert rospy.get_param('/reconfigured/radius') == 0.5
        assert reconfigure(radius=9.0) == {'radius': 5.0}  # what it may be at most
        with pytest.raises(rosslt.NotInvertible, match='maximum'):
            node.force_value(message.point.x, 6.0)
        heard.comes(lambda message: (message.point.x, message.point.y) == (5.0, 10.0))
        result = command('force', '/reconfigured/point/x', '1.25')
        assert (result.returncode, result.stderr) == (0, '')
        heard.comes(lambda message: (message.point.x, message.point.y, message.header.frame_id) == (1.25, 2.5, 'map'))
        wait_until(lambda: reconfigure()['radius'] == 1.25, 'the server knows of it')
        levels = started.stop()[1].splitlines()
        assert (levels[0], levels.count('reconfigured -1')) == ('reconfigured -1', 1)  # once at the start


def test_a_parameter_that_was_read_before_there_is_a_server_of_it_is_the_source_of_both(master, tmp_path):
    reads_first = "self.first = rospy.get_param('~radius', 1.5)\n        self.server ="
    code = RECONFIGURED.lstrip().replace('self.server =', reads_first).replace('self.config.count * 1.0', 'self.first')
    if rospy.has_param('/reconfigured'):  # what another test has set
        rospy.delete_param('/reconfigured')
    with Unmodified(tmp_path, 'reconfigured', code), Listener('reconfigured', PointStamped) as heard:
        message = heard.comes(lambda message: values.is_tracked(message.point.z))
        assert (message.point.x, message.point.z) == (1.5, 1.5)
        node.force_value(message.point.x, 4.0)
        heard.comes(lambda message: (message.point.x, message.point.z) == (4.0, 4.0))


def test_a_default_in_the_code_that_a_server_overrules_is_not_saved(master, tmp_path):
    reads_first = "self.first = rospy.get_param('~radius', 1.5)\n        self.server ="
    code = RECONFIGURED.lstrip().replace('self.server =', reads_first)
    if rospy.has_param('/reconfigured'):  # what another test has set
        rospy.delete_param('/reconfigured')
    with Unmodified(tmp_path, 'reconfigured', code) as started, Listener('reconfigured', PointStamped) as heard:
        node.force_value(heard.comes(lambda message: values.is_tracked(message.point.x)).point.x, 4.0)
        result = command('save', '/reconfigured')
        assert result.returncode == 1
        assert '~radius (this node starts from the default of its dynamic_reconfigure server' in result.stderr
        assert started.file.read_text(encoding='utf-8') == code


TIMED = """
import time
rospy.init_node('reconfigured')
start = time.monotonic()
Server(config_type(), lambda config, level: config)
print(time.monotonic() - start, flush=True)
"""


def test_a_server_of_many_numbers_is_there_at_once(master, tmp_path):
    code = RECONFIGURED.lstrip()
    many = "parameters = [parameter(f'p{number}', 'double', 1.5, 0.0, 5.0) for number in range(10)]"
    code = code.replace('    made.config_description', f'    {many}\n    made.config_description')
    code = code[: code.index('class Reconfigured')] + TIMED
    with Unmodified(tmp_path, 'reconfigured', code) as started:
        assert float(started.end()[1]) < 2.0
