"""Holds what the demo says if it cannot be shown."""

import contextlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

DEMO = Path(__file__).resolve().parent.parent / 'scripts' / 'demo'
TIME_LIMIT = 300  # seconds, on a busy machine

pytestmark = pytest.mark.rostest


def test_it_ends_with_the_last_lines_of_a_node_that_dies(master, tmp_path):
    broken = tmp_path / 'broken' / 'sensor_msgs.py'
    broken.parent.mkdir()
    broken.write_text('raise ModuleNotFoundError("No module named %r" % __name__)')
    environment = dict(os.environ, PYTHONPATH='{}:{}'.format(broken.parent, os.environ['PYTHONPATH']))
    environment['ROS_HOME'] = environment['ROS_LOG_DIR'] = str(tmp_path)
    result = subprocess.run(
        [sys.executable, str(DEMO)],
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding='utf-8',
        timeout=TIME_LIMIT,
        check=False,
    )
    assert result.returncode == 1
    first, *lines = result.stderr.splitlines()
    assert first.startswith('demo: slt_visualization has ended with status 1; the log is '), result.stderr
    assert lines[-1] == "    ModuleNotFoundError: No module named 'sensor_msgs'"
    assert not processes_with(str(tmp_path)), 'its nodes have ended with it'


def processes_with(text):
    """The command lines of processes that have a text in them."""
    found = []
    for file in Path('/proc').glob('[0-9]*/cmdline'):
        with contextlib.suppress(OSError):
            line = file.read_text().replace('\0', ' ')
            found += [line] if text in line else []
    return found
