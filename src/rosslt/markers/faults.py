"""Faults in one thing, which end neither the view nor the other things."""

import contextlib
import traceback
from typing import Iterator, Set, Tuple

import rospy

_logged: Set[Tuple[str, str]] = set()  # (what failed, the last line of the traceback)


@contextlib.contextmanager
def contained(what: str) -> Iterator[None]:
    """Log a fault in the body instead of raising it: once for each thing and error, with its traceback.

    Args:
        what: what fails then, and of which thing: `/poses:0 cannot be drawn`.
    """
    try:
        yield
    except rospy.ROSInterruptException:
        raise
    except Exception as fault:
        key = what, traceback.format_exception_only(type(fault), fault)[-1]
        if key not in _logged and not rospy.is_shutdown():  # what is being closed fails everywhere
            _logged.add(key)
            rospy.logerr('%s\n%s', what, traceback.format_exc())
