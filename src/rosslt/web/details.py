"""What a click on a thing shows: where its numbers come from, which of them a drag changes, and undo."""

import functools
import threading
from typing import Any, Collection, Dict, List

from rosslt import values
from rosslt.markers import Choice, Descriptions, Drags, Handle, Scene, choices_of
from rosslt.web.markdown import code
from rosslt.web.plots import Plot
from rosslt.web.things import Things

#: Free movement, as the menu in RViz calls it.
FREE = 'Move the body freely'

#: What marks the choice that is in force.
CHOSEN = '✓ '


class Details:
    """The details of things, for whoever clicks on one.

    Args:
        scene: has the things.
        things: shows them.
        drags: changes what is chosen, and undoes.
        descriptions: says what sources are called and where they are.
    """

    def __init__(self, scene: Scene, things: Things, drags: Drags, descriptions: Descriptions) -> None:
        self._scene, self._things, self._drags, self._descriptions = scene, things, drags, descriptions
        self._lock = threading.Lock()
        self._plots: Dict[Any, Plot] = {}  # what is open -> its plot

    def show(self, client: Any, handle: Handle) -> None:
        """Show somebody the details of a thing."""
        handle = self._scene.handle(handle.name) or handle
        name, sources = handle.name, values.sources(handle.tracked)
        self._descriptions.look_up(sources)
        present = values.source_values(handle.tracked)
        choices = choices_of(handle.tracked, self._descriptions.read_only(sources))
        with self._lock:
            modal = client.gui.add_modal(name)
            with modal:
                client.gui.add_markdown(self._text(handle, sources, present))
                if len(choices) > 1:
                    self._add_choices(client, name, choices, present)
                if all(handle.motions(self._descriptions.can_change).axes):
                    self._add_free(client, name)
                undo = client.gui.add_button('Undo the last drag')
                close = client.gui.add_button('Close')
                plot = Plot(client, self._scene, name, self._descriptions)
        undo.on_click(lambda event: self._drags.undo(name))
        close.on_click(lambda event: self._close(client, modal))
        with self._lock:
            self._plots[client.client_id, modal] = plot

    def update(self, clients: Collection[int]) -> None:
        """Continue the plots of what is open.

        Args:
            clients: the ids of those who still look.
        """
        with self._lock:
            self._plots = {key: plot for key, plot in self._plots.items() if key[0] in clients}
            for plot in self._plots.values():
                plot.update()

    def _close(self, client: Any, modal: Any) -> None:
        with self._lock:
            self._plots.pop((client.client_id, modal), None)
        modal.close()

    def _text(self, handle: Handle, sources: List[values.Source], present: Dict[values.Source, Any]) -> str:
        """Markdown: the expressions, the sources, and who sends them on."""
        lines = ['**Where it comes from**', '']
        lines += ['- {:.6g} = {}'.format(float(one), code(values.explain(one))) for one in handle.tracked]
        lines += ['', '**The numbers behind it**', '']
        for source in sources:
            note = ', takes no change' if source in self._descriptions.read_only([source]) else ''
            brief, full = self._descriptions.one(source, present), self._descriptions.in_full(source)
            lines.append('- {} ({}){}'.format(code(brief), code(full), note))
        topic, publisher = self._scene.origin(handle.name)
        owners = ' and '.join(sorted({source.node for source in sources}))
        lines += ['', code('{} → … → {} → {}'.format(owners, publisher, topic))]
        return '\n'.join(lines)

    def _add_choices(self, client: Any, name: str, choices: List[Choice], present: Dict[values.Source, Any]) -> None:
        """A button for each choice: a list to open would be open at once, and hide what is below it."""
        client.gui.add_markdown('**A drag changes**')
        titles = [self._descriptions.several(choice.changed, present) for choice in choices]
        buttons = [client.gui.add_button(title, color='gray') for title in titles]

        def show() -> None:
            sources = [choice.source for choice in choices]
            chosen = self._drags.chosen.get(name)
            at = sources.index(chosen) if chosen in sources else 0
            for index, (button, title) in enumerate(zip(buttons, titles)):
                button.label = (CHOSEN if index == at else '') + title

        def choose(choice: Choice, _event: Any) -> None:
            self._drags.chosen[name] = choice.source
            show()

        for button, choice in zip(buttons, choices):
            button.on_click(functools.partial(choose, choice))
        show()

    def _add_free(self, client: Any, name: str) -> None:
        box = client.gui.add_checkbox(FREE, name in self._things.free)

        @box.on_update
        def free(event: Any) -> None:
            (self._things.free.add if box.value else self._things.free.discard)(name)
