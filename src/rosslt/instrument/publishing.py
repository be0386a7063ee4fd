"""The publisher and the services of a node that was not written for this: where its literals are made known, and where
the rounds begin in which it is recorded."""

import contextlib
import sys
import threading
import time
from typing import Any, Dict, List

import rospy

from rosslt import messages, node, values
from rosslt.instrument.budget import BUDGET
from rosslt.instrument.cells import decide_shapes, location_of
from rosslt.instrument.losses import LOSSES

#: The period of inspecting a publisher's messages, in seconds, and the share of a core that it takes at most.
PERIOD, SHARE = 0.5, 0.005


class _Round:
    """The last round of a publisher in one thread: the moment since when it may have been recorded, and its message."""

    __slots__ = 'is_known', 'is_recorded', 'stops'

    def __init__(self, stops: int) -> None:
        self.stops = stops
        self.is_recorded = False
        self.is_known = True


class Publisher(node.Publisher):
    """`rosslt.Publisher`, which makes the literals known that reach its messages, also while nobody subscribes.

    Args:
        as in `rospy.Publisher`.
    """

    _look_again = 0.0
    _asked: Any = None
    _rounds: Dict[int, _Round]
    _last_round: _Round

    def __new__(cls, *_args: Any, **_kwargs: Any) -> 'Publisher':
        made = super().__new__(cls)  # in __init__, rospy's warnings would name that instead of the node's line
        made._rounds = {}  # by thread: several may compute messages of this topic at once
        made._last_round = _Round(0)
        BUDGET.ask(made)
        return made

    def publish(self, *args: object, **kwds: object) -> None:
        """Publish a message, as `rospy.Publisher.publish` does."""
        thread = threading.get_ident()
        own = self._rounds.get(thread)
        if own is None:
            own = self._rounds[thread] = _Round(self._last_round.stops)
        own.is_recorded, own.is_known = BUDGET.is_recorded(own.stops), True
        self._last_round = own
        now = time.monotonic()
        if LOSSES.is_watched:
            LOSSES.sent(self.resolved_name, sys._getframe(1))
        if now >= self._look_again and node.is_started():
            has_sources = False
            # It is rospy that says what is wrong with a message.
            with contextlib.suppress(TypeError, ValueError, AttributeError, rospy.ROSException):
                has_sources = reach(node.args_kwds_to_message(self.data_class, args, kwds))
            LOSSES.published(self.resolved_name, now, has_sources)
            self._look_again = now + max(PERIOD, (time.monotonic() - now) / SHARE)
        asked = self._last_asked
        super().publish(*args, **kwds)
        if own.is_recorded and own.is_known:
            BUDGET.answer(self)
        elif asked != self._asked:
            BUDGET.ask(self)
        self._asked = asked
        BUDGET.begin_round((self, thread))
        own.stops = BUDGET.stops

    @property
    def _round(self) -> _Round:
        # a latched message is sent again by other threads
        return self._rounds.get(threading.get_ident(), self._last_round)

    @property
    def _is_recorded(self) -> bool:
        return self._round.is_recorded

    def _provenance(self, message: messages.Message) -> bytes:
        own = self._round
        provenance = super()._provenance(message) if own.is_recorded else messages.SAMPLED
        own.is_known = provenance != messages.SAMPLED
        return provenance


class Service(node.Service):
    """`rosslt.Service`, each of whose requests begins a round. A response that was not recorded as a whole is sampled.

    Args:
        as in `rospy.Service`.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._of_thread = threading.local()  # each request has a thread
        super().__init__(*args, **kwargs)

    def _begin_request(self) -> None:
        BUDGET.begin_round(self)
        self._of_thread.stops = BUDGET.stops

    def _is_recorded(self) -> bool:
        return BUDGET.is_recorded(self._of_thread.stops)

    def _provenance(self, message: messages.Message) -> bytes:
        return super()._provenance(message) if self._is_recorded() else messages.SAMPLED


def reach(message: messages.Message) -> bool:
    """Make the literals known that are in a message. Those that reach a field of whole numbers stay whole.

    Args:
        message: any ROS message.

    Returns:
        whether anything in it has a source.
    """
    if node.has_its_provenance(message):
        return False
    fields = messages.tracked_fields(message)
    leaves = list({id(value): value for _, value, _ in fields}.values())
    sources = values.sources(leaves)
    decide_shapes(leaves)
    for source in values.sources([value for _, value, kind in fields if kind == 'i']):
        location = location_of(source)
        if location is not None:
            location.keep_whole()
    if any(map(node.is_whole_parameter, sources)):
        _take_fractions([value for _, value, kind in fields if kind in 'df'])
    return bool(sources)


def _take_fractions(leaves: List[object]) -> None:
    """Have parameters with whole numbers take fractions if floats are meant: if a field of floats comes from nothing
    else, or if they are angles.

    A parameter that is combined with other numbers may be a count.
    """
    alone = [values.source_of_functions(leaf) for leaf in leaves]
    for source in dict.fromkeys([*alone, *values.sources_of_angles(leaves)]):
        if source is not None and node.is_whole_parameter(source):
            node.take_fractions(source)
