"""Runs each rostest suite, `test/**/*.test`, as one test: its own process, its own master on a free port.

A suite that starts no nodes beside its test needs neither rostest nor roslaunch, which take longer than many a suite:
its parameters are set here, and its test is a fork of a process that has loaded rospy.

The nodes and scripts that a suite names lie beside it and are executable. Their names do not begin with
`test_`, which would have pytest collect them as well.
"""

import os
import shutil
import signal
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest
import rosgraph
import yaml

from support.fork_server import Program
from support.masters import reached_master

HERE = Path(__file__).parent
SUITES = sorted(HERE.rglob('*.test'))
#: Suites that take long and whose promises others touch as well, or that show a whole demo.
SLOW = {
    *('instrument/flying', 'markers/arm', 'markers/robot', 'markers/watching'),
    *('markers/talker_listener', 'markers/visualization_talker_listener', 'node/closed_loop'),
    *('actions/actions', 'teach/led', 'teach/locations', 'teach/matching', 'teach/numbers'),
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
def test_rostest(suite, tmp_path, monkeypatch):
    results = tmp_path / 'results'
    # where test/support is
    monkeypatch.setenv('PYTHONPATH', str(HERE), prepend=os.pathsep)
    elements = list(ElementTree.parse(suite).getroot())
    with (tmp_path / 'output').open('w+b') as printed:
        if {one.tag for one in elements} <= {'param', 'rosparam', 'test'}:
            with reached_master(tmp_path / 'log'):
                status = run_without_rostest(suite, elements, results, printed)
        else:
            monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path / 'log'))
            monkeypatch.setenv('ROS_HOSTNAME', 'localhost')
            arguments = ['--results-base-dir', str(results), str(suite)]
            status = run(shutil.which('rostest'), arguments, printed, time_limit(suite))
    output = (tmp_path / 'output').read_text(encoding='utf-8', errors='replace')
    report = '{}\n{}\n{}'.format(suite, output, node_logs(tmp_path / 'log'))
    if status != 0:
        how = 'in vain' if status else 'not within {:.0f} s'.format(time_limit(suite))
        pytest.fail('ended {}, with status {}: {}'.format(how, status, report), pytrace=False)
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


def run_without_rostest(suite, elements, results, printed):
    """Run the tests of a suite at the master that is reached; returns what `run` does.

    Args:
        elements: what the suite says: parameters and tests.
        results: the folder for JUnit reports.
        printed: the file for what is printed.
    """
    results.mkdir()
    parameters = rosgraph.Master('/test')
    status = 0
    for one in elements:
        if one.tag != 'test':
            parameters.setParam(one.get('name') or one.get('param'), yaml.safe_load(one.get('value') or one.text))
            continue
        report = results / 'rosunit-{}.xml'.format(one.get('test-name'))
        arguments = ['--gtest_output=xml:{}'.format(report), '__name:={}'.format(one.get('test-name'))]
        limit = float(one.get('time-limit', DEFAULT_TIME_LIMIT))
        status = run(suite.parent / one.get('type'), arguments, printed, limit)
        if status != 0:
            break
    return status


def run(script, arguments, printed, limit):
    """Run a program to its end; returns its status, None if it had to be stopped."""
    program = Program(str(script), arguments, printed, printed)
    try:
        return program.wait(limit)
    except subprocess.TimeoutExpired:
        return None
    finally:  # its nodes, which are in sessions of their own, end with it when it is interrupted
        program.send_signal(signal.SIGINT)
        try:
            program.wait(SHUTTING_DOWN)
        except subprocess.TimeoutExpired:
            program.kill()


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
