"""Calling a service of several nodes at once, within a timeout, which rospy's own calls do not have."""

import errno
import os
import threading
import time
from typing import Any, Dict, Tuple

import rospy

from rosslt.messages import Message, MessageClass

#: The period in which a waiting call checks whether this node is shutting down, in seconds.
SHUTDOWN_CHECK_PERIOD = 0.1

#: Why there is no response of a node that hangs, or is too slow.
NO_ANSWER = 'no answer within the timeout'


def ask_all(
    service: str, service_class: MessageClass, requests: Dict[str, Message], timeout: float
) -> Tuple[Dict[str, Message], Dict[str, str]]:
    """Call `<node>/rosslt/<service>` of several nodes.

    Args:
        requests: {node: request}.
        timeout: for all together, in seconds.

    Returns:
        ({node: response}, {node: why there is none}).

    Raises:
        rospy.ROSInterruptException: this node is being shut down.
    """
    deadline = time.monotonic() + timeout
    calls = [_Call(node, f'{node}/rosslt/{service}', service_class, request) for node, request in requests.items()]
    answers: Dict[str, Message] = {}
    silent: Dict[str, str] = {}
    for call in calls:
        try:
            answers[call.node] = call.result(deadline)
        except rospy.ServiceException as error:
            silent[call.node] = str(error)
    return answers, silent


def call_service(service: str, service_class: MessageClass, request: Message, timeout: float) -> Message:
    """Call a service by its full name; returns its response.

    Raises:
        rospy.ServiceException: there is none, or none within the timeout, in seconds.
        rospy.ROSInterruptException: this node is being shut down.
    """
    return _Call(service, service, service_class, request).result(time.monotonic() + timeout)


def has_ended(reason: str) -> bool:
    """Return whether there is no response because the node has ended: nothing listens there, or no master knows it."""
    return os.strerror(errno.ECONNREFUSED) in reason or reason.endswith('] unavailable')


class _Call(threading.Thread):
    """A service call that runs in its own thread."""

    def __init__(self, node: str, service: str, service_class: MessageClass, request: Message) -> None:
        super().__init__(name='rosslt call of ' + node, daemon=True)
        self.node = node
        self._request = request
        # Persistent only so that the connection can be closed from outside if nobody answers.
        self._proxy = rospy.ServiceProxy(service, service_class, persistent=True)
        self._done = threading.Event()
        self._response: Message = None
        self._error: Any = None
        self.start()

    def run(self) -> None:
        try:
            self._response = self._proxy(self._request)
        except Exception as error:  # the waiting thread handles every exception of rospy and the network
            self._error = error
        finally:
            self._done.set()
            self._proxy.close()

    def result(self, deadline: float) -> Message:
        """The response, once it is there.

        Raises:
            rospy.ServiceException: there is none, or none in time.
            rospy.ROSInterruptException: this node is being shut down.
        """
        while not self._done.wait(min(SHUTDOWN_CHECK_PERIOD, max(0.0, deadline - time.monotonic()))):
            if rospy.is_shutdown():
                raise rospy.ROSInterruptException('shut down while waiting for ' + self.node)
            if time.monotonic() >= deadline:
                self._proxy.close()
                raise rospy.ServiceException(NO_ANSWER)
        if self._error is not None:
            raise rospy.ServiceException(str(self._error))
        return self._response
