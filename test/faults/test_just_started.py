"""A machine that has just started: `time.monotonic()` counts from there, so nothing that never was is long ago."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

TESTS = Path(__file__).parent.parent

#: Tests of what keeps times, of which none needs a master.
KEEPING_TIMES = [
    str((TESTS / file).resolve(strict=True))
    for file in (
        'markers/test_scene_drags.py',
        'markers/test_scene.py',
        'messages/test_fault_log.py',
        'messages/test_sampling.py',
        'node/test_closed_loop.py',
        'script/test_live.py',
    )
]

#: What the tests find as the age of the machine when they begin, in seconds.
AGE = 1

#: How long they may take, in seconds, on a busy machine.
TIME_LIMIT = 300


@pytest.fixture
def just_started():
    """What a command begins with to run as on a machine that has just started: a time namespace of Linux."""
    age = int(time.clock_gettime(time.CLOCK_MONOTONIC)), int(time.clock_gettime(time.CLOCK_BOOTTIME))
    clocks = ['--time', '--monotonic', str(AGE - age[0]), '--boottime', str(AGE - age[1]), '--fork', '--kill-child']
    # Root may make one, and on most machines everybody may in a user namespace.
    reasons = []
    for user in ([], ['--user', '--map-current-user']):
        tried = subprocess.run(['unshare', *user, *clocks, 'true'], capture_output=True, text=True, check=False)
        if tried.returncode == 0:
            return ['unshare', *user, *clocks]
        reasons.append(tried.stderr.strip())
    return pytest.skip(f'the kernel lets this process make no time namespace: {"; ".join(reasons)}')


@pytest.mark.slow
def test_what_keeps_times_works_on_a_machine_that_has_just_started(just_started):
    age = [sys.executable, '-c', 'import time; print(time.monotonic())']
    assert float(subprocess.run([*just_started, *age], capture_output=True, check=True).stdout) < AGE + 30.0
    command = [*just_started, sys.executable, '-m', 'pytest', '-q', *KEEPING_TIMES]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=TIME_LIMIT)
    assert done.returncode == 0, done.stdout + done.stderr
