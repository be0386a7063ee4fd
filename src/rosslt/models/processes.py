"""The process of a running node: what starts a copy of it, and what a copy would take from it."""

import contextlib
import os
import re
import urllib.parse
import xmlrpc.client
from pathlib import Path
from typing import Dict, Iterator, List, Mapping, NamedTuple, Optional, Set, Tuple

import rosgraph
import rosgraph.network

#: The devices that any number of processes use at the same time.
_SHARED_DEVICES = re.compile(r'/dev/(null|zero|full|random|urandom|tty|ptmx|console|pts/.*|shm/.*)')

#: The state of a listening socket in /proc/PID/net/tcp.
_LISTENING = '0A'


class NotCopied(Exception):
    """There can be no copy of a node; the text says why."""


class LiveProcess(NamedTuple):
    """The process of a running node."""

    node: str
    """The node's full name."""
    pid: int
    executable: str
    """The path of the program: for a script, that of its interpreter."""
    arguments: Tuple[str, ...]
    """All arguments with which it was started, its own name first, remappings among them."""
    environment: Mapping[str, str]
    directory: str
    """Its working directory."""
    subscribed: Mapping[str, str]
    """{topic: its type}."""
    published: Mapping[str, str]
    """{topic: its type}."""


def live_process(master: rosgraph.Master, node: str) -> LiveProcess:
    """Find the process of a node.

    Args:
        node: its full name.

    Raises:
        NotCopied: the node is unknown, has ended, runs on another machine, is another user's or a nodelet, or holds
            what a copy would take from it: a device, a listening port that is not ROS's, a lock.
        OSError: the master does not answer.
    """
    try:
        address = master.lookupNode(node)
    except rosgraph.MasterError:
        raise NotCopied(f'the master knows no node {node}') from None
    host, port = urllib.parse.urlparse(address).hostname or '', urllib.parse.urlparse(address).port
    try:
        if not rosgraph.network.is_local_address(host):
            raise NotCopied(f'{node} runs on another machine, {host}')
        api = xmlrpc.client.ServerProxy(address)
        pid, published, subscribed = (
            getattr(api, method)('/rosslt')[2] for method in ('getPid', 'getPublications', 'getSubscriptions')
        )
    except (OSError, xmlrpc.client.Error):
        raise NotCopied(f'{node} does not answer at {address}: it has ended, or is cut off') from None
    process = Path('/proc', str(pid))
    try:
        if process.stat().st_uid != os.geteuid():
            raise NotCopied(f'{node} is a process of another user, {process.owner()}')
        arguments = tuple(_texts(process / 'cmdline'))
        environment = dict(text.split('=', 1) for text in _texts(process / 'environ') if '=' in text)
        _refuse_nodelet(node, arguments)
        held = [
            *_devices_and_lock_files(process),
            *_locks(process, pid),
            *_ports(process, _ros_ports(master, node, port)),
        ]
        if held:
            raise NotCopied(f'{node} holds what a copy would take from it: {", ".join(dict.fromkeys(held))}')
        executable, directory = os.readlink(process / 'exe'), os.readlink(process / 'cwd')
    except FileNotFoundError:
        raise NotCopied(f'{node} has ended, or runs in another container: there is no process {pid}') from None
    except PermissionError as error:
        raise NotCopied(f'{node} does not let itself be read: {error}') from None
    return LiveProcess(node, pid, executable, arguments, environment, directory, dict(subscribed), dict(published))


def _texts(file: Path) -> List[str]:
    """The texts of a file in which each ends with a zero byte."""
    return [os.fsdecode(text) for text in file.read_bytes().split(b'\0')[:-1]]


def _refuse_nodelet(node: str, arguments: Tuple[str, ...]) -> None:
    if os.path.basename(arguments[0]) != 'nodelet' or len(arguments) < 2:
        return
    if arguments[1] == 'load' and len(arguments) > 3:
        raise NotCopied(f'{node} is a nodelet in the manager {arguments[3]}')
    if arguments[1] == 'manager':
        raise NotCopied(f'{node} is a manager of nodelets, which others load into it')


def _open_files(process: Path) -> Iterator[Tuple[Path, str]]:
    """(The entry in /proc, what it refers to) of each open file."""
    for entry in (process / 'fd').iterdir():
        with contextlib.suppress(FileNotFoundError):  # closed meanwhile
            yield entry, os.readlink(entry)


def _devices_and_lock_files(process: Path) -> Iterator[str]:
    for _, path in _open_files(process):
        if path.startswith('/dev/') and not _SHARED_DEVICES.fullmatch(path):
            yield 'the device ' + path
        elif path.endswith('.lock'):
            yield 'the lock file ' + path


def _locks(process: Path, pid: int) -> Iterator[str]:
    held = set()
    for line in Path('/proc/locks').read_text(encoding='ascii').splitlines():
        words = line.replace('-> ', '').split()
        if words[4] == str(pid) and '->' not in line:
            held.add(int(words[5].split(':')[2]))
    for entry, path in _open_files(process):
        with contextlib.suppress(FileNotFoundError):
            if entry.stat().st_ino in held:
                yield 'a lock on ' + path


def _ros_ports(master: rosgraph.Master, node: str, own: Optional[int]) -> Set[Optional[int]]:
    """The ports on which a node listens for other nodes: that of its slave API, and that of topics and services."""
    ports = {own}
    _, _, services = master.getSystemState()
    for service, providers in services:
        if node in providers:
            with contextlib.suppress(rosgraph.MasterError):  # withdrawn meanwhile
                ports.add(urllib.parse.urlparse(master.lookupService(service)).port)
    return ports


def _ports(process: Path, known: Set[Optional[int]]) -> Iterator[str]:
    listening: Dict[str, int] = {}
    for family in ('tcp', 'tcp6'):
        with contextlib.suppress(FileNotFoundError):  # a system without IPv6
            for line in (process / 'net' / family).read_text(encoding='ascii').splitlines()[1:]:
                words = line.split()
                if words[3] == _LISTENING:
                    listening[f'socket:[{words[9]}]'] = int(words[1].rpartition(':')[2], 16)
    for _, path in _open_files(process):
        if path in listening and listening[path] not in known:
            yield f'the port {listening[path]}'
