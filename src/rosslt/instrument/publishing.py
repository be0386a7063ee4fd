"""The publisher of a node that was not written for this, and the services: what makes its literals known."""

import contextlib
import time
from typing import Any, Callable, List

import rospy

from rosslt import messages, node, values
from rosslt.instrument.cells import decide_shapes, location_of
from rosslt.instrument.losses import LOSSES
from rosslt.instrument.sampling import SAMPLING

#: The first messages of a publisher are looked into, and later ones as often as that, in seconds.
FIRST_MESSAGES = 3
PERIOD = 0.5

#: The most of a core that looking into later messages may take.
SHARE = 0.005

#: What all publishers of this process together may spend on provenance.
_ALLOWANCE = messages.Allowance()


class Publisher(node.Publisher):
    """`rosslt.Publisher`, which makes the literals known that reach its messages, also while nobody subscribes.

    Args:
        as of `rospy.Publisher`.

    Attributes:
        recorded_since: as of `sampling`, for which it is kept here.
    """

    recorded_since = 0

    _looked = 0
    _look_again = 0.0

    def _provenance(self) -> Callable[[Any, bool], bytes]:
        sparing = self._sparing = messages.SparingProvenance(_ALLOWANCE)
        seen = 0

        def provenance(message: Any, full_history: bool) -> bytes:
            nonlocal seen
            start = time.thread_time()
            if node.change_count() != seen:
                seen = node.change_count()
                sparing.forget()
                SAMPLING.changed()
            if full_history or not SAMPLING.is_on:
                data = sparing.to_send(message, full_history)
            elif not SAMPLING.is_recorded(self):
                data = sparing.recalled(message)
            else:
                data = sparing.to_send(message) if SAMPLING.was_sampled(self) else sparing.remembered(message)
            SAMPLING.takes_turns |= sparing.takes_turns
            SAMPLING.sending += time.thread_time() - start
            return data

        return provenance

    def publish(self, *args: Any, **kwds: Any) -> None:
        """Publish a message, as `rospy.Publisher.publish` does."""
        now = time.monotonic()
        is_due = now >= self._look_again or self._looked < FIRST_MESSAGES
        if is_due and node.is_started() and not values.RECORDING.is_paused:
            self._looked += 1
            LOSSES.published(now)
            start = time.thread_time()
            # It is rospy that says what is wrong with a message.
            with contextlib.suppress(TypeError, ValueError, AttributeError, rospy.ROSException):
                reach(node.args_kwds_to_message(self.data_class, args, kwds))
            self._look_again = now + max(PERIOD, (time.thread_time() - start) / SHARE)
        super().publish(*args, **kwds)
        if SAMPLING.published(self) and not self.get_num_connections():
            self._remember(*args, **kwds)

    def _remember(self, *args: Any, **kwds: Any) -> None:
        """Write the provenance of a message that went to nobody: who subscribes while nothing is recorded gets it."""
        message = node.args_kwds_to_message(self._plain_class, args, kwds)
        if not _is_sent_as_it_is(message):
            start = time.thread_time()
            self._sparing.remembered(message)
            SAMPLING.sending += time.thread_time() - start


def reach(message: Any) -> None:
    """Make the literals known that are in a message. Those that reach a field of whole numbers stay whole.

    Args:
        message: any ROS message.
    """
    if _is_sent_as_it_is(message):
        return
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


def _is_sent_as_it_is(message: Any) -> bool:
    return isinstance(message, (rospy.AnyMsg, type)) or messages.is_tracked_type(type(message))


def _take_fractions(leaves: List[Any]) -> None:
    """Have parameters take fractions that say 1 where 1.0 is meant: those that are all that is in a field of floats.

    What is computed with other numbers as well may be a count.
    """
    for leaf in leaves:
        source = values.source_of_functions(leaf)
        if source is not None and node.is_whole_parameter(source):
            node.take_fractions(source)
