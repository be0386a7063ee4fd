"""The publisher of a node that was not written for this, and the services: what makes its literals known."""

import contextlib
import time
from typing import Any

import rospy
from rospy.msg import args_kwds_to_message

from rosslt import messages, node, values
from rosslt.instrument.cells import location_of

#: The first messages of a publisher are looked into, and later ones as often as that, in seconds.
FIRST_MESSAGES = 3
PERIOD = 0.5


class Publisher(node.Publisher):
    """`rosslt.Publisher`, which makes the literals known that reach its messages, also while nobody subscribes.

    Args:
        as of `rospy.Publisher`.
    """

    _looked = 0
    _look_again = 0.0

    def publish(self, *args: Any, **kwds: Any) -> None:
        """Publish a message, as `rospy.Publisher.publish` does."""
        now = time.monotonic()
        if (now >= self._look_again or self._looked < FIRST_MESSAGES) and node.is_started():
            self._looked += 1
            self._look_again = now + PERIOD
            # It is rospy that says what is wrong with a message.
            with contextlib.suppress(TypeError, ValueError, rospy.ROSException):
                reach(args_kwds_to_message(self.data_class, args, kwds))
        super().publish(*args, **kwds)


def reach(message: Any) -> None:
    """Make the literals known that are in a message. Those that reach a field of whole numbers stay whole."""
    if isinstance(message, rospy.AnyMsg) or messages.is_tracked_type(type(message)):
        return
    fields = messages.tracked_fields(message)
    values.sources(list({id(value): value for _, value, _ in fields}.values()))
    for source in values.sources([value for _, value, kind in fields if kind == 'i']):
        location = location_of(source)
        if location is not None:
            location.keep_whole()
