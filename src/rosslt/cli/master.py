"""The ROS master: whether it answers, what it knows of nodes and topics, and why a node does not answer."""

import contextlib
import http.client
import socket
import urllib.parse
import xmlrpc.client
from typing import Dict, Iterator, List, NamedTuple, Optional, Tuple

import rosgraph
import rosgraph.network

from rosslt import messages
from rosslt.cli.failure import Failure, did_it_begin_with

#: Timeout for answers of a master or a node, and for connections to them, in seconds; a person is waiting.
TIMEOUT = 2.0

#: At which service a tracked node lists its locations.
LIST_SERVICE = '/rosslt/list_locations'

#: The exceptions of asking a master, or a node, if nothing, or something else, answers at its address.
NO_ANSWER = (OSError, rosgraph.MasterException, xmlrpc.client.Error, http.client.HTTPException, ValueError)


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
    except NO_ANSWER:
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


def full_field(text: str) -> str:
    """TOPIC[/FIELD] with the full name of the topic: a field may have brackets, which a name may not."""
    path, bracket, index = text.partition('[')
    return full_name(path) + bracket + index


def split_topic(master: rosgraph.Master, text: str) -> Tuple[str, str, str]:
    """Split TOPIC[/FIELD] into the longest topic that it begins with, and the field.

    Returns:
        (topic, its type, field), with '' for no field.

    Raises:
        Failure: there is no such topic, or nobody publishes it.
    """
    types = dict(master.getPublishedTopics('/'))
    full = full_field(text)
    topic = messages.topic_in(full, types)
    if topic is None:
        meant = did_it_begin_with(full, [name for name in types if not name.startswith('/rosout')])
        raise Failure(f'nobody publishes {full}{meant}')
    return topic, types[topic], full[len(topic) :].lstrip('/.')


@contextlib.contextmanager
def default_timeout(timeout: float) -> Iterator[None]:
    """Have calls by XML-RPC, which take no timeout, end after so many seconds."""
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(timeout)
    try:
        yield
    finally:
        socket.setdefaulttimeout(before)


def problem_of(master: rosgraph.Master, node: str) -> Optional[str]:
    """Explain why a node's addresses cannot be reached and what to do about it; None if they can."""
    found = _connections(master, node)
    if not found:
        return 'the master does not know it: it has ended'
    address, error = next((one for one in found.items() if one[1] is not None), ('', None))
    if error is None:
        return None
    if _is_refused(found):
        return (
            f'nothing listens at its address {address} any more: it has been killed. '
            '`rosnode cleanup` has the master forget it'
        )
    return (
        f'it advertises the address {address}, which cannot be reached from here ({error.strerror or error}): '
        'where it runs, set ROS_IP to an address that this machine reaches'
    )


def _is_refused(found: Dict[str, Optional[OSError]]) -> bool:
    return all(isinstance(error, ConnectionRefusedError) for error in found.values())


def _connections(master: rosgraph.Master, node: str) -> Dict[str, Optional[OSError]]:
    """{address: what a connection to it raises, or None} of a node, as the master knows it."""
    found: Dict[str, Optional[OSError]] = {}
    # without it, the service would warn of a connection that ended before its header came
    probe = {'probe': '1', 'md5sum': '*', 'callerid': master.caller_id, 'service': node + LIST_SERVICE}
    for look_up, name in ((master.lookupNode, node), (master.lookupService, node + LIST_SERVICE)):
        try:
            with default_timeout(TIMEOUT):
                address = urllib.parse.urlparse(look_up(name))
            host, port = address.hostname, address.port
        except (OSError, rosgraph.MasterException, ValueError):
            continue
        if host and port:
            found[address.netloc] = None
            try:
                with socket.create_connection((host, port), TIMEOUT) as connection:
                    if look_up == master.lookupService:
                        rosgraph.network.write_ros_handshake_header(connection, probe)
            except OSError as error:
                found[address.netloc] = error
    return found
