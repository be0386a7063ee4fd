"""Errors that nodes raise in callbacks, or in the main program or a thread after a change, as reported on /rosout."""

import collections
import time
from typing import Any, Collection, Deque, NamedTuple

import rospy
from rosgraph_msgs.msg import Log

#: The start of rospy's log message about a callback that raised.
BAD_CALLBACK = 'bad callback: '

#: The start of rosslt's log message about a main program that raised.
ENDS = 'the node ends '

#: The same about a thread that raised, and about the callback of a `rospy.Timer`, which goes on.
THREAD_ENDS = 'a thread of the node ends '
TIMER_RAISES = 'a callback of a Timer raises '

#: The same about the callback of a Subscriber, after rospy has logged BAD_CALLBACK.
CALLBACK_RAISES = 'a callback of a Subscriber raises '

#: The maximal number of kept reports.
MOST = 100


class _Raised(NamedTuple):
    at: float
    node: str
    text: str


class NodeErrors:
    """The latest errors in nodes, from now on."""

    def __init__(self) -> None:
        self._raised: Deque[_Raised] = collections.deque(maxlen=MOST)
        self._subscriber = rospy.Subscriber('/rosout', Log, self._take)

    def _take(self, report: Any) -> None:
        if report.level >= Log.ERROR and report.msg.startswith((BAD_CALLBACK, ENDS, THREAD_ENDS, TIMER_RAISES)):
            self._raised.append(_Raised(time.monotonic(), report.name, report.msg.strip().splitlines()[-1]))

    def raised_since(self, nodes: Collection[str], since: float) -> str:
        """The first error in one of these nodes since a time of `time.monotonic` that it has not raised before, as a
        sentence; '' if there is none."""
        raised = [one for one in list(self._raised) if one.node in nodes]
        known = {(one.node, one.text) for one in raised if one.at < since}
        new = [one for one in raised if one.at >= since and (one.node, one.text) not in known]
        return f'{new[0].node} raises {new[0].text}' if new else ''

    def __enter__(self) -> 'NodeErrors':
        return self

    def __exit__(self, *_: object) -> None:
        self._subscriber.unregister()
