"""Services that carry provenance: rospy's own, with the same arguments.

Requests and responses travel as ordinary ones with their provenance in-band, to and from plain peers too.
"""

import functools

import rospy
from rospy.impl.tcpros_service import convert_return_to_response
from rospy.msg import args_kwds_to_message

from rosslt.node.carriers import BadHeaders, carrier_class, reading_class


class Service(rospy.Service):
    """`rospy.Service`, whose handler gets requests with tracked values, and whose responses keep provenance.

    Args:
        name, service_class, handler, and all others: as of `rospy.Service`.
    """

    def __init__(self, name, service_class, handler, *args, **kwargs):
        bad_headers = BadHeaders(rospy.resolve_name(name))
        carrier = carrier_class(service_class._response_class)

        @functools.wraps(handler)
        def carrying(request):
            bad_headers.report_found(request)
            return carrier(convert_return_to_response(handler(request), service_class._response_class))

        super().__init__(name, reading_service(service_class), carrying, *args, **kwargs)


class ServiceProxy(rospy.ServiceProxy):
    """`rospy.ServiceProxy`, whose requests keep provenance and whose responses hold tracked values.

    Args:
        name, service_class, and all others: as of `rospy.ServiceProxy`.
    """

    def __init__(self, name, service_class, *args, **kwargs):
        super().__init__(name, reading_service(service_class), *args, **kwargs)
        self._plain_request_class = service_class._request_class
        self._carrier = carrier_class(service_class._request_class)
        self._bad_headers = BadHeaders(self.resolved_name)

    def call(self, *args, **kwds):
        """Call the service, as `rospy.ServiceProxy.call` does."""
        request = args_kwds_to_message(self._plain_request_class, args, kwds)
        response = super().call(self._carrier(request))
        self._bad_headers.report_found(response)
        return response


@functools.lru_cache(maxsize=None)
def reading_service(service_class):
    """The service class with requests and responses that are read with their provenance."""
    return type(service_class.__name__, (service_class,), {
        '_request_class': reading_class(service_class._request_class),
        '_response_class': reading_class(service_class._response_class)})
