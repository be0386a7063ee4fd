"""Calls of a Python program, each in a fork of a process that has loaded Python and rospy, and nothing of rosslt.

Starting Python and loading rospy and NumPy is most of what a call of the command takes, and the same for each. A fork
loads what it needs of the package itself. It has the arguments, environment and folder of the caller, the descriptors,
threads and signals of a process that was just started, and ends as Python ends. What is different: its output is a
file, not a pipe; a traceback begins with lines of this file; all forks of a process share its seed of hashes.
"""

import contextlib
import functools
import importlib
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import types

#: What is loaded before the forks: what a verb needs that asks a node, but for the package.
LOADED = (
    *('argparse', 'difflib', 'fractions', 'genpy.dynamic', 'geometry_msgs.msg', 'numpy', 'rosbag', 'rosgraph', 'rospy'),
    *('std_srvs.srv', 'uuid', 'visualization_msgs.msg', 'yaml'),
)
#: Read where they are needed, never while Python starts or the modules above are loaded.
READ_LATER = ('PYTEST_CURRENT_TEST', 'ROS_LOG_DIR', 'ROS_MASTER_URI')
LARGEST = 2**20  # bytes of a request


def call(script, arguments, time_limit):
    """Run a Python program with its output in files; returns the CompletedProcess, as `subprocess.run` does.

    Raises:
        subprocess.TimeoutExpired: it did not end within the time limit, in seconds, and was killed.
    """
    environment = {name: text for name, text in os.environ.items() if name not in READ_LATER}
    server = _server(script, frozenset(environment.items()))
    request = json.dumps([arguments, os.getcwd(), dict(os.environ)]).encode()
    ours, theirs = _pair()
    with ours, tempfile.TemporaryFile('w+b') as output, tempfile.TemporaryFile('w+b') as errors:
        with theirs:
            socket.send_fds(server, [request], [output.fileno(), errors.fileno(), theirs.fileno()])
        pid = _received(ours)
        ours.settimeout(time_limit)
        try:
            status = _received(ours)
        except socket.timeout:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
            raise subprocess.TimeoutExpired([script, *arguments], time_limit) from None
        texts = []
        for file in (output, errors):
            file.seek(0)
            texts.append(file.read().decode('utf-8'))
    return subprocess.CompletedProcess([script, *arguments], status, *texts)


def _pair():
    """Two sockets that wait for each other, also where rospy has given all new ones a time limit."""
    pair = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    for one in pair:
        one.setblocking(True)
    return pair


def _received(ours):
    packet = ours.recv(LARGEST)
    if not packet:
        raise RuntimeError('the process that forks the command has ended, and should not have')
    return int(packet)


@functools.lru_cache(maxsize=4)
def _server(script, environment):
    """The socket of a process that forks. It ends when nobody has the socket: here, or as this process has ended."""
    ours, theirs = _pair()
    with theirs:
        subprocess.Popen(
            [sys.executable, __file__, str(theirs.fileno()), script],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,  # no terminal, as in the calls
            env=dict(environment),
            cwd='/',  # which nobody removes
            pass_fds=[theirs.fileno()],
        )
    return ours


def serve(control, script):
    """Fork for each request until nobody can send one any more; in a fork, become the program."""
    # what is loaded may look at these, and finds what it finds in the program itself
    sys.argv = [script]
    sys.path[0] = os.path.dirname(script)
    for name in LOADED:
        importlib.import_module(name)
    while True:
        request, descriptors, _, _ = socket.recv_fds(control, LARGEST, 3)
        if not request:
            return
        # the fork of a fork, so that nobody has to wait for its end here
        pid = os.fork()
        if pid == 0:
            if os.fork():
                os._exit(0)
            control.close()
            _attend(json.loads(request), *descriptors, script)
            return
        os.waitpid(pid, 0)
        for descriptor in descriptors:
            os.close(descriptor)


def _attend(request, output, errors, reply, script):
    """Become the program in one more fork, and tell the caller its process id, then its status."""
    pid = os.fork()
    if pid == 0:
        os.close(reply)
        _become(script, *request, output, errors)
        return
    for descriptor in (output, errors):
        os.close(descriptor)
    caller = socket.socket(fileno=reply)
    with contextlib.suppress(BrokenPipeError):  # the caller has given up
        caller.send(b'%d' % pid)
        caller.send(b'%d' % os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
    os._exit(0)


def _become(script, arguments, folder, environment, output, errors):
    """Run the program as Python runs a script: what it raises, and its status, are this process's."""
    for descriptor, number in ((output, 1), (errors, 2)):
        os.dup2(descriptor, number)
        os.close(descriptor)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.argv = [script, *arguments]
    main = types.ModuleType('__main__')
    main.__file__ = script
    sys.modules['__main__'] = main
    with open(script, 'rb') as file:
        code = compile(file.read(), script, 'exec')
    exec(code, vars(main))


if __name__ == '__main__':
    serve(socket.socket(fileno=int(sys.argv[1])), sys.argv[2])
