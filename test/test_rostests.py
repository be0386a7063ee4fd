"""Runs each rostest suite, `test/**/*.test`, as one test: its own process, its own master on a free port.

The nodes and scripts that a suite names lie beside it and are executable. Their names do not begin with
`test_`, which would have pytest collect them as well.
"""

import os
import signal
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

HERE = Path(__file__).parent
SUITES = sorted(HERE.rglob('*.test'))
#: Suites that take long and whose promises others touch as well, or that show a whole demo.
SLOW = {
    *('instrument/flying', 'markers/arm', 'markers/demo', 'markers/robot', 'markers/watching'),
    *('markers/talker_listener', 'markers/visualization_talker_listener', 'node/closed_loop', 'script/mouse_drags'),
}
DEFAULT_TIME_LIMIT = 60  # rostest's own, in seconds, for a <test> that says none
STARTING_AND_STOPPING = 60
SHUTTING_DOWN = 20


def name_of(suite):
    return str(suite.relative_to(HERE).with_suffix(''))


@pytest.mark.rostest
@pytest.mark.parametrize(
    'suite', [pytest.param(one, id=name_of(one), marks=[pytest.mark.slow] * (name_of(one) in SLOW)) for one in SUITES]
)
def test_rostest(suite, tmp_path):
    results = tmp_path / 'results'
    status, output = run(
        ['rostest', '--results-base-dir', str(results), str(suite)],
        environment=dict(
            os.environ,
            ROS_LOG_DIR=str(tmp_path / 'log'),
            ROS_HOSTNAME='localhost',
            # where test/support is
            PYTHONPATH=os.pathsep.join([str(HERE), os.environ.get('PYTHONPATH', '')]),
        ),
        time_limit=time_limit(suite),
    )
    report = '{}\n{}\n{}'.format(suite, output, node_logs(tmp_path / 'log'))
    if status is None:
        pytest.fail('did not end within {:.0f} s: {}'.format(time_limit(suite), report), pytrace=False)
    if status != 0:
        pytest.fail('rostest ended with status {}: {}'.format(status, report), pytrace=False)
    # rostest takes a suite without a <test>, and a <test> that ran no test case, for a success
    reports = sorted(results.rglob('rosunit-*.xml'))
    if not reports:
        pytest.fail('no <test> ran: ' + report, pytrace=False)
    for path in reports:
        try:
            counts = count(path)
        except ElementTree.ParseError as error:
            pytest.fail('{} cannot be read ({}): {}'.format(path.name, error, report), pytrace=False)
        if counts['tests'] == 0 or counts['failures'] or counts['errors']:
            pytest.fail('{} counts {}: {}'.format(path.name, counts, report), pytrace=False)


def time_limit(suite):
    """Seconds for the whole suite: what its tests allow themselves, and something to start and stop."""
    tests = ElementTree.parse(suite).getroot().iter('test')
    return STARTING_AND_STOPPING + sum(float(test.get('time-limit', DEFAULT_TIME_LIMIT)) for test in tests)


def run(command, environment, time_limit):
    """Runs a command to its end: its status, None if it had to be stopped, and what it printed."""
    process = subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        encoding='utf-8',
        errors='replace',
    )
    try:
        output, _ = process.communicate(timeout=time_limit)
    except subprocess.TimeoutExpired:
        output = stop(process)
        return None, output
    except BaseException:  # the user interrupts: no node may outlive the test
        stop(process)
        raise
    return process.returncode, output


def stop(process):
    # rostest takes its nodes, which are in sessions of their own, down with it when it is interrupted
    os.killpg(process.pid, signal.SIGINT)
    try:
        output, _ = process.communicate(timeout=SHUTTING_DOWN)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        output = '(it did not end when interrupted, and was killed)'
    return output


def count(path):
    """The numbers of tests, failures and errors in a JUnit report."""
    suites = list(ElementTree.parse(path).getroot().iter('testsuite'))
    return {name: sum(int(suite.get(name, 0)) for suite in suites) for name in ('tests', 'failures', 'errors')}


def node_logs(directory):
    """The ends of what the nodes wrote, without rospy's own steps and the log of roslaunch."""
    parts = []
    for path in sorted(directory.rglob('*.log')):
        lines = [
            line
            for line in path.read_text(encoding='utf-8', errors='replace').splitlines()
            if not line.startswith(('[rospy.', '[xmlrpc]'))
        ]
        if lines and not path.name.startswith(('roslaunch', 'rostest', 'master')):
            parts.append('--- {}\n{}'.format(path.name, '\n'.join(lines[-40:])))
    return '\n'.join(parts)
