"""The command as a shell runs it: with its output in a pipe, and on a terminal."""

import fcntl
import os
import pty
import struct
import subprocess
import termios

COLUMNS = 120
TIME_LIMIT = 30  # seconds, on a busy machine


def rosslt(*arguments, **environment):
    """Run the command with its output in a pipe; returns the CompletedProcess."""
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
    """The lines that the command prints into a pipe, each split at its tabs; it must work."""
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
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack('HHHH', 40, COLUMNS, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name not in ('COLUMNS', 'LINES')}
    process = subprocess.Popen(
        ['rosslt', *arguments], stdin=theirs, stdout=theirs, stderr=subprocess.PIPE, env=environment
    )
    os.close(theirs)
    printed = b''
    try:
        while True:
            try:
                read = os.read(ours, 65536)
            except OSError:  # the other end is closed
                break
            printed += read
        _, errors = process.communicate(timeout=TIME_LIMIT)
    finally:
        process.kill()
        os.close(ours)
    assert process.returncode == 0, errors
    return printed.decode('utf-8').replace('\r\n', '\n')
