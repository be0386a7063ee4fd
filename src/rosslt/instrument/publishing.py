"""The publisher of a node that was not written for this, and the services: what makes its literals known."""

import contextlib
import time
from typing import Any, Callable, List

import rospy

from rosslt import messages, node, values
from rosslt.instrument.cells import decide_shapes, location_of

#: The first messages of a publisher are looked into, and later ones as often as that, in seconds.
FIRST_MESSAGES = 3
PERIOD = 0.5

#: What all publishers of this process together may spend on provenance.
_ALLOWANCE = messages.Allowance()


class Publisher(node.Publisher):
    """`rosslt.Publisher`, which makes the literals known that reach its messages, also while nobody subscribes.

    Args:
        as of `rospy.Publisher`.
    """

    _looked = 0
    _look_again = _counted_since = 0.0
    _count = 0

    def _provenance(self) -> Callable[[Any, bool], bytes]:
        sparing = messages.SparingProvenance(_ALLOWANCE)
        seen = 0

        def provenance(message: Any, full_history: bool) -> bytes:
            nonlocal seen
            if node.change_count() != seen:
                seen = node.change_count()
                sparing.forget()
            return sparing.to_send(message, full_history)

        return provenance

    def publish(self, *args: Any, **kwds: Any) -> None:
        """Publish a message, as `rospy.Publisher.publish` does."""
        now = time.monotonic()
        self._count += 1
        if (now >= self._look_again or self._looked < FIRST_MESSAGES) and node.is_started():
            self._looked += 1
            self._look_again = now + PERIOD
            took = now - self._counted_since
            rate = self._count / took if took >= PERIOD else 0.0
            if rate or self._looked == 1:
                self._count, self._counted_since = 0, now
            # It is rospy that says what is wrong with a message.
            with contextlib.suppress(TypeError, ValueError, rospy.ROSException):
                reach(node.args_kwds_to_message(self.data_class, args, kwds), rate)
        super().publish(*args, **kwds)


def reach(message: Any, rate: float = 0.0) -> None:
    """Make the literals known that are in a message. Those that reach a field of whole numbers stay whole.

    Args:
        message: any ROS message.
        rate: how many such messages there are in a second; 0 where that is not known yet.
    """
    if isinstance(message, rospy.AnyMsg) or messages.is_tracked_type(type(message)):
        return
    fields = messages.tracked_fields(message)
    leaves = list({id(value): value for _, value, _ in fields}.values())
    sources = values.sources(leaves)
    decide_shapes(leaves, rate)
    for source in values.sources([value for _, value, kind in fields if kind == 'i']):
        location = location_of(source)
        if location is not None:
            location.keep_whole()
    if any(map(node.is_whole_parameter, sources)):
        _take_fractions([value for _, value, kind in fields if kind in 'df'])


def _take_fractions(leaves: List[Any]) -> None:
    """Have parameters take fractions that say 1 where 1.0 is meant: those that are all that is in a field of floats.

    What is computed with other numbers as well may be a count.
    """
    for leaf in leaves:
        (kind, *rest), *functions = values.disassemble([leaf])[0]
        if kind == values.SOURCE and node.is_whole_parameter(rest[0]) and all(len(one) == 2 for one in functions):
            node.take_fractions(rest[0])
