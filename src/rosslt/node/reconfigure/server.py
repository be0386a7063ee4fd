"""The dynamic_reconfigure server of a node: what its client library expects below `<node>/rosslt`.

dynamic_reconfigure's own server has parameters that are known when it is written, keeps their values itself, and clamps
what is out of bounds. Here parameters come and go, the locations have the values, and a change is one as all others: it
is applied as a whole or refused with the reason, recorded, and can be taken back.
"""

import contextlib
import json
import time
from typing import Any, Dict, List, Tuple

import rospy
from dynamic_reconfigure.msg import Config, ConfigDescription
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest, ReconfigureResponse

from rosslt import srv
from rosslt.messages import Scalar
from rosslt.node.callbacks import Callbacks
from rosslt.node.change.history import new_request_id
from rosslt.node.change.owner_interface import Owner
from rosslt.node.locations.location import Location
from rosslt.node.reconfigure.configuration import Configuration

#: While values change, they are published no more often than this, in seconds.
PERIOD = 0.1

#: Changes of the same parameters by the same client are one request while they come within this time, in seconds: a
#: slider that is dragged sends many.
SAME_DRAG = 1.0


class Server(rospy.SubscribeListener):
    """Serves `set_parameters`, `parameter_descriptions` and `parameter_updates`.

    Messages are made only while somebody has subscribed, and when a service is called.

    Args:
        owner: the owner of the locations.
        background: publishes in a thread of its own.
    """

    def __init__(self, owner: Owner, background: Callbacks) -> None:
        super().__init__()
        self._owner, self._background = owner, background
        self._drag: Tuple[Any, float, str] = (None, 0.0, '')
        self._is_asked = self._is_ready = False
        self._told: Tuple[Any, Any] = (None, None)  # the descriptions and values that were published last
        self._descriptions = rospy.Publisher('~rosslt/parameter_descriptions', ConfigDescription, self, queue_size=10)
        self._updates = rospy.Publisher('~rosslt/parameter_updates', Config, self, queue_size=10)
        rospy.Service('~rosslt/set_parameters', Reconfigure, self._set)
        self._is_ready = True
        self.update()

    def update(self) -> None:
        """Locations were created, dropped or changed."""
        if self._is_ready and (self._descriptions.get_num_connections() or self._updates.get_num_connections()):
            self._background.call_soon(self._publish, PERIOD)

    def peer_subscribe(self, _topic_name: str, _topic_publish: object, _peer_publish: object) -> None:
        """Somebody has subscribed: rospy calls this."""
        self._is_asked = True
        if self._is_ready:
            self._background.call_soon(self._publish)

    def _publish(self) -> None:
        is_asked, self._is_asked = self._is_asked, False
        configuration, before = self._configuration(), self._told
        self._told = configuration.descriptions(), configuration.values()
        with contextlib.suppress(rospy.ROSException):  # the node has ended meanwhile
            if is_asked or self._told[0] != before[0]:
                self._descriptions.publish(self._told[0])
            if is_asked or self._told[1] != before[1]:
                self._updates.publish(self._told[1])

    def _configuration(self) -> Configuration:
        with self._owner.lock:
            return Configuration(self._owner.locations.by_id.values())

    def _set(self, request: ReconfigureRequest) -> ReconfigureResponse:
        """Apply the changes of a client, all or none; locations that have the value already are not touched."""
        config = request.config
        asked = [(one.name, one.value) for one in [*config.bools, *config.ints, *config.strs, *config.doubles]]
        present = self._configuration().by_name
        unknown = [name for name, _ in asked if name not in present]
        if unknown:
            raise rospy.ServiceException(f'{self._owner.name} has no location {", ".join(unknown)}')
        wanted = {present[name].location: value for name, value in asked if value != present[name].value}
        reasons = self._change(wanted, request._connection_header.get('callerid', '')) if wanted else []
        if reasons:
            # a client may show the values that it asked for: send it the actual ones
            self.peer_subscribe('', None, None)
            raise rospy.ServiceException('; '.join(reasons))
        return ReconfigureResponse(self._configuration().values())

    def _change(self, wanted: Dict[Location, Scalar], client: str) -> List[str]:
        """Request changes of locations; returns the reasons of refusals, none if all are applied."""
        what, now = (client, set(wanted)), time.monotonic()
        last, at, request_id = self._drag
        if what != last or now - at > SAME_DRAG:
            request_id = new_request_id()
        self._drag = what, now, request_id
        # written with NaN and its like, which the owner refuses as it does elsewhere
        texts = [json.dumps(value) for value in wanted.values()]
        answer = self._owner.change_sources(
            srv.ChangeSourcesRequest(
                request_id=request_id,
                requester=client,
                location_ids=[location.id for location in wanted],
                values=texts,
            )
        )
        return [f'{location.name}: {reason}' for location, reason in zip(wanted, answer.reasons) if reason]
