"""Why a node does not answer: it was killed, or its address cannot be reached from here."""

import socket
import urllib.parse
from typing import Callable, List, Optional, Tuple

import rosgraph

from rosslt.cli.master import LIST_SERVICE, default_timeout

#: Timeout for a connection to a node, in seconds.
_TIMEOUT = 1.0


def why_unreachable(master: rosgraph.Master, node: str, reason: str) -> str:
    """Why a node did not answer, and what to do.

    Args:
        master: knows the node's addresses.
        node: its full name.
        reason: the answer if the node can be reached all the same.
    """
    return problem_of(master, node) or reason


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
        with default_timeout(_TIMEOUT):
            address = urllib.parse.urlparse(look_up(name))
        return (address.hostname, address.port) if address.hostname and address.port else None
    except (OSError, rosgraph.MasterException, ValueError):
        return None


def _problem(address: Tuple[str, int]) -> Tuple[Optional[type], str]:
    """(the type of what a connection raises or None, its text)."""
    try:
        socket.create_connection(address, _TIMEOUT).close()
    except OSError as error:
        return type(error), error.strerror or str(error)
    return None, ''


def _shown(address: Tuple[str, int]) -> str:
    return '{}:{}'.format(*address)
