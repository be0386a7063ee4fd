"""`rosslt doctor` says at which lines a node makes plain numbers of those with provenance."""

import re

import pytest
import rospy
from geometry_msgs.msg import Point, TwistStamped
from rosslt.srv import FindLosses
from std_msgs.msg import Float64, Float64MultiArray, String

import rosslt
from rosslt import values
from rosslt.instrument.losses import LOSSES
from support.processes import wait_until
from support.programs import run_rewritten
from support.shell import rosslt as command
from support.unmodified import Listener, Unmodified

SWALLOWING = """
import numpy as np
import rospy
from std_msgs.msg import Float64MultiArray

rospy.init_node('swallowing')
kept = rospy.Publisher('kept', Float64MultiArray, queue_size=1)
lost = rospy.Publisher('lost', Float64MultiArray, queue_size=1)
some = rospy.Publisher('some', Float64MultiArray, queue_size=1)
radius = 2.5
once = np.frombuffer(bytes(16)).copy()
once[0] = radius  # at the start
while not rospy.is_shutdown():
    a = np.frombuffer(bytes(16)).copy()
    a[1] = radius * 2  # in each round
    kept.publish(data=[radius, 3.5])
    lost.publish(data=[once[0], a[1]])
    some.publish(data=[radius, a[1]])
    rospy.sleep(0.03)
"""


def findings(topic):
    result = command('doctor', topic, '--time', '1')
    assert result.stderr == ''
    return {tuple(line.split('\t')[2:]) for line in result.stdout.splitlines()}


def line_of(comment):
    lines = SWALLOWING.lstrip().split('\n')
    (number,) = (number for number, line in enumerate(lines, 1) if line.endswith('# ' + comment))
    return f'swallowing.py:{number}: {lines[number - 1].strip()}'


def test_the_doctor_says_at_which_lines_provenance_is_lost(master, tmp_path):
    with Unmodified(tmp_path, 'swallowing', SWALLOWING.lstrip()), Listener('some', Float64MultiArray):
        comments = 'at the start', 'in each round'
        places = '/swallowing makes plain numbers of tracked ones at ' + '; '.join(map(line_of, comments))
        assert findings('/lost') == {('fault', '/lost is plain: ' + places)}
        assert ('note', places) in findings('/some')
        assert not [text for _, text in findings('/kept') if 'plain numbers' in text]


@pytest.mark.parametrize(
    ('lines', 'is_lost'),
    [
        ('a = np.frombuffer(bytes(16)).copy(); a[0] = x', True),
        ('a = np.zeros(2000); a[3] = x', False),
        ('a = np.zeros(3); a[0] = x; a[1:] = x; b = a * 2', False),
        ('a = np.fft.fft(np.array([x, 1.0]))', True),
        ('a = list(map(float, [x]))', True),
        ('a = float(x) + sum([x, x]) + max(x, 1.0)', False),
        ("a = '%.2f of %d' % (x, x), '{:.3f}'.format(x), f'{x:g}', str(x)", False),
        ('a = math.sin(x), random.uniform(0.0, x), rospy.Duration(x), copy.deepcopy([x])', False),
        ('time.sleep(x * 1e-9); a = json.dumps([x]); b = range(int(x)); c = [1, 2, 3][int(x)]', False),
    ],
)
def test_what_makes_a_plain_number_of_a_tracked_one_is_seen(lines, is_lost):
    before = set(LOSSES.places())
    LOSSES.begin()
    try:
        text = 'import copy, json, math, random, time\nimport numpy as np\nimport rospy\nx = 2.5\n'
        run_rewritten(text + lines.replace('; ', '\n') + '\n', '/nowhere/' + re.sub(r'\W', '_', lines) + '.py')
    finally:
        LOSSES.end()
    assert bool(set(LOSSES.places()) - before) == is_lost


def test_numbers_have_no_method_of_their_own_while_nobody_looks():
    number = rosslt.track(2.5, rosslt.Source('/node', 1))
    kind = type(number)
    assert '__float__' not in vars(kind)
    LOSSES.begin()
    LOSSES.begin()
    LOSSES.end()
    assert float(number) == 2.5
    assert type(float(number)) is float
    assert '__float__' in vars(kind)
    LOSSES.end()
    assert '__float__' not in vars(kind)


DEAD_ZONE = """
import rospy
from std_msgs.msg import Float64
rospy.init_node('zone')
pub = rospy.Publisher('speed', Float64, queue_size=1)
while not rospy.is_shutdown():
    gain = 0.5
    error = rospy.get_time() if rospy.has_param('/is_far') else 0.0
    command = Float64(float('0.25'))
    if abs(error) >= 0.1:
        command.data = gain * error
    pub.publish(command)  # here
    rospy.sleep(0.02)
"""


def test_the_doctor_says_that_a_branch_sends_constants(master, tmp_path):
    constants = (
        '/speed is plain: /zone sends the same values in each message without sources '
        'at zone.py:11: pub.publish(command)  # here. '
    )
    with Unmodified(tmp_path, 'zone', DEAD_ZONE.lstrip()), Listener('speed', Float64) as heard:
        ((kind, said),) = findings('/speed')
        assert (kind, said.startswith(constants + 'Constants, text that is made of numbers, ')) == ('fault', True), said
        assert said.endswith('; another branch of its code may compute them from a location')
        rospy.set_param('/is_far', True)
        heard.comes(lambda message: values.is_tracked(message.data))
        find = rospy.ServiceProxy('/zone/rosslt/find_losses', FindLosses)
        wait_until(lambda: any(find(0.0).had_sources), 'the node has looked at such a message')
        rospy.delete_param('/is_far')
        heard.comes(lambda message: not values.is_tracked(message.data))
        ((kind, said),) = findings('/speed')
        assert (kind, said.startswith(constants + 'Earlier messages had some: another branch ')) == ('fault', True), (
            said
        )


RAMP = """
import rospy
from geometry_msgs.msg import Point

class Cart:
    def __init__(self):
        self.speed, self.x = 0.0, 0.0

    def step(self, wanted):
        self.speed = max(self.speed - 0.01, min(self.speed + 0.01, wanted))
        self.x += self.speed
        return Point(self.x, self.speed, wanted)

rospy.init_node('ramp')
pub = rospy.Publisher('place', Point, queue_size=1)
cart = Cart()
while not rospy.is_shutdown():
    pub.publish(cart.step(0.5))
    rospy.sleep(0.02)
"""


def test_the_doctor_says_which_lines_carry_a_state_on(master, tmp_path):
    lines = RAMP.lstrip().splitlines()
    steps = '; '.join(f'ramp.py:{number}: {lines[number - 1].strip()}' for number in (9, 10))
    with Unmodified(tmp_path, 'ramp', RAMP.lstrip()), Listener('place', Point) as heard:
        heard.comes(lambda message: values.is_tracked(message.z))
        assert '`rosslt doctor /place/y` says why' in command('explain', '/place/y').stderr
        said = 'y cannot be forced: it has no source, as /ramp sends it; what is received without sources has none, '
        assert ('note', f'{said}nor what its code carries on from round to round, as at {steps}') in findings(
            '/place/y'
        )


WAITING = """
import rospy
from geometry_msgs.msg import Point, TwistStamped
rospy.init_node('waiting')
pub = rospy.Publisher('command', TwistStamped, queue_size=1)
speed = 0.5
while not rospy.is_shutdown():
    command = TwistStamped()
    command.header.frame_id = 'base'
    command.header.stamp = rospy.Time.now()
    if rospy.has_param('/is_driving'):
        command.twist.linear.x = speed
    pub.publish(command)  # here
    rospy.sleep(0.02)
"""


def test_a_command_of_zeros_is_no_fault(master, tmp_path):
    waits = '/waiting sends TwistStamped() with no number in it now at waiting.py:12: pub.publish(command)  # here'
    with Unmodified(tmp_path, 'waiting', WAITING.lstrip()), Listener('command', TwistStamped) as heard:
        heard.comes(lambda message: message.header.frame_id)
        result = command('doctor', '/command', '--time', '1')
        assert result.stdout.splitlines() == [f'/command\tgeometry_msgs/TwistStamped\tnote\t{waits}']
        assert result.returncode == 0
        rospy.set_param('/is_driving', True)
        heard.comes(lambda message: values.is_tracked(message.twist.linear.x))
        find = rospy.ServiceProxy('/waiting/rosslt/find_losses', FindLosses)
        wait_until(lambda: any(find(0.0).had_sources), 'the node has looked at such a message')
        rospy.delete_param('/is_driving')
        heard.comes(lambda message: not values.is_tracked(message.twist.linear.x))
        assert findings('/command') == {('note', waits + '; earlier messages had sources')}


TEXT = """
import rospy
from std_msgs.msg import String
rospy.init_node('talk')
pub = rospy.Publisher('words', String, queue_size=1)
speed = 0.5
while not rospy.is_shutdown():
    pub.publish('%.1f m/s at %.2f s' % (speed, rospy.get_time()))
    rospy.sleep(0.02)
"""


def test_of_text_the_doctor_does_not_speak_of_constants(master, tmp_path):
    with Unmodified(tmp_path, 'talk', TEXT.lstrip()), Listener('words', String) as heard:
        heard.comes(lambda message: message.data)
        ((kind, said),) = findings('/words')
        sent = "/words is plain: /talk sends values without sources at talk.py:7: pub.publish('%.1f m/s at %.2f s'"
        assert (kind, said.startswith(sent)) == ('fault', True), said


RECORDING = """
import rospy
from std_msgs.msg import Float64
rospy.init_node('recording')
pub = rospy.Publisher('recorded', Float64, queue_size=1)
other = rospy.Publisher('beside', Float64, queue_size=1)
gain = 0.5
while not rospy.is_shutdown():
    total = gain
    for n in range(2000):
        total = total * 0.999 + gain * 0.001  # here
    pub.publish(total)
    other.publish(gain)
    rospy.sleep(0.01)
"""


def test_the_doctor_says_what_recording_costs_and_where(master, tmp_path):
    with Unmodified(tmp_path, 'recording', RECORDING.lstrip()), Listener('recorded', Float64) as heard:
        heard.comes(lambda message: values.is_tracked(message.data))
        # On a busy machine it may record none of the messages of the second that the doctor looks for.
        (said,) = wait_until(
            lambda: [text for kind, text in findings('/recorded') if 'recording takes' in text], 'its cost is said'
        )

        def examined():
            text = command('doctor', '--time', '1').stdout
            is_whole = all(f'{topic}\tstd_msgs/Float64\tok' in text for topic in ('/recorded', '/beside'))
            return text if is_whole and 'recording takes' in text else ''

        assert wait_until(examined, 'both topics are examined').count('recording takes') == 1  # once for the node
    assert re.match(r'recording takes [1-9]\d? % of the CPU time of /recording, most of it at recording.py:', said)
    assert 'total = total * 0.999 + gain * 0.001  # here' in said
