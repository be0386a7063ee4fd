"""The master's parameter server: reading and setting parameters, and hearing of those that others set.

rospy subscribes to parameters for `rospy.get_param_cached` alone, and tells nobody of what it hears. So this is an
XML-RPC server of its own, known to the master by a name of its own: two servers of one name are taken for two nodes of
that name, of which the master ends the first. Whoever sets a parameter under that name is not told of it.
"""

import contextlib
import json
import threading
from typing import Any, Callable, Dict, List, Mapping, Sequence, Tuple, Union
from xml.parsers.expat import ExpatError
from xmlrpc.client import MultiCall, dumps, loads

import rosgraph
import rosgraph.xmlrpc
import rospy

from rosslt.messages import Scalar
from rosslt.node.json_scalars import Refused
from rosslt.node.no_master import NO_MASTER
from rosslt.node.rospy_internals import add_shutdown_hook, cached_parameters

#: The timeout of the start of the XML-RPC server, in seconds.
START_TIMEOUT = 10.0

#: A value of a parameter, or a tree of them.
Tree = Union[None, Scalar, Sequence['Tree'], Mapping[str, 'Tree']]


class ParameterServer:
    """The parameter server, as one node uses it.

    Args:
        changed: called with the full name of a parameter that somebody else has set or deleted, in some thread.
    """

    def __init__(self, changed: Callable[[str], None]) -> None:
        self._handler = _Handler(changed)
        self._xmlrpc = rosgraph.xmlrpc.XmlRpcNode(rpc_handler=self._handler)
        self._masters = threading.local()
        self._name = ''
        self._heard: Dict[str, None] = {}  # keys that are subscribed to, with all below them

    def start(self, name: str) -> None:
        """Begin to hear of changes, once this process is a node.

        Args:
            name: a full name that no node has.

        Raises:
            rospy.ROSInitException: the XML-RPC server does not start.
        """
        self._xmlrpc.start()
        if not self._handler.is_ready.wait(START_TIMEOUT):
            raise rospy.ROSInitException(f'the XML-RPC server of {name} does not start')
        self._name = name
        add_shutdown_hook(self._end)

    @property
    def master(self) -> rosgraph.Master:
        """The master; XML-RPC's connections serve one thread each."""
        if not hasattr(self._masters, 'own'):
            self._masters.own = rosgraph.Master(rospy.get_name())
        return self._masters.own

    def subscribe(self, key: str) -> None:
        """Hear of changes of a key and of the keys below it, once this has been started."""
        if self._name and not any(is_within(key, heard) for heard in self._heard):
            rosgraph.Master(self._name).subscribeParam(self._xmlrpc.uri, key)
            self._heard[key] = None

    def subscribe_again(self) -> None:
        """Subscribe to all at a new master."""
        heard, self._heard = self._heard, {}
        for key in heard:
            self.subscribe(key)

    def _end(self, _reason: str) -> None:
        """Unsubscribe, also from what rospy has subscribed to for its cache and its log.

        Otherwise the master keeps the subscriptions and, at the next node of the name, shuts down whichever process
        has got the address by then.
        """
        with contextlib.suppress(*NO_MASTER):
            for name, uri, keys in (
                (self._name, self._xmlrpc.uri, list(self._heard)),
                (rospy.get_name(), rospy.get_node_uri(), cached_parameters()),
            ):
                calls: Any = MultiCall(self.master.handle)
                for key in keys:
                    calls.unsubscribeParam(name, uri, key)
                if keys:
                    calls()
        self._xmlrpc.shutdown('the node is shut down')

    def get(self, key: str) -> Tree:
        """Read a parameter or a tree of them; None if it is not set."""
        with contextlib.suppress(rosgraph.MasterError):
            return self.master.getParam(key)
        return None

    def names(self) -> List[str]:
        """The full names of all parameters; of a tree of them, those of its leaves."""
        return list(self.master.getParamNames())

    def exchange(self, key: str, value: Tree) -> Tree:
        """Set a parameter; returns what it said until then, None if it was not set."""
        calls: Any = MultiCall(self.master.handle)
        calls.getParam(self._name, key)
        calls.setParam(self._name, key, value)
        (code, _, stood), (is_set, message, _) = calls()
        if is_set != 1:
            rospy.logwarn('the parameter %s is not set: %s', key, message)
        return stood if code == 1 else None

    def set(self, pairs: List[Tuple[str, Tree]]) -> None:
        """Set parameters to values that can be sent, all in one call of the master."""
        calls: Any = MultiCall(self.master.handle)
        for key, value in pairs:
            calls.setParam(self._name, key, value)
        for (key, _), (code, message, _) in zip(pairs, calls() if pairs else ()):
            if code != 1:
                rospy.logwarn('the parameter %s is not set: %s', key, message)

    def delete(self, key: str) -> None:
        """Delete a parameter or a tree of them, if there is one."""
        with contextlib.suppress(rosgraph.MasterError):
            self.master.deleteParam(key)


class _Handler(rosgraph.xmlrpc.XmlRpcHandler):
    """The methods that the master calls, named as in ROS's slave API."""

    def __init__(self, changed: Callable[[str], None]) -> None:
        self._changed = changed
        self.is_ready = threading.Event()

    def _ready(self, uri: str) -> None:
        self.is_ready.set()

    def paramUpdate(self, _caller_id: str, key: str, _value: Tree) -> Tuple[int, str, int]:  # noqa: N802, the slave API's name
        """Somebody has set or deleted a parameter."""
        self._changed('/' + key.strip('/'))
        return 1, '', 0

    def shutdown(self, _caller_id: str, _reason: str = '') -> Tuple[int, str, int]:
        """Ignore the master's request to shut down, which it also sends to the node itself."""
        return 1, '', 0


def as_sent(value: Any) -> Any:
    """A value of a parameter as the master gets it.

    Raises:
        Refused: it cannot be sent: XML-RPC's whole numbers have 32 bits, and XML has no control characters.
    """
    try:
        return loads(dumps((value,)).encode('utf-8'))[0][0]
    except (OverflowError, TypeError, ValueError, ExpatError) as error:
        raise Refused(f'the parameter server cannot hold {value!r}: {error}') from None


def as_shown(value: Tree) -> Tree:
    """A scalar as a parameter shows it: as it is sent, or else as JSON."""
    try:
        return as_sent(value)
    except Refused:
        return json.dumps(value)


def is_sent_alike(one: Any, other: Any) -> bool:
    """Return whether two values are equal when sent to the master; False if one cannot be sent."""
    try:
        return dumps((one,), allow_none=True) == dumps((other,), allow_none=True)
    except (OverflowError, TypeError, ValueError):
        return False


def is_within(key: str, namespace: str) -> bool:
    """Return whether the parameter `key` is `namespace` itself or below it."""
    return key == namespace or key.startswith(namespace.rstrip('/') + '/')


def is_related(one: str, other: str) -> bool:
    """Return whether two parameters are the same, or one is below the other."""
    return is_within(one, other) or is_within(other, one)


def part_of(tree: Tree, key: str) -> Tree:
    """The part of a tree of parameters that has that name; None if there is none."""
    for step in key.split('/'):
        if step:
            tree = tree.get(step) if isinstance(tree, dict) else None
    return tree


def element_of(tree: Tree, key: str) -> Tree:
    """`part_of`, which finds elements of lists, too."""
    for step in filter(None, key.split('/')):
        if isinstance(tree, list):
            tree = tree[int(step)] if step.isdigit() and int(step) < len(tree) else None
        else:
            tree = part_of(tree, step)
    return tree


def with_part(tree: Tree, key: str, value: Tree) -> Tree:
    """A copy of a tree of parameters with another part of that name, or without it if the value is None."""
    first, _, rest = key.lstrip('/').partition('/')
    if not first:
        return value
    copied = dict(tree) if isinstance(tree, dict) else {}
    part = with_part(copied.get(first), rest, value)
    if part is not None:
        copied[first] = part
    else:
        copied.pop(first, None)
    return copied if copied or isinstance(tree, dict) else tree
