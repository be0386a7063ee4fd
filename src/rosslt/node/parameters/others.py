"""Parameters that another process reads, and that process: this node owns their locations for it."""

from typing import Callable, Dict, Tuple

import rospy
from dynamic_reconfigure.msg import BoolParameter, Config, DoubleParameter, IntParameter, StrParameter
from dynamic_reconfigure.srv import Reconfigure

from rosslt.messages import Scalar
from rosslt.node.api import started
from rosslt.node.locations.call_sites import CallSite
from rosslt.node.locations.location import Defaults, Location, ParameterLocation
from rosslt.node.locations.others_parameter import OthersParameter, Reader
from rosslt.node.no_master import NO_MASTER
from rosslt.node.service_calls import call_service

#: The name of `rosslt launch` as a node, to which its process and time are added.
LAUNCH = 'rosslt_launch'

#: The time that a server of dynamic_reconfigure has to answer, in seconds.
TIMEOUT = 1.0

_KINDS = {'bools': BoolParameter, 'ints': IntParameter, 'strs': StrParameter, 'doubles': DoubleParameter}


def own_parameter_of(reader: Reader, name: str, sites: Callable[[str], CallSite]) -> None:
    """Own the locations of a parameter that another process reads.

    Args:
        reader: that process.
        name: the full name of a parameter that is set.
        sites: says of the full name of a scalar in it where that stands.
    """

    def make(scalar: str, value: Scalar, defaults: Defaults) -> ParameterLocation:
        return OthersParameter(scalar, sites(scalar), value, defaults, reader)

    started('own_parameter_of').read_parameters.own(name, sites(name), make)


def is_set(*locations: Location, timeout: float) -> bool:
    """Wait until the master has the values in force of locations of this node; False if it does not within the timeout,
    in seconds."""
    parameters = started('is_set').parameters
    return parameters.wait(parameters.write(*locations), timeout)


def reconfigure(node: str, parameter: str, value: Scalar) -> bool:
    """Give a parameter of a node a new value by its server of dynamic_reconfigure.

    Args:
        node: its full name.
        parameter: its name below that of the node.

    Returns:
        False if the node has no such server, or none of that parameter.

    Raises:
        ValueError: it does not take that value, and has the former one.
    """
    service = f'{node}/set_parameters'
    try:
        started('reconfigure').parameters.server.master.lookupService(service)
        present = _in(rospy.wait_for_message(f'{node}/parameter_updates', Config, TIMEOUT))
    except (*NO_MASTER, rospy.ROSException):
        return False
    if parameter not in present:
        return False
    kind, before = present[parameter]

    def ask(wanted: Scalar) -> Scalar:
        config = Config(**{kind: [_KINDS[kind](parameter, wanted)]})
        return _in(call_service(service, Reconfigure, Reconfigure._request_class(config), TIMEOUT).config)[parameter][1]

    try:
        got = ask(float(value) if kind == 'doubles' else value)
        if got != value:
            ask(before)
    except (rospy.ServiceException, KeyError, TypeError, ValueError) as error:
        raise ValueError(f'{service} does not take {value!r}: {error}') from None
    if got != value:
        raise ValueError(f'{service} makes {got!r} of {value!r}; it has {before!r} again')
    return True


def _in(config: Config) -> Dict[str, Tuple[str, Scalar]]:
    """{name: (the field of a Config that it is in, its value)}."""
    return {one.name: (kind, one.value) for kind in _KINDS for one in getattr(config, kind)}
