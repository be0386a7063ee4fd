"""A program that is called in a fork is like one that was started: the tests of the command rest on it.

So is one that is called where Python cannot hand descriptors to another process.
"""

import contextlib
import importlib.util
import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from support import fork_server
from support.processes import wait_until

TIME_LIMIT = 60
SURROUNDINGS = """
import atexit, gc, json, logging, os, signal, sys, threading

def ended():
    print('ended')

atexit.register(ended)
print(json.dumps(dict(
    argv=sys.argv, file=__file__, name=__name__, path=sys.path,
    is_main=vars(sys.modules['__main__']) is globals(),
    folder=os.getcwd(), environment=dict(os.environ), mask=os.umask(0o22), group=os.getpgrp(), session=os.getsid(0),
    descriptors=sorted(os.listdir('/proc/self/fd'), key=int)[:-1],  # the last one reads this folder
    threads=[thread.name for thread in threading.enumerate()], tasks=len(os.listdir('/proc/self/task')),
    handlers={number: str(signal.getsignal(number)) for number in range(1, 32)},
    ignored=[line for line in open('/proc/self/status') if line.startswith(('SigIgn', 'SigBlk'))],
    log=[str(handler) for handler in logging.root.handlers], level=logging.root.level,
    streams=[str(sys.stdin), str(sys.stdout), str(sys.stderr), sys.stdout.line_buffering, sys.stdout.isatty()],
    input=sys.stdin.read(), hook=str(sys.excepthook), collects=gc.isenabled(), deepest=sys.getrecursionlimit(),
)))
"""


@pytest.fixture(params=['of this Python', 'of Python 3.8'])
def server(request, monkeypatch):
    """The fork server, as this Python loads it and as one whose sockets hand no descriptors on."""
    if request.param == 'of this Python':
        return fork_server
    for name in ('send_fds', 'recv_fds'):
        monkeypatch.delattr(socket, name, raising=False)
    spec = importlib.util.spec_from_file_location('fork_server_of_python_3_8', fork_server.__file__)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def program(tmp_path):
    """A function that writes a program and returns its path."""

    def write(text):
        path = tmp_path / 'program'
        path.write_text(text)
        return str(path)

    return write


def started(script, *arguments):
    return subprocess.run(
        [sys.executable, script, *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        env=dict(os.environ),  # without what readline has put into the process's own: LINES and COLUMNS
        timeout=TIME_LIMIT,
        check=False,
    )


def test_its_surroundings_are_those_of_a_program_that_was_started(server, program, tmp_path, monkeypatch):
    script = program(SURROUNDINGS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('ROS_MASTER_URI', 'http://localhost:2')
    fork, process = server.call(script, ['a b', 'ä'], TIME_LIMIT), started(script, 'a b', 'ä')
    assert (fork.returncode, fork.stderr) == (process.returncode, process.stderr) == (0, '')
    (said, last), (expected, also_last) = fork.stdout.splitlines(), process.stdout.splitlines()
    assert last == also_last == 'ended'
    said, expected = json.loads(said), json.loads(expected)
    assert {name for name, _ in said['environment'].items() ^ expected['environment'].items()} == set()
    assert said == expected
    assert said['argv'] == [script, 'a b', 'ä']
    assert said['environment'] == dict(os.environ)
    assert said['tasks'] == 1


@pytest.mark.parametrize(
    'ending',
    [
        'sys.exit()',
        'sys.exit(3)',
        'sys.exit("a word")',
        'os._exit(4)',
        'os.kill(os.getpid(), signal.SIGTERM)',
        'os.kill(os.getpid(), signal.SIGINT)',
        'raise ValueError("a fault")',
        'threading.Thread(target=lambda: (time.sleep(0.1), print("later"))).start()',
    ],
)
def test_it_ends_as_a_program_that_was_started(server, program, ending):
    script = program(f'import os, signal, sys, threading, time\nprint("begun", flush=True)\n{ending}')
    fork, process = server.call(script, [], TIME_LIMIT), started(script)
    assert (fork.returncode, fork.stdout) == (process.returncode, process.stdout)
    # a traceback begins with other lines
    assert fork.stderr.splitlines()[-1:] == process.stderr.splitlines()[-1:]


def test_one_that_does_not_end_is_killed(server, program, tmp_path, monkeypatch):
    script = program('import time\ntime.sleep(600)')
    folder = tmp_path / 'of the program'
    folder.mkdir()
    with monkeypatch.context() as patch:
        patch.chdir(folder)
        with pytest.raises(subprocess.TimeoutExpired, match='timed out after 2 seconds'):
            server.call(script, [], 2)
    wait_until(lambda: folder not in _folders_of_processes(), 'the program has ended')


def test_its_input_and_output_are_pipes_if_asked_for(server, program):
    script = program('print(input().upper(), flush=True)\nprint(input())\nraise SystemExit(5)')
    ran = server.Program(script, [], subprocess.PIPE, sys.stderr)
    ran.stdin.write('a\n')
    ran.stdin.flush()
    assert (ran.stdout.readline(), ran.poll()) == ('A\n', None)
    ran.stdin.write('ä\n')
    ran.stdin.close()
    assert (ran.stdout.read(), ran.wait(TIME_LIMIT), ran.poll()) == ('ä\n', 5, 5)
    ran.stdout.close()


def _folders_of_processes():
    found = set()
    for process in Path('/proc').glob('[0-9]*/cwd'):
        with contextlib.suppress(OSError):  # it has ended
            found.add(process.resolve(strict=True))
    return found
