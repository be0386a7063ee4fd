"""Two machines: network namespaces of Linux, joined by a cable that can be pulled."""

import itertools
import os
import subprocess
from typing import Any, Dict, List

import pytest

_numbers = itertools.count()

#: How long one command on a machine may take, in seconds.
TIME_LIMIT = 60


class Machine:
    """A machine of its own address, with what is started on it.

    Attributes:
        address: the address that the other machine reaches.
    """

    def __init__(self, namespace: str, device: str, address: str) -> None:
        self._namespace, self._device = namespace, device
        self.address = address
        self.environment: Dict[str, str] = {}
        self.started: List[subprocess.Popen] = []
        ip('netns', 'add', namespace)

    def connect(self) -> None:
        """Give the end of the cable its address."""
        ip('-n', self._namespace, 'addr', 'add', self.address + '/30', 'dev', self._device)
        self.set_link('up')
        ip('-n', self._namespace, 'link', 'set', 'lo', 'up')

    def set_link(self, state: str) -> None:
        """Plug the cable in, `up`, or pull it, `down`."""
        ip('-n', self._namespace, 'link', 'set', self._device, state)

    def start(self, *command: str, **options: Any) -> subprocess.Popen:
        """Start a command here; options are those of Popen."""
        environment = {**os.environ, 'ROS_IP': self.address, **self.environment, **options.pop('environment', {})}
        environment.pop('ROS_HOSTNAME' if environment['ROS_IP'] else 'ROS_IP', None)  # rospy prefers ROS_HOSTNAME
        process = subprocess.Popen(
            ['ip', 'netns', 'exec', self._namespace, *command],
            env={name: value for name, value in environment.items() if value},
            text=True,
            **{'stdin': subprocess.DEVNULL, 'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, **options},
        )
        self.started.append(process)
        return process

    def run(self, *command: str, **options: Any) -> subprocess.CompletedProcess:
        """Run a command here to its end."""
        process = self.start(*command, **options)
        output, errors = process.communicate(timeout=TIME_LIMIT)
        return subprocess.CompletedProcess(command, process.returncode, output, errors)

    def remove(self) -> None:
        """End everything here."""
        for process in self.started:
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout, process.stderr):
                if stream is not None:
                    stream.close()
        ip('netns', 'del', self._namespace)


class Network:
    """Two machines and the cable between them; removed with everything on them when it is left."""

    def __init__(self) -> None:
        number, name = next(_numbers), f'rs{os.getpid()}'
        try:
            self.here = Machine(f'{name}here{number}', f'h{os.getpid()}', '10.213.77.1')
        except PermissionError as error:
            pytest.skip(f'the kernel lets this process make no network namespaces: {error}')
        self.there = Machine(f'{name}there{number}', f't{os.getpid()}', '10.213.77.2')
        ends = [self.here._device, 'netns', self.here._namespace]
        ip('link', 'add', *ends, 'type', 'veth', 'peer', 'name', self.there._device, 'netns', self.there._namespace)
        for machine in (self.here, self.there):
            machine.connect()

    def pull(self) -> None:
        """Pull the cable."""
        self.there.set_link('down')

    def plug(self) -> None:
        """Plug it in again."""
        self.there.set_link('up')

    def __enter__(self) -> 'Network':
        return self

    def __exit__(self, *_: object) -> None:
        self.there.remove()
        self.here.remove()


def ip(*arguments: str) -> None:
    """Run `ip`.

    Raises:
        PermissionError: this process may not.
    """
    result = subprocess.run(['ip', *arguments], capture_output=True, text=True, check=False)
    if 'not permitted' in result.stderr or 'Permission denied' in result.stderr:
        raise PermissionError(result.stderr.strip())
    assert result.returncode == 0, f'ip {" ".join(arguments)}: {result.stderr}'
