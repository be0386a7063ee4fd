"""ROS's slave API: what nodes say of themselves."""

import xmlrpc.client
from concurrent.futures import ThreadPoolExecutor
from http.client import HTTPConnection
from typing import Any, Dict, Iterable, Mapping, Optional, Sequence

import rosgraph

from rosslt.node.no_master import NO_MASTER

#: The time that a node has to answer, in seconds.
TIMEOUT = 2.0

#: The exceptions of asking a node, if nothing, or something else, answers at its address.
NO_NODE = (*NO_MASTER, ValueError, TypeError, IndexError)


class _Transport(xmlrpc.client.Transport):
    def make_connection(self, host: Any) -> HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = TIMEOUT
        return connection


def slave(uri: str) -> Any:
    """The proxy of the node at an address; its methods raise NO_NODE."""
    return xmlrpc.client.ServerProxy(uri, transport=_Transport())


def pid_of(master: rosgraph.Master, node: str) -> Optional[int]:
    """The process of a node, as it says itself; None if it does not answer.

    Args:
        master: the ROS master.
        node: its full name.
    """
    try:
        return int(slave(master.lookupNode(node)).getPid('/rosslt')[2])
    except NO_NODE:
        return None


def published_types(nodes: Iterable[str]) -> Dict[str, Dict[str, str]]:
    """Ask nodes for {topic: the type with which the node publishes it}; {} of a node that does not answer."""
    names = sorted(set(nodes))
    if not names:
        return {}
    with ThreadPoolExecutor(len(names)) as each:  # else each one that hangs would take TIMEOUT
        return dict(zip(names, each.map(_published_types, names)))


def _published_types(name: str) -> Dict[str, str]:
    try:
        return dict(slave(rosgraph.Master('/rosslt').lookupNode(name)).getPublications('/rosslt')[2])
    except NO_NODE:
        return {}


def sent_types(kept: Mapping[str, str], publishers: Mapping[str, Sequence[str]]) -> Dict[str, str]:
    """The types with which topics are sent.

    The master keeps what the last node has said that has advertised a topic, also after that node has ended. If no
    publisher says so, its type is what the first one says, in the order of their names.

    Args:
        kept: {topic: type}, as the master keeps them.
        publishers: {topic: [node, ...]}; may have more topics.

    Returns:
        {topic: type} of the topics in `kept`.
    """
    said = published_types(node for topic in kept for node in publishers.get(topic, ()))
    found = {}
    for topic, type_ in kept.items():
        own = [said[node].get(topic, '') for node in sorted(publishers.get(topic, ()))]
        own = [one for one in own if '/' in one]  # '*' is any type
        found[topic] = type_ if type_ in own or not own else own[0]
    return found
