"""The command as a shell runs it: with its output in files or pipes, and on a terminal."""

import contextlib
import fcntl
import os
import pty
import shutil
import struct
import subprocess
import termios

from support import fork_server
from support.processes import wait_until

COLUMNS = 120
TIME_LIMIT = 120  # seconds, on a busy machine


def rosslt(*arguments, **environment):
    """Run the command without a terminal; returns the CompletedProcess.

    Most calls are forks, which take a quarter of the CPU time. The real command is started where a fork of a process
    that has loaded the package would show less: with further environment variables, which Python and rospy may read
    when they are loaded; for `rosslt run`, whose node comes before all else in its process; on a terminal
    (`on_terminal`). The tests of completion and of live pages start it, too.

    Args:
        environment: further environment variables.
    """
    if not environment and arguments[:1] != ('run',):
        return fork_server.call(shutil.which('rosslt'), arguments, TIME_LIMIT)
    return subprocess.run(
        ['rosslt', *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=TIME_LIMIT,
        check=False,
        env=dict(os.environ, **environment),
    )


def lines(*arguments):
    """The lines that the command prints, each split at its tabs; it must work."""
    result = rosslt(*arguments)
    assert result.returncode == 0, result.stderr
    assert result.stderr == ''
    return [line.split('\t') for line in result.stdout.splitlines()]


def failure(*arguments, **environment):
    """The one line that the command prints where it does not work."""
    result = rosslt(*arguments, **environment)
    assert result.returncode == 1, result
    assert result.stdout == ''
    (line,) = result.stderr.splitlines()
    return line


def on_terminal(*arguments):
    """What the command prints on a terminal; it must work."""
    status, printed = shown_on_terminal(['rosslt', *arguments])
    assert status == 0, printed
    return printed


def shown_on_terminal(command, **options):
    """The exit status of a command, and what a terminal shows of it; options are those of Popen."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack('HHHH', 40, COLUMNS, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name not in ('COLUMNS', 'LINES')}
    process = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, **options)
    os.close(theirs)
    printed = b''
    with contextlib.suppress(OSError):  # nobody holds the other end any more
        while True:
            printed += os.read(ours, 65536)
    os.close(ours)
    return process.wait(TIME_LIMIT), printed.decode('utf-8').replace('\r\n', '\n')


def record_bag(path, count, *topics):
    """Record a bag of so many messages of topics; options of `rosbag record` may stand among them."""
    command = ['rosbag', 'record', '-O', str(path), '--limit', str(count), *topics]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, timeout=100)
    wait_until(lambda: os.path.exists(path), 'the bag is there')
