"""The publisher and the services of a node that was not written for this: where its literals are made known, and where
the rounds begin in which it is recorded."""

import contextlib
import sys
import time
from typing import Any, List

import rospy

from rosslt import messages, node, values
from rosslt.instrument.budget import BUDGET
from rosslt.instrument.cells import decide_shapes, location_of
from rosslt.instrument.losses import LOSSES

#: The period of inspecting a publisher's messages, in seconds, and the share of a core that it takes at most.
PERIOD, SHARE = 0.5, 0.005


class Publisher(node.Publisher):
    """`rosslt.Publisher`, which makes the literals known that reach its messages, also while nobody subscribes.

    Args:
        as in `rospy.Publisher`.
    """

    _look_again = 0.0
    _asked: Any = None
    _stops = 0

    def __new__(cls, *_args: Any, **_kwargs: Any) -> 'Publisher':
        made = super().__new__(cls)  # in __init__, rospy's warnings would name that instead of the node's line
        BUDGET.ask(made)
        return made

    def publish(self, *args: object, **kwds: object) -> None:
        """Publish a message, as `rospy.Publisher.publish` does."""
        self._is_recorded = self._stops == BUDGET.stops and not BUDGET.stops % 2
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
        super().publish(*args, **kwds)
        asked = self._last_asked
        if asked != self._asked:
            self._asked = asked
            BUDGET.ask(self)
        elif self._is_recorded:
            BUDGET.answer(self)
        BUDGET.begin_round(self)
        self._stops = BUDGET.stops

    def _provenance(self, message: messages.Message) -> bytes:
        return super()._provenance(message) if self._is_recorded else messages.SAMPLED


class Service(node.Service):
    """`rosslt.Service`, each of whose requests begins a round.

    Args:
        as in `rospy.Service`.
    """

    def _begin_request(self) -> None:
        BUDGET.begin_round(self)


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
