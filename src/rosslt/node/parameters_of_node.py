"""What the programs that `rosslt run` runs need to know of the parameters that they read."""

from typing import Callable

import rospy

from rosslt import values
from rosslt.node.api import started
from rosslt.node.locations import ParameterLocation

#: How long a parameter that this process has set is waited for, in seconds.
TIMEOUT = 1.0


def is_whole_parameter(source: values.Source) -> bool:
    """Whether a source is a ROS parameter that this node reads, and takes whole numbers only."""
    owner = started('get_param')
    location = owner.locations.by_id.get(source.location_id) if source.node == owner.name else None
    return isinstance(location, ParameterLocation) and location.type is int


def take_fractions(source: values.Source) -> None:
    """Have a parameter for which `is_whole_parameter` holds take fractions from now on: it means a float."""
    owner = started('get_param')
    with owner.lock:
        location = owner.locations.by_id[source.location_id]
        if isinstance(location, ParameterLocation):
            location.parameter.as_float = True
            location.retype(float(location.value))


def when_parameter_changes(key: str, function: Callable[[], None]) -> None:
    """Have a function called when a number that this node reads as a parameter has changed.

    Args:
        key: the parameter's full name.
    """
    owner = started('get_param')
    with owner.lock:
        for location in owner.locations.by_id.values():
            if location.name == key:
                location.changed += (function,)


def parameter_was_set(name: str) -> None:
    """Have a parameter that this process has just set or deleted be read as it is now."""
    mirror = started('set_param').mirror
    mirror.wait(mirror.read_again(rospy.resolve_name(name).rstrip('/')), TIMEOUT)
