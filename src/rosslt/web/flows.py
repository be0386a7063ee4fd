"""The flow of provenance on the page, as long as somebody looks: who feeds whom, which location reaches which field.

Messages of all topics are heard only then. What has not been in the messages of a publisher for a while is drawn no
more.
"""

import html
import math
import threading
import time
import traceback
from typing import Any, Callable, Dict, List, Optional, Protocol, Set, Tuple

import rosgraph
import roslib.message
import rospy

from rosslt import node, values
from rosslt.flow import Flow, NotDrawn, ProvenanceMap, Reach, dot, svg
from rosslt.web.markdown import code

#: The period of updating the drawing, in seconds.
PERIOD = 1.0

#: The period of reading messages of one topic, in seconds: all tell the same.
LOOK_PERIOD = 0.5

#: The time for which a field is kept that later messages of its publisher do not have, in seconds.
MEMORY = 5.0

#: So many locations are drawn at most: a drawing of more is too wide to be read.
MOST = 30

#: Around a drawing: viser's windows are narrow, and have no setting for it.
FRAME = """
<style>
.mantine-Modal-content:has(.rosslt-flow) {{ flex: 0 0 auto; max-width: 95vw; }}
.rosslt-flow svg {{ max-width: 100%; height: auto; }}
</style>
<div class="rosslt-flow">{}</div>
"""

#: Gives the sources that are looked at; None for all.
SourcesOf = Callable[[], Optional[Set[values.Source]]]


class TopicReader:
    """Reads the messages of all topics, and keeps what they say about where their values come from."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._subscribers: Dict[str, Tuple[str, rospy.Subscriber]] = {}  # topic -> (its type, the subscriber)
        self._looked: Dict[Tuple[str, str], float] = {}  # (topic, publisher) -> when
        self._heard: Dict[Reach, Dict[str, float]] = {}  # {field: when}
        self._newest: Dict[Tuple[str, str], Any] = {}  # (topic, publisher) -> the last message

    def follow(self, types: Dict[str, str]) -> None:
        """Hear these topics, {topic: type}, and no others."""
        for topic, (kind, subscriber) in list(self._subscribers.items()):
            if types.get(topic) != kind:
                subscriber.unregister()
                del self._subscribers[topic]
        with self._lock:
            self._heard = {reach: fields for reach, fields in self._heard.items() if reach.topic in types}
            self._newest = {origin: message for origin, message in self._newest.items() if origin[0] in types}
        for topic, kind in types.items():
            message_class = None if topic in self._subscribers else roslib.message.get_message_class(kind)
            if message_class is not None:
                subscriber = node.Subscriber(topic, message_class, self._take, topic, keep_provenance=True)
                self._subscribers[topic] = (kind, subscriber)

    def provenance(self) -> ProvenanceMap:
        """The provenance that is known now."""
        found = ProvenanceMap()
        with self._lock:
            for reach, fields in self._heard.items():
                oldest = self._looked.get((reach.topic, reach.publisher), -math.inf) - MEMORY
                present = [field for field, when in fields.items() if when >= oldest]
                if present:
                    found.fields[reach] = present
        return found

    def newest(self, topic: str, publisher: str) -> Any:
        """The last message of a publisher on a topic, or None."""
        with self._lock:
            return self._newest.get((topic, publisher))

    def _take(self, message: Any, topic: str) -> None:
        publisher, now = message._connection_header['callerid'], time.monotonic()
        with self._lock:
            self._newest[topic, publisher] = message
            if now - self._looked.get((topic, publisher), -math.inf) < LOOK_PERIOD:
                return
            self._looked[topic, publisher] = now
        said = ProvenanceMap()
        said.add(topic, publisher, message)
        with self._lock:
            for reach, fields in said.fields.items():
                self._heard.setdefault(reach, {}).update(dict.fromkeys(fields, now))


class Shown:
    """A drawing on somebody's page, where viser's next element would be.

    Args:
        client: who sees it.
        sources: gives what is looked at.
        topic: where the ways of the sources lead that are written out; None for none.
    """

    def __init__(self, client: Any, sources: SourcesOf, topic: Optional[str]) -> None:
        self.client_id = client.client_id
        self._sources, self._topic = sources, topic
        self._text = client.gui.add_markdown('*listening to all topics*')
        self._picture = client.gui.add_html('')
        self._drawn = ''

    def update(self, flow: Flow) -> None:
        """Show a flow."""
        wanted = self._sources()
        sources = [source for source in flow.provenance.sources if wanted is None or source in wanted]
        text = '\n'.join(self._lines(flow, sources))
        if self._text.content != text:
            self._text.content = text
        drawn = dot(flow, node.directory(), node.directory().ordered(sources)[:MOST]) if sources else ''
        if drawn != self._drawn:
            self._drawn = drawn
            self._picture.content = _html(drawn)

    def _lines(self, flow: Flow, sources: List[values.Source]) -> List[str]:
        if not sources:
            return ['*no message with their provenance has come yet*']
        ways = {
            written(source, way): None
            for source in sources
            for way in flow.ways(source)
            if self._topic is not None and way[-1].topic == self._topic
        }
        lines = ['- ' + code(way) for way in ways]
        if len(sources) > MOST:
            lines.append('*{} of {} locations are drawn*'.format(MOST, len(sources)))
        return lines


class Look(Protocol):
    """A part of somebody's page that follows the flow.

    Attributes:
        client_id: viser's, of who looks.
    """

    client_id: int

    def update(self, flow: Flow) -> None:
        """Show a flow."""


class Flows:
    """All drawings, and what else follows the flow.

    Args:
        server: viser's.
    """

    def __init__(self, server: Any) -> None:
        self._server, self._topics = server, TopicReader()
        self._looks: List[Look] = []
        self._wake = threading.Condition()
        self._master = rosgraph.Master(rospy.get_name())
        threading.Thread(target=self._work, name='rosslt flows', daemon=True).start()

    def add(self, client: Any, sources: SourcesOf, topic: Optional[str] = None) -> Shown:
        """Show the flow of some sources to somebody, until it is removed; as of Shown."""
        shown = Shown(client, sources, topic)
        self.look(shown)
        return shown

    def look(self, look: Look) -> None:
        """Tell somebody's look of the flow, until it is removed."""
        with self._wake:
            self._looks.append(look)
            self._wake.notify()

    def remove(self, look: Look) -> None:
        """Nobody looks at it any more."""
        with self._wake:
            if look in self._looks:
                self._looks.remove(look)

    def newest(self, topic: str, publisher: str) -> Any:
        """The last message of a publisher on a topic while somebody looks, or None."""
        return self._topics.newest(topic, publisher)

    def open(self, client: Any, title: str, sources: SourcesOf) -> None:
        """Show the flow of some sources to somebody in a window of its own."""
        modal = client.gui.add_modal(title)
        with modal:
            close = client.gui.add_button('Close')
            shown = self.add(client, sources)

        @close.on_click
        def closed(event: Any) -> None:
            self.remove(shown)
            modal.close()

    def _work(self) -> None:
        while not rospy.is_shutdown():
            with self._wake:
                clients = self._server.get_clients()
                self._looks = [one for one in self._looks if one.client_id in clients]
                looks = list(self._looks)
            try:
                self._update(looks)
            except (OSError, rosgraph.MasterException) as error:
                rospy.logwarn_throttle(30, 'the master does not answer: %s', error)
            except Exception:  # one odd message must not end the drawings for all
                rospy.logerr_throttle(30, 'while drawing the flow:\n%s', traceback.format_exc())
            with self._wake:
                if len(self._looks) <= len(looks):
                    self._wake.wait(PERIOD)

    def _update(self, looks: List[Look]) -> None:
        if not looks:
            self._topics.follow({})
            return
        publishers, subscribers, _ = self._master.getSystemState()
        types = dict(self._master.getTopicTypes())
        self._topics.follow({topic: types[topic] for topic, _ in publishers if topic in types})
        provenance = self._topics.provenance()
        node.directory().look_up(provenance.sources)
        flow = Flow(provenance, dict(subscribers))
        for one in looks:
            one.update(flow)


def written(source: values.Source, way: List[Any]) -> str:
    """A way as a line: `/talker → /gate → /relay → /pose`."""
    start = [] if way[0].publisher == source.node else [source.node, '…']
    return ' → '.join([*start, *(name for step in way for name in (step.publisher, step.topic))])


def _html(drawn: str) -> str:
    """A drawing in graphviz's language as HTML; graphviz escapes what is written in it."""
    if not drawn:
        return ''
    try:
        picture = svg(drawn)
    except NotDrawn as error:
        return html.escape('not drawn: {}'.format(error))
    return FRAME.format(picture[picture.index('<svg') :])
