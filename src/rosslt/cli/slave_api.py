"""Asks nodes by ROS's slave API whether they are Python, and for the types of their topics."""

import http.client
import urllib.parse
import xmlrpc.client
from types import MappingProxyType
from typing import Any, Mapping, NamedTuple, Tuple

import rosgraph

from rosslt.cli.master import NO_ANSWER, TIMEOUT, default_timeout


class About(NamedTuple):
    """A node, as it describes itself; all is empty if it does not answer."""

    server: str = ''
    """What its XML-RPC server calls itself: rospy's names Python, that of roscpp XMLRPC++."""
    published: Mapping[str, str] = MappingProxyType({})
    """{topic: the type with which the node publishes it}."""
    subscribed: Mapping[str, str] = MappingProxyType({})
    """{topic: the type with which the node subscribes to it}."""

    @property
    def is_python(self) -> bool:
        """True if it is known to be a Python program."""
        return 'Python' in self.server

    @property
    def is_other(self) -> bool:
        """True if it is known to be none."""
        return bool(self.server) and not self.is_python


def about(master: rosgraph.Master, node: str) -> About:
    """Ask a node."""
    try:
        with default_timeout(TIMEOUT):
            address = urllib.parse.urlparse(master.lookupNode(node))
        server, published = _call(address.netloc, 'getPublications')
        _, subscribed = _call(address.netloc, 'getSubscriptions')
    except (*NO_ANSWER, TypeError, IndexError):
        return About()
    return About(server, dict(published), dict(subscribed))


def other_type(topic: str, publisher: str, kept: str, said: Mapping[str, Mapping[str, str]]) -> str:
    """Say that a node sends a topic with another type than the master keeps, and who has said that one; '' if not.

    Args:
        kept: the type that the master keeps.
        said: {each publisher: its `About.published`}.
    """
    own = said[publisher].get(topic, kept)
    if own == kept:
        return ''
    others = [node for node, types in said.items() if types.get(topic) == kept]
    by = f'{" and ".join(others)} says' if others else 'a node has said that publishes it no more'
    mend = 'Have' if others else 'Start it again, and have'
    return (
        f'{publisher} sends it as {own}, but the master knows it as {kept}, as {by}: who goes by the master, as RViz '
        f'does, gets nothing of it. {mend} all nodes use one type, or another topic'
    )


def _call(address: str, method: str) -> Tuple[str, Any]:
    """(What the server at an address calls itself, what it answers)."""
    connection = http.client.HTTPConnection(address, timeout=TIMEOUT)
    try:
        headers = {'Content-Type': 'text/xml'}
        connection.request('POST', '/RPC2', xmlrpc.client.dumps(('/rosslt',), method), headers)
        response = connection.getresponse()
        answer: Any = xmlrpc.client.loads(response.read())[0][0]
        return response.getheader('Server', ''), answer[2]
    finally:
        connection.close()
