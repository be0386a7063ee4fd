"""The ROS master: there at once, or not; and what it knows of nodes and topics."""

import contextlib
import http.client
import socket
import urllib.parse
import xmlrpc.client

import rosgraph

from rosslt.cli.failure import Failure

#: How long a master may take to answer, in seconds: no longer than a person waits without wondering.
TIMEOUT = 2.0

#: What tells a tracked node: the service at which it lists its locations.
_LISTING = '/rosslt/list_locations'

#: What asking a master may throw where there is none, or something else at its address.
_NO_MASTER = (OSError, rosgraph.MasterException, xmlrpc.client.Error, http.client.HTTPException, ValueError)


def find_master(timeout=TIMEOUT):
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
        with _default_timeout(timeout):
            found.getPid()
    except _NO_MASTER:
        raise Failure(f'found no ROS master at {uri}: is roscore running, and ROS_MASTER_URI right?') from None
    return found


def tracked_nodes(master):
    """The names of the nodes that have locations, sorted."""
    _, _, services = master.getSystemState()
    return sorted(name[: -len(_LISTING)] for name, _ in services if name.endswith(_LISTING))


def full_name(name):
    """The full name of a node or topic, in the namespace that ROS_NAMESPACE says."""
    return rosgraph.names.resolve_name(name, rosgraph.names.make_caller_id('rosslt'))


def split_topic(master, text):
    """TOPIC[/FIELD] as the longest topic that it begins with, and the rest.

    Returns:
        (topic, its type, field), with '' for no field.

    Raises:
        Failure: there is no such topic.
    """
    types = dict(master.getTopicTypes())
    # a field may have brackets, which a name may not
    path, bracket, index = text.partition('[')
    full = full_name(path) + bracket + index
    topic = max((name for name in types if is_below(full, name)), key=len, default=None)
    if topic is None or topic not in dict(master.getPublishedTopics('/')):
        raise Failure(f'nobody publishes {full if topic is None else topic}')
    return topic, types[topic], full[len(topic) :].lstrip('/.')


def is_below(path, name):
    """Whether a path is a name or begins with it and a separator."""
    return path == name or (path.startswith(name) and path[len(name)] in '/.[')


@contextlib.contextmanager
def _default_timeout(timeout):
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(timeout)
    try:
        yield
    finally:
        socket.setdefaulttimeout(before)
