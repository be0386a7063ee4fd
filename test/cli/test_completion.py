"""What bash completes after the setup file of the workspace was sourced: nothing more is needed for it."""

import os
import subprocess

import pytest

from support.processes import Node, wait_until

pytestmark = pytest.mark.rostest

#: Sends joints, and a frame of tf.
ARM = """
    from geometry_msgs.msg import TransformStamped
    from sensor_msgs.msg import JointState
    from tf2_msgs.msg import TFMessage

    command = rospy.Publisher('command', JointState, queue_size=1)
    tf = rospy.Publisher('/tf', TFMessage, queue_size=1)
    hand = TransformStamped(child_frame_id='hand')
    hand.header.frame_id = 'world'
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        command.publish(JointState(name=['shoulder', 'elbow'], position=[0.5, 1.0]))
        tf.publish(TFMessage([hand]))
        rate.sleep()
    """

#: Asks bash for its completions of a line, as it does itself when somebody types tab.
ASK = r"""
COMP_LINE=$1 COMP_POINT=${#1}
eval "COMP_WORDS=($1)"
[[ $1 == *' ' ]] && COMP_WORDS+=('')
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
if [[ ${COMP_WORDS[-1]} == *:* ]]; then  # bash ends words at colons
    COMP_WORDS[-1]=${COMP_WORDS[-1]##*:}
fi
set -- $(complete -p rosslt)
while [[ $1 != -F ]]; do shift; done
"$2" rosslt "${COMP_WORDS[-1]}" "${COMP_WORDS[-2]}"
printf '%s\n' "${COMPREPLY[@]}"
"""


def completions(line):
    """What may stand at the end of a line; a trailing space says that the word is complete."""
    setup = next(
        os.path.join(prefix, 'setup.bash')
        for prefix in os.environ['CMAKE_PREFIX_PATH'].split(':')
        if os.path.exists(os.path.join(prefix, 'bin', 'rosslt'))
    )
    # the setup file may set a master of its own
    command = f'source {setup} && export ROS_MASTER_URI=$MASTER\n{ASK}'
    result = subprocess.run(
        ['bash', '--norc', '-c', command, 'bash', line],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
        env=dict(os.environ, MASTER=os.environ['ROS_MASTER_URI']),
    )
    assert result.stderr == ''
    return result.stdout.splitlines()


@pytest.mark.parametrize(
    ('line', 'expected'),
    [
        ('rosslt s', ['save ', 'set ']),
        ('rosslt undo /', ['/relay ', '/talker ']),
        ('rosslt list t', ['talker ', 'talker/']),
        ('rosslt get /t', ['/talker/']),
        ('rosslt get /talker/f', ['/talker/frame ', '/talker/fixed ']),
        ('rosslt set talker/~parking/', ['talker/~parking/0 ', 'talker/~parking/1 ']),
        ('rosslt echo /g', ['/gate ']),
        ('rosslt echo --once -n 3 /gate/pose/', ['/gate/pose/position/', '/gate/pose/orientation/']),
        ('rosslt force /g', ['/gate/']),
        ('rosslt force /pose/', ['/pose/position/', '/pose/orientation/']),
        ('rosslt force /gate/pose/position/', [f'/gate/pose/position/{axis} ' for axis in 'xyz']),
        ('rosslt force /gate/pose/position/x 5 --source /talker/ra', ['/talker/radius ']),
        ('rosslt save /r', ['/relay ']),
        ('rosslt row d', ['duplicate ', 'delete ', 'down ']),
        ('rosslt row up /r', ['/relay/']),
    ],
)
def test_what_may_stand_there_is_offered(nodes, line, expected):
    assert completions(line) == expected


def test_what_a_device_may_move_and_what_may_move_it_is_offered(nodes):
    with Node('arm', ARM):
        wait_until(lambda: 'elbow' in ''.join(completions('rosslt teach /command:')), 'the joints are sent')
        assert completions('rosslt teach /command:') == ['shoulder ', 'elbow ']
        assert completions('rosslt teach /comm') == ['/command ', '/command:']
        assert completions('rosslt teach /talker/fi') == ['/talker/fixed ']
        assert completions('rosslt teach /gate/pose/position/') == [f'/gate/pose/position/{axis} ' for axis in 'xyz']
        assert 'tf:' in completions('rosslt teach /gate --by t')
        assert completions('rosslt teach /gate --by tf:') == ['hand ', 'world ']
        assert completions('rosslt teach /gate --by /comm') == ['/command ']


def test_every_verb_is_offered():
    offered = completions('rosslt ')
    assert {'list ', 'get ', 'force ', 'graph '} <= set(offered)
    assert 'complete ' not in offered


@pytest.mark.parametrize('line', ['rosslt bag ', 'rosslt save /talker ', 'rosslt echo --bag ', 'rosslt nothing '])
def test_where_the_command_knows_nothing_bash_offers_files(nodes, line):
    assert completions(line) in ([], [''])


def test_nothing_is_said_where_there_is_no_master(monkeypatch):
    monkeypatch.setenv('ROS_MASTER_URI', 'http://localhost:1')
    assert completions('rosslt get /') in ([], [''])
