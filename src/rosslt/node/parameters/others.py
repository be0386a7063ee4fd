"""Parameters that another process reads, and that process: this node owns their locations for it."""

from typing import Callable

from rosslt.messages import Scalar
from rosslt.node.api import started
from rosslt.node.locations.call_sites import CallSite
from rosslt.node.locations.location import Defaults, Location, ParameterLocation
from rosslt.node.locations.others_parameter import OthersParameter, Reader, RobotNumber

#: The name of `rosslt launch` as a node, to which its process and time are added.
LAUNCH = 'rosslt_launch'


def own_parameter_of(reader: Reader, name: str, sites: Callable[[str], CallSite], is_robot: bool = False) -> None:
    """Own the locations of a parameter that another process reads.

    Args:
        reader: that process.
        name: the full name of a parameter that is set.
        sites: says of the full name of a scalar in it where that stands.
        is_robot: whether it is the text of a URDF, and the scalars in it are the numbers of that.
    """

    def make(scalar: str, value: Scalar, defaults: Defaults) -> ParameterLocation:
        kind = RobotNumber if is_robot else OthersParameter
        return kind(scalar, sites(scalar), value, defaults, reader)

    started('own_parameter_of').read_parameters.own(name, sites(name), make, is_robot)


def is_set(*locations: Location, timeout: float) -> bool:
    """Wait until the master has the values in force of locations of this node; False if it does not within the timeout,
    in seconds."""
    parameters = started('is_set').parameters
    return parameters.wait(parameters.write(*locations), timeout)
