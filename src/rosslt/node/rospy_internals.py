"""All private parts of rospy that rosslt uses, and why: rospy offers no public way.

Nothing else in the package reaches into `rospy.impl`, `rospy.core` or `rospy.msg`. A test imports each of these
names and says which one is gone, so that a change of rospy is seen before a robot runs with it.
"""

import os
import signal
import threading
import time
import weakref
from types import FrameType
from typing import Any, Callable, List, Optional, Set, Tuple

import rospy.core
import rospy.impl.masterslave
import rospy.impl.paramserver
import rospy.impl.registration
import rospy.impl.tcpros_pubsub
import rospy.impl.tcpros_service
import rospy.msg
import rospy.timer
import rospy.topics

#: Publisher and service handlers take messages as rospy takes them: as one, as fields in order, or by name.
args_kwds_to_message = rospy.msg.args_kwds_to_message

#: Converts the return value of a service handler (a tuple, a dict, a response) to a response.
convert_return_to_response = rospy.impl.tcpros_service.convert_return_to_response

#: Returns whether `init_node` was called, by rospy or rosslt.
is_initialized = rospy.core.is_initialized

#: Returns whether this node ends or has ended. rospy closes its topics before `is_shutdown` says so.
is_shutdown_requested = rospy.core.is_shutdown_requested

#: Its functions are called when this node has been unregistered, before rospy waits for its threads.
add_shutdown_hook = rospy.core.add_shutdown_hook

#: The managers that register this node's publishers, subscribers and services again after a restart of the master.
Registration = rospy.impl.registration.Registration
get_registration_listeners = rospy.impl.registration.get_registration_listeners
get_service_manager = rospy.impl.registration.get_service_manager
get_topic_manager = rospy.impl.registration.get_topic_manager

#: The functions that hold a lock which rospy's shutdown also takes, and which is not reentrant: a call of the master,
#: and the hand-over of a message to a slow connection.
ask_master = rospy.core._LockedServerProxy._ServerProxy__request
hand_over = rospy.impl.tcpros_pubsub.QueuedConnection.write_data

#: rospy's signal handler, which shuts down the node at any point of the main thread.
shut_down_at_signal = rospy.core._ros_signal

#: The delay before a signal that came while such a lock was held is sent again, in seconds.
_SIGNALLED_AGAIN = 0.02

#: Connects the subscriber of a topic to one publisher, unless it is connected already.
connect_to_publisher = rospy.impl.masterslave.ROSHandler._connect_topic

#: Adds an established connection to a publisher to a topic that this process subscribes to.
add_connection = rospy.topics._SubscriberImpl.add_connection

#: What a Timer's thread runs. It reads the attributes below anew for each call.
run_timer = rospy.timer.Timer.run
USED_OF_TIMERS = ('_callback',)

#: Calls a callback of a subscriber, and logs the exception that it raises.
invoke_callback = rospy.topics._SubscriberImpl._invoke_callback

#: {(topic, address of a publisher): held by who connects to it}.
_TURNS: Any = weakref.WeakValueDictionary()
_TURNS_LOCK = threading.Lock()

#: The attributes of rospy's implementation objects that `topics` uses. Under their lock, a publisher publishes a
#: replacement of a message, clears the buffer of a message that cannot be serialized, and sends the last message of a
#: latched topic again. A subscriber of a topic that this process already subscribes to has its reader replaced.
USED_OF_IMPLEMENTATIONS = {
    'publisher': ('publock', 'publish', 'closed', 'buff', 'is_latch', 'latch'),
    'subscriber': ('resolved_name', 'data_class', 'c_lock', 'connections'),
}

#: The attributes of a connection that `connected_publishers` and `latched_publishers` use.
USED_OF_CONNECTIONS = ('callerid_pub', 'done', 'is_latched')

#: The attributes of a connection's reader that are used.
USED_OF_PROTOCOLS = ('recv_data_class',)


def cached_parameters() -> List[str]:
    """The full names of the parameters that rospy's cache holds, and of all trees that they are in.

    To read one with `get_param_cached`, as rospy does for each line of its log, subscribes to it. Nothing unsubscribes.
    """
    names, trees = [], [('', rospy.impl.paramserver.get_param_server_cache().d)]
    for name, tree in trees:
        for key, value in tree.items() if isinstance(tree, dict) else ():
            names.append(f'{name}/{key}')
            trees.append((names[-1], value))
    return names


def connected_publishers(subscriber: rospy.Subscriber) -> Set[str]:
    """The names of the nodes that a subscriber is connected to.

    A node that crashed stays in the master's list, and rospy counts connections without saying to whom.
    """
    return {connection.callerid_pub for connection in subscriber.impl.connections if not connection.done}


def latched_publishers(subscriber: rospy.Subscriber) -> Set[str]:
    """The names of the nodes that a subscriber is connected to whose publishers are latched: they say so before their
    first message."""
    return {one.callerid_pub for one in subscriber.impl.connections if one.is_latched and not one.done}


def mend_connecting() -> None:
    """Have this process connect each subscriber to each publisher once, and read all of a topic in one way.

    A subscriber that is made in the moment in which its publisher is made hears of it twice, from the master's answer
    and from the master's update, and rospy connects twice at the same time. Of two connections of one node, the
    subscriber closes the one that it made first, and the publisher the one whose header it read first: if these
    differ, none is left, and the subscriber hears nothing for as long as it lives.

    A connection that is being made while the topic's reader is replaced would go on with the reader from before.
    """
    rospy.impl.masterslave.ROSHandler._connect_topic = _connect_in_turn
    rospy.topics._SubscriberImpl.add_connection = _add_connection


def watch_callbacks(called: Callable[[Tuple[str, str], float, Optional[Exception]], None]) -> None:
    """Have this process tell of each call of a subscriber's callback. rospy catches what it raises, and only logs it.

    Args:
        called: called after each, and after rospy has logged its exception, with (the topic, what the callback is
            called in the code), when the call began, a time of `time.monotonic`, and the exception or None.
    """

    def invoke(subscriber: Any, message: object, callback: Any, callback_args: object) -> None:
        noting, began = _NotingCallback(callback), time.monotonic()
        invoke_callback(subscriber, message, noting, callback_args)
        raised, noting.raised = noting.raised, None  # whose traceback refers to noting
        called((subscriber.resolved_name, _name_of(callback)), began, raised)

    rospy.topics._SubscriberImpl._invoke_callback = invoke


def watch_timers(called: Callable[[Tuple[str, str], float, Optional[Exception]], None]) -> None:
    """Have this process tell of each call of a Timer's callback that raises nothing: an exception ends its thread.

    Args:
        called: as in `watch_callbacks`, with the name of the Timer's thread instead of a topic.
    """

    def run(timer: Any) -> None:
        callback = timer._callback

        def noting(event: object) -> None:
            began = time.monotonic()
            callback(event)
            called((timer.name, _name_of(callback)), began, None)

        timer._callback = noting
        try:
            run_timer(timer)
        finally:
            timer._callback = callback  # it may be run again

    rospy.timer.Timer.run = run


def _name_of(callback: Any) -> str:
    return str(getattr(callback, '__qualname__', type(callback).__qualname__))


class _NotingCallback:
    """A callback, as rospy calls it and names it in its log; it notes what it raises."""

    def __init__(self, callback: Callable[..., object]) -> None:
        self._callback = callback
        self.raised: Optional[Exception] = None

    def __call__(self, *arguments: object) -> None:
        try:
            self._callback(*arguments)
        except Exception as error:
            self.raised = error
            raise

    def __str__(self) -> str:
        return str(self._callback)


def read_all_with(subscriber: Any, reader: Any) -> None:
    """Replace the reader of a topic that is subscribed to.

    Args:
        subscriber: the implementation of its subscribers.
        reader: the class that deserializes its messages.
    """
    with subscriber.c_lock:
        subscriber.data_class = reader
        for connection in subscriber.connections:
            connection.protocol.recv_data_class = reader


def _add_connection(subscriber: Any, connection: Any) -> Any:
    lock = subscriber.c_lock
    if lock is None:  # closed meanwhile
        return add_connection(subscriber, connection)
    with lock:
        connection.protocol.recv_data_class = subscriber.data_class
        return add_connection(subscriber, connection)


def _connect_in_turn(handler: object, topic: str, uri: str) -> Any:
    with _TURNS_LOCK:
        turn = _TURNS.setdefault((topic, uri), threading.Lock())
    with turn:
        return connect_to_publisher(handler, topic, uri)


def shut_down_without_deadlock() -> None:
    """Let a signal that comes while the main thread holds a lock which rospy's shutdown takes wait for its release.

    Otherwise the node waits for itself, for ever. Without effect if rospy does not handle signals, and in other
    threads than the main one.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is shut_down_at_signal:
            signal.signal(number, _shut_down_later_where_locked)


_LOCKING = {ask_master.__code__, hand_over.__code__}


def _shut_down_later_where_locked(number: int, frame: Optional[FrameType]) -> None:
    outer = frame
    while outer is not None:
        if outer.f_code in _LOCKING:
            timer = threading.Timer(_SIGNALLED_AGAIN, os.kill, (os.getpid(), number))
            timer.daemon = True
            timer.start()
            return
        outer = outer.f_back
    shut_down_at_signal(number, frame)
