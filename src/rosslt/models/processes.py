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
import rospy

#: The devices that any number of processes use at the same time.
_SHARED_DEVICES = re.compile(r'/dev/(null|zero|full|random|urandom|tty|ptmx|console|pts/.*|shm/.*)')

#: The states in /proc/PID/net of sockets that take what anybody sends: one that listens, and one without a peer.
_TAKING = {'tcp': '0A', 'tcp6': '0A', 'udp': '07', 'udp6': '07'}


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
            what a copy would take from it: a device, a port or socket that is not ROS's, a lock; or its program or
            folder is gone, or it takes messages of any type.
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
        _refuse_any_type(node, {**dict(subscribed), **dict(published)})
        ports = _ports(process)
        if port not in ports:
            raise NotCopied(f'{node} runs in another container: the process {pid} is another one here')
        held = [
            *_devices_and_lock_files(process),
            *_locks(process),
            *(f'the port {one}' for one in ports if one not in _ros_ports(master, node, port)),
            *_unix_sockets(process),
        ]
        if held:
            raise NotCopied(f'{node} holds what a copy would take from it: {", ".join(dict.fromkeys(held))}')
        executable, directory = os.readlink(process / 'exe'), os.readlink(process / 'cwd')
        for path in (executable, directory):
            if not os.path.exists(path):
                raise NotCopied(f'{node} was started from what is no longer there: {path}')
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


def _refuse_any_type(node: str, types: Mapping[str, str]) -> None:
    for topic, name in types.items():
        if name == rospy.AnyMsg._type:
            raise NotCopied(f'{node} takes messages of any type on {topic}, and does not say which')


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


def _locks(process: Path) -> Iterator[str]:
    for entry, path in _open_files(process):
        with contextlib.suppress(FileNotFoundError):
            if '\nlock:' in (process / 'fdinfo' / entry.name).read_text(encoding='ascii'):
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


def _ports(process: Path) -> List[int]:
    """The ports on which a process takes what anybody sends, without those of UDP that the system chooses for who asks
    for none: each roscpp node has one, and a copy gets another."""
    first, last = map(int, Path('/proc/sys/net/ipv4/ip_local_port_range').read_text(encoding='ascii').split())
    taking: Dict[str, int] = {}
    for family, state in _TAKING.items():
        for words in _net(process, family):
            port = int(words[1].rpartition(':')[2], 16)
            if words[3] == state and not (family.startswith('udp') and first <= port <= last):
                taking[f'socket:[{words[9]}]'] = port
    return [taking[path] for _, path in _open_files(process) if path in taking]


def _unix_sockets(process: Path) -> Iterator[str]:
    names = {f'socket:[{words[6]}]': words[7] for words in _net(process, 'unix') if len(words) > 7}
    for _, path in _open_files(process):
        if path in names:
            yield 'the socket ' + names[path]


def _net(process: Path, family: str) -> Iterator[List[str]]:
    """The words of each line on sockets of a family; none on a system without it."""
    with contextlib.suppress(FileNotFoundError):
        for line in (process / 'net' / family).read_text(encoding='utf-8', errors='replace').splitlines()[1:]:
            yield line.split(maxsplit=7 if family == 'unix' else -1)
