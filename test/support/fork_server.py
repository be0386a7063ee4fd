"""Python programs, each in a fork of a process that has loaded Python, rospy and the package.

Loading them is most of what a call of the command takes, or a small node, and the same for each. A fork has the
arguments, environment and folder of the caller, the descriptors, threads and signals of a process that was just
started, and ends as Python ends. What is different: a traceback begins with lines of this file; all forks of a process
share its seed of hashes.

Python 3.8 cannot hand descriptors to another process: there, each program is started.
"""

import atexit
import contextlib
import functools
import gc
import importlib
import json
import os
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import types

#: What is loaded before the forks.
LOADED = (
    *('argparse', 'difflib', 'fractions', 'genpy.dynamic', 'geometry_msgs.msg', 'numpy', 'rosbag', 'rosgraph'),
    *('rosmaster', 'rospy'),
    *('rosslt.cli.directory', 'rosslt.markers', 'rosslt.msg', 'rosslt.node', 'rosslt.srv'),
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
    with tempfile.TemporaryFile('w+b') as output, tempfile.TemporaryFile('w+b') as errors:
        program = Program(script, arguments, output, errors)
        try:
            status = program.wait(time_limit)
        except subprocess.TimeoutExpired:
            program.kill()
            raise
        texts = []
        for file in (output, errors):
            file.seek(0)
            texts.append(file.read().decode('utf-8'))
    return subprocess.CompletedProcess([script, *arguments], status, *texts)


class _Started(subprocess.Popen):
    """A program that is started; its arguments are those of a fork."""

    def __init__(self, script, arguments, output, errors):
        super().__init__(
            [sys.executable, script, *arguments],
            stdin=subprocess.PIPE if output == subprocess.PIPE else subprocess.DEVNULL,
            stdout=output,
            stderr=errors,
            env=dict(os.environ),  # without what readline has put into the process's own: LINES and COLUMNS
            encoding='utf-8',
        )


class _Forked:
    """A program that runs in a fork, as a `subprocess.Popen` shows it.

    Args:
        script: the path of the program.
        arguments: its command line behind that.
        output, errors: the files that it writes to; for `subprocess.PIPE` its output is a pipe, and its input, too.
    """

    def __init__(self, script, arguments, output, errors):
        self.args, self.returncode = [script, *arguments], None
        self.stdin = self.stdout = None
        environment = {name: text for name, text in os.environ.items() if name not in READ_LATER}
        server = _server(frozenset(environment.items()))
        request = json.dumps([script, arguments, os.getcwd(), dict(os.environ)]).encode()
        self._reply, theirs = _pair()
        with contextlib.ExitStack() as handed_over:
            handed_over.enter_context(theirs)
            if output == subprocess.PIPE:
                (read, self.stdin), (self.stdout, output) = _pipe(), _pipe()
                handed_over.enter_context(read)
                handed_over.enter_context(output)
            else:
                read = handed_over.enter_context(open(os.devnull, encoding='utf-8'))
            socket.send_fds(server, [request], [one.fileno() for one in (read, output, errors, theirs)])
        self.pid = self._received()

    def _received(self):
        packet = self._reply.recv(LARGEST)
        if not packet:
            raise RuntimeError('the process that forks programs has ended, and should not have')
        return int(packet)

    def poll(self):
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self.wait(0)

    def wait(self, timeout=None):
        if self.returncode is None:
            self._reply.settimeout(timeout)
            try:
                self.returncode = self._received()
            except (BlockingIOError, socket.timeout):
                raise subprocess.TimeoutExpired(self.args, timeout) from None
            self._reply.close()
        return self.returncode

    def send_signal(self, number):
        if self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def terminate(self):
        self.send_signal(signal.SIGTERM)

    def kill(self):
        self.send_signal(signal.SIGKILL)


Program = _Forked if hasattr(socket, 'send_fds') else _Started


def _pipe():
    read, write = os.pipe()
    return open(read, encoding='utf-8'), open(write, 'w', encoding='utf-8')


def _pair():
    """Two sockets that wait for each other, also where rospy has given all new ones a time limit."""
    pair = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    for one in pair:
        one.setblocking(True)
    return pair


@functools.lru_cache(maxsize=4)
def _server(environment):
    """The socket of a process that forks. It ends when nobody has the socket: here, or as this process has ended."""
    ours, theirs = _pair()
    with theirs:
        subprocess.Popen(
            [sys.executable, __file__, str(theirs.fileno())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,  # no terminal, as in the calls
            env=dict(environment),
            cwd='/',  # which nobody removes
            pass_fds=[theirs.fileno()],
        )
    return ours


def serve(control):
    """Fork for each request until nobody can send one any more; in a fork, become the program."""
    del sys.argv[1:]  # what is loaded may look at these
    found_in = list(sys.path)
    for name in LOADED:
        importlib.import_module(name)
    sys.path[:] = found_in  # which the package extends in the space it is built in
    # a collection in a fork, as at its end, would write to each loaded object, and so copy all memory
    gc.collect()
    gc.freeze()
    request = _fork_for_requests(control)
    if request is not None:
        _become(*request)


def _fork_for_requests(control):
    """Fork for each request, and tell its caller the process id, then the status.

    Returns:
        None when nobody can send one any more; in a fork, its request and its streams.
    """
    running = {}  # {descriptor that is ready once a program has ended: (its process id, the socket of its caller)}
    ready = selectors.DefaultSelector()
    ready.register(control, selectors.EVENT_READ)
    while True:
        for number in [key.fd for key, _ in ready.select()]:
            if number in running:
                pid, caller = running.pop(number)
                ready.unregister(number)
                os.close(number)
                _send(caller, os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
                caller.close()
                continue
            request, descriptors, _, _ = socket.recv_fds(control, LARGEST, 4)
            if not request:
                return None
            *streams, reply = descriptors
            caller, pid = socket.socket(fileno=reply), os.fork()
            if pid == 0:
                for other, (_, one) in running.items():
                    os.close(other)
                    one.close()
                for one in (ready, control, caller):
                    one.close()
                return [*json.loads(request), streams]
            for descriptor in streams:
                os.close(descriptor)
            _send(caller, pid)
            ended = os.pidfd_open(pid)
            running[ended] = pid, caller
            ready.register(ended, selectors.EVENT_READ)


def _send(caller, number):
    with contextlib.suppress(BrokenPipeError):  # the caller has given up
        caller.send(b'%d' % number)


def _become(script, arguments, folder, environment, streams):
    """Run the program as Python runs a script: what it raises, and its status, are this process's."""
    for number, descriptor in enumerate(streams):
        os.dup2(descriptor, number)
        os.close(descriptor)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.argv[:] = script, *arguments  # the list that functions of what is loaded have as their default
    sys.path[0] = os.path.dirname(script)
    sys.modules['rospy'].names.reload_mappings(sys.argv)
    sys.modules['numpy'].random.seed()
    main = types.ModuleType('__main__')
    main.__file__ = script
    sys.modules['__main__'] = main
    with open(script, 'rb') as file:
        code = compile(file.read(), script, 'exec')
    status = 0
    try:
        exec(code, vars(main))
    except SystemExit as end:
        status = 0 if end.code is None else end.code
    if isinstance(status, int):
        _end(status)
    raise SystemExit(status)


def _end(status):
    """End as Python does, but for freeing what is loaded: that would copy all memory of the fork.

    What the program has left in an open file is not written.
    """
    threading._shutdown()
    atexit._run_exitfuncs()
    with contextlib.suppress(OSError, ValueError, AttributeError):  # Python says why it cannot, or minds nothing
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status & 0xFF)


if __name__ == '__main__':
    serve(socket.socket(fileno=int(sys.argv[1])))
