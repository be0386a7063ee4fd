"""The node of a name that runs already: ROS ends it when another one of that name starts."""

import os
import urllib.parse
from typing import List, Optional

import rosgraph
import rosgraph.network

from rosslt.node.slave_api import NO_NODE, slave

#: The state of a listening socket in /proc/net/tcp.
LISTENS = '0A'


def where_it_runs(name: str) -> Optional[str]:
    """Say where a node of a full name runs: its process, its machine, and on this one its command line and its folder;
    None if none answers."""
    try:
        uri = rosgraph.Master('/rosslt').lookupNode(name)
        pid = int(slave(uri).getPid('/rosslt')[2])
        address = urllib.parse.urlparse(uri)
        host, port = address.hostname or '', address.port or 0
    except NO_NODE:
        return None
    if not rosgraph.network.is_local_address(host):
        return f'process {pid} on {host}'
    try:
        return f'process {pid}' + (_command_of(pid) if _listens(pid, port) else f' on {host}')
    except OSError:  # it belongs to somebody else, or to a container
        return f'process {pid} on {host}'


def _command_of(pid: int) -> str:
    with open(f'/proc/{pid}/cmdline', 'rb') as file:
        words = os.fsdecode(file.read()).rstrip('\0').split('\0')
    return f' (`{" ".join(words)}` in {os.readlink(f"/proc/{pid}/cwd")})'


def _listens(pid: int, port: int) -> bool:
    """Return whether the process of that number here is the one that listens at a port: one in a container has a number
    of its own."""
    sockets: List[str] = []
    for table in ('tcp', 'tcp6'):
        with open(f'/proc/{pid}/net/{table}', encoding='ascii') as file:
            rows = [line.split() for line in file.readlines()[1:]]
        sockets += [f'socket:[{row[9]}]' for row in rows if row[3] == LISTENS and int(row[1][-4:], 16) == port]
    folder = f'/proc/{pid}/fd'
    return any(os.readlink(f'{folder}/{one}') in sockets for one in os.listdir(folder))
