"""The ROS master: whether it answers, what it knows of nodes and topics, and why a node does not answer."""

import contextlib
import http.client
import socket
import urllib.parse
import xmlrpc.client
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Tuple

import rosgraph

from rosslt.cli.failure import Failure, did_you_mean

#: Timeout for answers of a master or a node, and for connections to them, in seconds; a person is waiting.
TIMEOUT = 2.0

#: At which service a tracked node lists its locations.
LIST_SERVICE = '/rosslt/list_locations'

#: The exceptions of asking a master where nothing, or something else, answers at its address.
_NO_MASTER = (OSError, rosgraph.MasterException, xmlrpc.client.Error, http.client.HTTPException, ValueError)


def find_master(timeout: float = TIMEOUT) -> rosgraph.Master:
    """The ROS master.

    Raises:
        Failure: none answers.
    """
    uri = rosgraph.get_master_uri()
    found = rosgraph.Master('/rosslt')
    try:
        address = urllib.parse.urlparse(uri)
        # rosgraph waits for as long as TCP does: minutes for a machine that is off
        socket.create_connection((address.hostname, address.port), timeout).close()
        with default_timeout(timeout):
            found.getPid()
    except _NO_MASTER:
        raise Failure(f'found no ROS master at {uri}: is roscore running, and ROS_MASTER_URI right?') from None
    return found


class SystemState(NamedTuple):
    """Publishers, subscribers and servers known to a master: {topic or service: [node, ...]}."""

    publishers: Dict[str, List[str]]
    subscribers: Dict[str, List[str]]
    services: Dict[str, List[str]]

    @property
    def nodes(self) -> List[str]:
        """All nodes, sorted."""
        return sorted({node for part in self for nodes in part.values() for node in nodes})

    @property
    def tracked_nodes(self) -> List[str]:
        """The nodes that have locations, sorted."""
        return sorted(name[: -len(LIST_SERVICE)] for name in self.services if name.endswith(LIST_SERVICE))


def system_state(master: rosgraph.Master) -> SystemState:
    """Ask the master for its current publishers, subscribers and services."""
    return SystemState(*map(dict, master.getSystemState()))


def tracked_nodes(master: rosgraph.Master) -> List[str]:
    """The names of the nodes that have locations, sorted."""
    return system_state(master).tracked_nodes


def full_name(name: str) -> str:
    """The full name of a node or topic, in the namespace that ROS_NAMESPACE says."""
    return str(rosgraph.names.resolve_name(name, rosgraph.names.make_caller_id('rosslt')))


def split_topic(master: rosgraph.Master, text: str) -> Tuple[str, str, str]:
    """TOPIC[/FIELD] as the longest topic that it begins with, and the rest.

    Returns:
        (topic, its type, field), with '' for no field.

    Raises:
        Failure: there is no such topic, or nobody publishes it.
    """
    types = dict(master.getTopicTypes())
    published = dict(master.getPublishedTopics('/'))
    # a field may have brackets, which a name may not
    path, bracket, index = text.partition('[')
    full = full_name(path) + bracket + index
    topic = max((name for name in types if is_below(full, name)), key=len, default=None)
    if topic is None:
        raise Failure(f'nobody publishes {full}{did_you_mean("/".join(full.split("/")[:2]), published)}')
    if topic not in published:
        waiting = system_state(master).subscribers.get(topic, [])
        raise Failure(
            f'nobody publishes {topic}; the master keeps it as {types[topic]}'
            + (', which {} subscribe{} to'.format(' and '.join(waiting), 's' * (len(waiting) == 1)) if waiting else '')
        )
    return topic, types[topic], full[len(topic) :].lstrip('/.')


def is_below(path: str, name: str) -> bool:
    """Return True if a path equals a name or begins with the name and a separator."""
    return path == name or (path.startswith(name) and path[len(name)] in '/.[')


@contextlib.contextmanager
def default_timeout(timeout: float) -> Iterator[None]:
    """Have calls by XML-RPC, which take no timeout, end after so many seconds."""
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(timeout)
    try:
        yield
    finally:
        socket.setdefaulttimeout(before)


def has_ended(master: rosgraph.Master, node: str) -> bool:
    """Return True if a node has ended, although the master may still list it."""
    return all(problem is ConnectionRefusedError for _, problem, _ in _problems(master, node))


def problem_of(master: rosgraph.Master, node: str) -> Optional[str]:
    """Explain why a node's addresses cannot be reached and what to do about it; None if they can."""
    problems = _problems(master, node)
    if not problems:
        return 'the master does not know it: it has ended'
    if all(problem is ConnectionRefusedError for _, problem, _ in problems):
        return (
            f'nothing listens at its address {_shown(problems[0][0])} any more: it has been killed. '
            '`rosnode cleanup` has the master forget it'
        )
    for address, problem, text in problems:
        if problem is not None:
            return (
                f'it advertises the address {_shown(address)}, which cannot be reached from here ({text}): '
                'where it runs, set ROS_IP to an address that this machine reaches'
            )
    return None


def _problems(master: rosgraph.Master, node: str) -> List[Tuple[Tuple[str, int], Optional[type], str]]:
    """(address, the type of what a connection to it raises or None, its text) for each address of a node."""
    addresses = (_address(master.lookupNode, node), _address(master.lookupService, node + LIST_SERVICE))
    return [(address, *_problem(address)) for address in addresses if address is not None]


def _address(look_up: Callable[[str], str], name: str) -> Optional[Tuple[str, int]]:
    """(host, port) of what the master says of a name; None where it does not know it."""
    try:
        with default_timeout(TIMEOUT):
            address = urllib.parse.urlparse(look_up(name))
        return (address.hostname, address.port) if address.hostname and address.port else None
    except (OSError, rosgraph.MasterException, ValueError):
        return None


def _problem(address: Tuple[str, int]) -> Tuple[Optional[type], str]:
    """(the type of what a connection raises or None, its text)."""
    try:
        socket.create_connection(address, TIMEOUT).close()
    except OSError as error:
        return type(error), error.strerror or str(error)
    return None, ''


def _shown(address: Tuple[str, int]) -> str:
    return '{}:{}'.format(*address)
