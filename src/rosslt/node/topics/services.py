"""Services that carry provenance: rospy's own, with the same arguments.

Requests and responses travel as ordinary ones with their provenance in-band, to and from plain peers too.
"""

import functools
from typing import Any, Callable

import rospy

from rosslt.messages import Message, MessageClass
from rosslt.node.rospy_internals import args_kwds_to_message, convert_return_to_response
from rosslt.node.topics.serialization import received_class, serializer, whole_provenance


class Service(rospy.Service):
    """`rospy.Service`, whose handler gets requests with tracked values, and whose responses keep provenance.

    Args:
        name, service_class, handler, and all others: as in `rospy.Service`.
    """

    def __init__(
        self, name: str, service_class: MessageClass, handler: Callable[[Message], Message], *args: Any, **kwargs: Any
    ) -> None:
        with_provenance = serializer(service_class._response_class, self._provenance, self._is_recorded)

        @functools.wraps(handler)
        def answer(request: Message) -> Message:
            self._begin_request()
            return with_provenance(convert_return_to_response(handler(request), service_class._response_class))

        reading = reading_service(service_class, rospy.resolve_name(name))
        super().__init__(name, reading, answer, *args, **kwargs)

    def _begin_request(self) -> None:
        """Called before the handler; a subclass may do something then."""

    def _is_recorded(self) -> bool:
        """Return whether the response to this thread's request has no provenance if none is found."""
        return True

    def _provenance(self, message: Message) -> bytes:
        """The provenance of the response to this thread's request."""
        return whole_provenance(message)


class ServiceProxy(rospy.ServiceProxy):
    """`rospy.ServiceProxy`, whose requests keep provenance and whose responses hold tracked values.

    Args:
        name, service_class, and all others: as in `rospy.ServiceProxy`.
    """

    def __init__(self, name: str, service_class: MessageClass, *args: Any, **kwargs: Any) -> None:
        super().__init__(name, reading_service(service_class, rospy.resolve_name(name)), *args, **kwargs)
        self._plain_request_class = service_class._request_class
        self._with_provenance = serializer(service_class._request_class)

    def call(self, *args: object, **kwds: object) -> Message:
        """Call the service, as `rospy.ServiceProxy.call` does."""
        request = args_kwds_to_message(self._plain_request_class, args, kwds)
        return super().call(self._with_provenance(request))


@functools.lru_cache(maxsize=None)
def reading_service(service_class: MessageClass, channel: str) -> Any:
    """The service class with requests and responses that are read with their provenance.

    Args:
        service_class: of the service.
        channel: its resolved name.
    """
    return type(
        service_class.__name__,
        (service_class,),
        {
            '_request_class': received_class(service_class._request_class, channel),
            '_response_class': received_class(service_class._response_class, channel),
        },
    )
