"""Changing a parameter of another node by its server of dynamic_reconfigure."""

from typing import Dict, Tuple

import rosgraph
import rospy
from dynamic_reconfigure.msg import BoolParameter, Config, DoubleParameter, IntParameter, StrParameter
from dynamic_reconfigure.srv import Reconfigure

from rosslt.messages import Scalar
from rosslt.node.no_master import NO_MASTER
from rosslt.node.service_calls import call_service

#: The time that a server of dynamic_reconfigure has to answer, in seconds.
TIMEOUT = 1.0

_KINDS = {'bools': BoolParameter, 'ints': IntParameter, 'strs': StrParameter, 'doubles': DoubleParameter}


def set_parameter(node: str, parameter: str, value: Scalar) -> bool:
    """What `reconfigure_parameter` of this folder does."""
    service = f'{node}/set_parameters'
    try:
        rosgraph.Master(rospy.get_name()).lookupService(service)
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
