"""Parameters that a program reads which `rosslt run` runs: their types, their bounds, and when they change."""

import math
from typing import Any, Callable, Optional

import rospy

from rosslt import values
from rosslt.node.api import started
from rosslt.node.locations.location import ParameterLocation


def is_whole_parameter(source: values.Source) -> bool:
    """Return whether a source is a ROS parameter of this node that takes whole numbers only."""
    location = _parameter(source)
    return location is not None and location.type is int


def take_fractions(source: values.Source) -> None:
    """Have a parameter for which `is_whole_parameter` holds take fractions from now on: it means a float."""
    location = _parameter(source)
    if location is not None:
        started('get_param').read_parameters.take_fractions(location.name)


def _parameter(source: values.Source) -> Optional[ParameterLocation]:
    owner = started('get_param')
    location = owner.locations.by_id.get(source.location_id) if source.node == owner.name else None
    return location if isinstance(location, ParameterLocation) else None


def serve_parameter(number: Any, changed: Callable[[], None], minimum: Any, maximum: Any, unsaved: str) -> None:
    """Have a number that was read as a parameter follow a server of this node that keeps it.

    Args:
        number: the reading.
        changed: called when it has changed.
        minimum, maximum: the bounds of the server, infinite if there are none.
        unsaved: why the default in the code is not the start value, so that saving it has no effect.
    """
    owner = started('get_param')
    with owner.lock:
        for source in values.sources(number):
            location = _parameter(source)
            if location is not None:
                location.changed += (changed,)
                location.minimum, location.maximum = (one if math.isfinite(one) else None for one in (minimum, maximum))
                location.unsaved = unsaved
        owner.publish_locations()


def parameter_was_set(name: str) -> None:
    """Update the readings of a parameter that this process has just set or deleted."""
    started('set_param').read_parameters.learn(rospy.resolve_name(name).rstrip('/') or '/')
