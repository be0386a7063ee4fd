"""The process that holds a twin: a master, a copy of a node, and what plays messages to it.

It takes requests from its standard input and answers on its standard output, both pickled, until its input closes.
"""

import contextlib
import ctypes
import fcntl
import http.client
import os
import pickle
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import traceback
import xmlrpc.client
from pathlib import Path
from typing import Any, Callable, Dict, List, Set, Tuple

import rosgraph
import rosgraph.names
import rosmaster.master
import rospy

from rosslt.models.processes import LiveProcess
from rosslt.models.raw_messages import NotBuilt, raw_class

_NAME = '/rosslt_laboratory'
_LAST_LINES = 10

#: The time that a copy has to say what it is connected to, in seconds.
_ANSWERS = 2.0

#: Remappings that would lead a copy to the live master, or to its log.
_NOT_COPIED = ('__master:=', '__ip:=', '__hostname:=', '__log:=')

#: A private parameter: the master has it, as it may have been changed since.
_PARAMETER = re.compile('_[^_].*:=')

#: The methods of a master that tell a node of a parameter, which is their last argument.
_ASKS = ('getParam', 'hasParam', 'subscribeParam')

# from the headers of Linux
_SIOCGIFFLAGS, _SIOCSIFFLAGS, _IFF_UP = 0x8913, 0x8914, 1
_MS_BIND = 4096
_PR_SET_CHILD_SUBREAPER = 36
_LIBC = ctypes.CDLL(None, use_errno=True)


class Failed(Exception):
    """The copy does not do what is asked."""


class ParentGone(Exception):
    """Nobody asks any more."""


def bring_up_loopback() -> None:
    """Let processes of a new network namespace talk with each other."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        name, flags = struct.unpack(
            '16sH', fcntl.ioctl(any_socket, _SIOCGIFFLAGS, struct.pack('16sH14x', b'lo', 0))[:18]
        )
        fcntl.ioctl(any_socket, _SIOCSIFFLAGS, struct.pack('16sH14x', name, flags | _IFF_UP))


def hide_devices() -> None:
    """Put a directory with the devices that belong to nobody in the place of /dev, in a new mount namespace."""
    kept = {name: os.open('/dev/' + name, os.O_PATH) for name in ('null', 'zero', 'full', 'random', 'urandom')}
    _mount('tmpfs', '/dev', 'tmpfs', 0)
    for name, descriptor in kept.items():
        Path('/dev', name).touch()
        _mount(f'/proc/self/fd/{descriptor}', '/dev/' + name, '', _MS_BIND)
        os.close(descriptor)
    os.mkdir('/dev/shm', 0o1777)


def _mount(source: str, target: str, kind: str, flags: int) -> None:
    if _LIBC.mount(source.encode(), target.encode(), kind.encode() or None, ctypes.c_ulong(flags), None):
        raise OSError(ctypes.get_errno(), 'cannot mount ' + target)


class _Transport(xmlrpc.client.Transport):
    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _ANSWERS
        return connection


class Laboratory:
    """A master, a copy and its topics.

    Args:
        order: what `Twin` sends first.
        directory: where the copy may write.
    """

    def __init__(self, order: Dict[str, Any], directory: str) -> None:
        self._process: LiveProcess = order['process']
        self._directory = directory
        self._output = os.path.join(directory, 'output')
        self._received: List[Tuple[float, str, bytes]] = []
        self._gone = select.poll()
        self._gone.register(0, 0)  # a hang-up alone
        master = rosmaster.master.Master(0)
        master.start()
        self.asked: Set[str] = set()
        for method in _ASKS:
            setattr(master.handler, method, self._noting(getattr(master.handler, method)))
        os.environ['ROS_MASTER_URI'] = master.uri
        rospy.init_node(_NAME[1:], argv=[], disable_rosout=True, disable_signals=True)
        self.master = rosgraph.Master(_NAME, master_uri=master.uri)
        self.master.setParam('/', order['parameters'])
        for name, value in order['changed'].items():
            self.master.setParam(name, value)
        self._inputs = {
            topic: rospy.Publisher(topic, raw_class(name), queue_size=0) for topic, name in order['inputs'].items()
        }
        self._outputs = {
            topic: rospy.Subscriber(topic, raw_class(name), self._receive, topic, tcp_nodelay=True)
            for topic, name in order['outputs'].items()
        }
        self.copy = self._start_copy(master.uri)
        try:
            self._wait_for_connections(order['timeout'])
        except BaseException:
            self.stop()
            raise

    def _start_copy(self, uri: str) -> 'subprocess.Popen[bytes]':
        process = self._process
        environment = {**process.environment, 'ROS_MASTER_URI': uri, 'ROS_IP': '127.0.0.1'}
        environment.update(ROS_HOME=self._directory, ROS_LOG_DIR=self._directory)
        environment.pop('ROS_HOSTNAME', None)
        arguments = [one for one in process.arguments if not (one.startswith(_NOT_COPIED) or _PARAMETER.match(one))]
        with open(self._output, 'wb') as output:
            return subprocess.Popen(
                [*arguments, '__name:=' + process.node.rpartition('/')[2]],  # an anonymous one would have another
                executable=process.executable,
                cwd=process.directory,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                start_new_session=True,
            )

    def _noting(self, ask: Callable[..., Any]) -> Callable[..., Any]:
        """A method of the master that notes which parameters the copy asks for."""

        def noted(caller: str, *arguments: str) -> Any:
            if caller == self._process.node:
                self.asked.add(rosgraph.names.resolve_name(arguments[-1], caller))
            return ask(caller, *arguments)

        return noted

    def _receive(self, message: Any, topic: str) -> None:
        if message._connection_header['callerid'] == self._process.node:
            self._received.append((time.monotonic(), topic, message._buff))

    def _wait_for_connections(self, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        while True:
            # an input that is also an output connects this process with itself
            missing = [
                topic
                for topics, others in ((self._inputs, self._outputs), (self._outputs, self._inputs))
                for topic, one in topics.items()
                if one.get_num_connections() < 1 + (topic in others)
            ] or sorted(self._outputs.keys() - self._sent_here())
            if not missing:
                return
            self._rest(0.01)
            if time.monotonic() > deadline:
                raise Failed(self._with_last_lines(f'does not connect to {", ".join(missing)} within {timeout:g} s'))

    def _sent_here(self) -> Set[str]:
        """The topics that the copy sends to this process. A connection counts here before a rospy node sends on it."""
        try:
            api: Any = xmlrpc.client.ServerProxy(self.master.lookupNode(self._process.node), _Transport())
            _, _, connections = api.getBusInfo(_NAME)
        except (OSError, rosgraph.MasterException, http.client.HTTPException, xmlrpc.client.Error):
            return set()
        return {topic for _, name, direction, _, topic, *_ in connections if (name, direction) == (_NAME, 'o')}

    def _rest(self, seconds: float) -> None:
        """Wait, and notice if the copy or the asking process ends."""
        if self._gone.poll(max(0.0, 1000 * seconds)):
            raise ParentGone
        if self.copy.poll() is not None:
            raise Failed(self._with_last_lines(f'has ended with status {self.copy.returncode}'))

    def _with_last_lines(self, what: str) -> str:
        lines = Path(self._output).read_text(encoding='utf-8', errors='replace').splitlines()[-_LAST_LINES:]
        return '\n'.join([f'the copy of {self._process.node} {what}', *lines])

    def play(self, messages: List[Tuple[float, str, bytes]], until: float) -> List[Tuple[float, str, bytes]]:
        """Do what `Twin.play` says."""
        begin = time.monotonic()
        for offset, topic, serialized in messages:
            self._rest(begin + offset - time.monotonic())
            message = self._inputs[topic].data_class()
            message._buff = serialized
            self._inputs[topic].publish(message)
        self._rest(begin + until - time.monotonic())
        count = len(self._received)
        answers = [(arrived - begin, topic, serialized) for arrived, topic, serialized in self._received[:count]]
        del self._received[:count]
        return answers

    def stop(self) -> None:
        """End the copy, and all that it has started."""
        self.copy.kill()
        self.copy.wait()
        while children := _children():  # what a process has started becomes a child of this one when it ends
            for child in children:
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)


def _children() -> List[int]:
    """The processes that this one has to wait for."""
    found = []
    for file in Path('/proc').glob('[0-9]*/stat'):
        with contextlib.suppress(OSError):  # ended meanwhile
            if int(file.read_text(encoding='utf-8', errors='replace').rpartition(')')[2].split()[1]) == os.getpid():
                found.append(int(file.parent.name))
    return found


def serve(directory: str, answer: Callable[[Tuple[str, Any]], None]) -> None:
    """Answer requests until the input closes."""
    requests = sys.stdin.buffer
    order = pickle.load(requests)
    try:
        laboratory = Laboratory(order, directory)
    except (Failed, NotBuilt, OSError) as failure:
        answer((str(failure), None))
        return
    answer(('', None))
    requests_of: Dict[str, Callable[..., Any]] = {
        'play': laboratory.play,
        'set': laboratory.master.setParam,
        'asked': lambda: sorted(laboratory.asked),
    }
    try:
        while True:
            name, *arguments = pickle.load(requests)
            try:
                answer(('', requests_of[name](*arguments)))
            except Failed as failure:
                answer((str(failure), None))
    finally:
        laboratory.stop()


def main() -> None:
    """Hold one twin."""
    if os.getpid() == 1:  # of a process namespace, and so of all others
        bring_up_loopback()
        hide_devices()
        tempfile.tempdir = '/dev/shm'
    _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    answers = os.fdopen(os.dup(1), 'wb')
    os.dup2(2, 1)  # what others print is no answer

    def answer(result: Tuple[str, Any]) -> None:
        pickle.dump(result, answers)
        answers.flush()

    try:
        with tempfile.TemporaryDirectory(prefix='rosslt_twin_') as directory, contextlib.suppress(
            EOFError, pickle.UnpicklingError, BrokenPipeError, ParentGone
        ):
            serve(directory, answer)
    except Exception:
        traceback.print_exc()
    os._exit(0)  # the threads of the master go on otherwise


if __name__ == '__main__':
    main()
