"""Noticing parameters that are set: the master calls `paramUpdate` of every process that has subscribed to them.

rospy subscribes for `rospy.get_param_cached` alone, and tells nobody of what it hears. So this is an XML-RPC server of
its own, made of what rosgraph offers for that, and known to the master by a name of its own: two servers of one name
are taken for two nodes of that name, of which the master ends the first. Whoever sets a parameter under that name is
not told of it.
"""

import contextlib
import threading
from typing import Any, Callable, Dict, Tuple

import rosgraph
import rosgraph.xmlrpc
import rospy

from rosslt.node.no_master import NO_MASTER

#: The timeout of the server's start, in seconds.
START_TIMEOUT = 10.0


class ParameterUpdates:
    """Reports parameters that have been set.

    Args:
        name: what the server is called at the master, a full name that no node has.
        changed: called with (the parameter's full name, its value), in some thread; {} where it was deleted.

    Attributes:
        name: as given.

    Raises:
        rospy.ROSInitException: the server does not start.
    """

    def __init__(self, name: str, changed: Callable[[str, Any], None]) -> None:
        self.name = name
        handler = _Handler(changed)
        self._server = rosgraph.xmlrpc.XmlRpcNode(rpc_handler=handler)
        self._server.start()
        if not handler.is_ready.wait(START_TIMEOUT):
            raise rospy.ROSInitException(f'the XML-RPC server of {name} does not start')
        self._keys: Dict[str, None] = {}
        rospy.on_shutdown(self._end)

    def subscribe(self, master: rosgraph.Master, key: str) -> None:
        """Subscribe to changes of a key and of the keys below it."""
        rosgraph.Master(self.name, master_uri=master.master_uri).subscribeParam(self._server.uri, key)
        self._keys[key] = None

    def _end(self) -> None:
        """End all subscriptions: the master keeps them for ever."""
        with contextlib.suppress(*NO_MASTER):
            master = rosgraph.Master(self.name)
            for key in list(self._keys):
                master.unsubscribeParam(self._server.uri, key)
        self._server.shutdown('the node is shut down')


class _Handler(rosgraph.xmlrpc.XmlRpcHandler):
    """The methods that the master calls, named as in ROS's slave API."""

    def __init__(self, changed: Callable[[str, Any], None]) -> None:
        self._changed = changed
        self.is_ready = threading.Event()

    def _ready(self, uri: str) -> None:
        self.is_ready.set()

    def paramUpdate(self, _caller_id: str, key: str, value: Any) -> Tuple[int, str, int]:  # noqa: N802, the slave API's name
        """Somebody has set a parameter."""
        self._changed('/' + key.strip('/'), value)
        return 1, '', 0

    def shutdown(self, _caller_id: str, _reason: str = '') -> Tuple[int, str, int]:
        """Ignore the master's request to shut down, which it also sends to the node itself."""
        return 1, '', 0
