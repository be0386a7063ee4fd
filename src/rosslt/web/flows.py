"""The flow of provenance on the page, as long as somebody looks: who feeds whom, which location reaches which field.

Messages of all topics are heard only then.
"""

import html
from typing import Callable, ContextManager, Dict, List, Optional, Set, Tuple

import viser

from rosslt import node, values
from rosslt.flow import Flow, NotDrawn, ProvenanceMap, Step, dot, svg
from rosslt.markers import Graph
from rosslt.messages import Message
from rosslt.web.drawing import MANY
from rosslt.web.markdown import code

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


class Look:
    """A part of somebody's page that follows the flow.

    Args:
        client: who looks.
    """

    def __init__(self, client: viser.ClientHandle) -> None:
        self.client_id = client.client_id

    def update(self, flow: Flow) -> None:
        """Show a flow."""
        raise NotImplementedError


class Shown(Look):
    """A drawing on somebody's page, where viser's next element would be.

    Args:
        client: who sees it.
        sources: gives the sources that are looked at.
        topic: where the ways of the sources lead that are written out; None for none.
    """

    def __init__(self, client: viser.ClientHandle, sources: SourcesOf, topic: Optional[str]) -> None:
        super().__init__(client)
        self._sources, self._topic = sources, topic
        self._text = client.gui.add_markdown('*listening to all topics*')
        self._picture = client.gui.add_html('')
        self._drawn = ''

    def update(self, flow: Flow) -> None:
        """Show a flow."""
        wanted = self._sources()
        sources = [source for source in flow.provenance.sources if wanted is None or source in wanted]
        self._text.content = '\n'.join(self._lines(flow, sources))
        drawn = dot(flow, node.directory(), node.directory().ordered(sources)[:MANY]) if sources else ''
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
        if len(sources) > MANY:
            lines.append('*{} of {} locations are drawn*'.format(MANY, len(sources)))
        return lines


class Flows:
    """All drawings, and what else follows the flow.

    Args:
        server: viser's.
        lock: of the page.
    """

    def __init__(self, server: viser.ViserServer, lock: ContextManager[bool]) -> None:
        self._server, self.lock = server, lock
        self._looks: List[Look] = []
        self._reader = node.TopicReader(self._take, is_exact=True)
        self._newest: Dict[Tuple[str, str], Message] = {}  # (topic, publisher) -> the last message
        self._provenance = ProvenanceMap()

    def add(self, client: viser.ClientHandle, sources: SourcesOf, topic: Optional[str] = None) -> Shown:
        """Show the flow of some sources to somebody, until it is removed; as in Shown."""
        shown = Shown(client, sources, topic)
        self.look(shown)
        return shown

    def look(self, look: Look) -> None:
        """Tell somebody's look of the flow, until it is removed."""
        with self.lock:
            self._looks.append(look)

    def remove(self, look: Look) -> None:
        """Nobody looks at it any more."""
        with self.lock:
            self._looks = [one for one in self._looks if one is not look]

    def newest(self, topic: str, publisher: str) -> Optional[Message]:
        """The last message of a publisher on a topic while somebody looks, or None."""
        with self.lock:
            return self._newest.get((topic, publisher))

    def open(self, client: viser.ClientHandle, title: str, sources: SourcesOf) -> None:
        """Show the flow of some sources to somebody in a window of its own."""
        modal = client.gui.add_modal(title)
        with modal:
            close = client.gui.add_button('Close')
            shown = self.add(client, sources)

        @close.on_click
        def closed(event: viser.GuiEvent) -> None:
            self.remove(shown)
            modal.close()

    def update(self, graph: Graph) -> None:
        """Show the present flow to all who look."""
        with self.lock:
            clients = self._server.get_clients()
            self._looks = looks = [one for one in self._looks if one.client_id in clients]
            newest = dict(self._newest)
        self._reader.follow(graph.types if looks else {})
        if not looks:
            self._newest, self._provenance = {}, ProvenanceMap()
            return
        for (topic, publisher), message in newest.items():
            self._provenance.add(topic, publisher, message)
        self._provenance.fields = {
            reach: fields
            for reach, fields in self._provenance.fields.items()
            if reach.publisher in graph.publishers.get(reach.topic, ())
        }
        node.directory().look_up(self._provenance.sources)
        flow = Flow(self._provenance, graph.subscribers)
        for one in looks:
            one.update(flow)

    def _take(self, heard: node.Heard) -> None:
        with self.lock:
            self._newest[heard.topic, heard.publisher] = heard.message


def written(source: values.Source, way: List[Step]) -> str:
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
