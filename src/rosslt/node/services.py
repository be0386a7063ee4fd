"""Services that carry provenance: rospy's own, with the same arguments.

Requests and responses travel as ordinary ones with their provenance in-band, to and from plain peers too.
"""

import functools

import rospy
from rospy.impl.tcpros_service import convert_return_to_response
from rospy.msg import args_kwds_to_message

from rosslt.node.carriers import carrier, reading_class
from rosslt.node.refresh import Refresher


class Service(rospy.Service):
    """`rospy.Service`, whose handler gets requests with tracked values, and whose responses keep provenance.

    Args:
        name, service_class, handler, and all others: as of `rospy.Service`.
    """

    def __init__(self, name, service_class, handler, *args, **kwargs):
        carried = carrier(service_class._response_class, Refresher())

        @functools.wraps(handler)
        def carrying(request):
            return carried(convert_return_to_response(handler(request), service_class._response_class))

        super().__init__(name, reading_service(service_class, rospy.resolve_name(name)), carrying, *args, **kwargs)


class ServiceProxy(rospy.ServiceProxy):
    """`rospy.ServiceProxy`, whose requests keep provenance and whose responses hold tracked values.

    Args:
        name, service_class, and all others: as of `rospy.ServiceProxy`.
    """

    def __init__(self, name, service_class, *args, **kwargs):
        super().__init__(name, reading_service(service_class, rospy.resolve_name(name)), *args, **kwargs)
        self._plain_request_class = service_class._request_class
        self._carrier = carrier(service_class._request_class, Refresher())

    def call(self, *args, **kwds):
        """Call the service, as `rospy.ServiceProxy.call` does."""
        request = args_kwds_to_message(self._plain_request_class, args, kwds)
        return super().call(self._carrier(request))


@functools.lru_cache(maxsize=None)
def reading_service(service_class, channel):
    """The service class with requests and responses that are read with their provenance.

    Args:
        service_class: of the service.
        channel: its resolved name.
    """
    return type(
        service_class.__name__,
        (service_class,),
        {
            '_request_class': reading_class(service_class._request_class, channel),
            '_response_class': reading_class(service_class._response_class, channel),
        },
    )
