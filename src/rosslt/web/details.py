"""The details of a thing that was clicked: where it comes from, which numbers a drag changes, its row, and undo."""

import functools
from typing import Any, Dict, List, Sequence, Set

import viser

from rosslt import node, values
from rosslt.markers import FREE, HEADING, HOLD, ROW, ROW_OPERATIONS, UNDO, Choice, Handle, Offers
from rosslt.messages import Scalar
from rosslt.web.flows import Flows
from rosslt.web.markdown import code
from rosslt.web.plots import Plots
from rosslt.web.things import Things

#: The mark of an active choice.
CHOSEN = '✓ '


class Details:
    """The details of things, for whoever clicks on one.

    Args:
        offers: what there is to learn and to choose of things.
        things: shows them.
        flows: shows through which nodes their numbers come.
        plots: shows how they change.
    """

    def __init__(self, offers: Offers, things: Things, flows: Flows, plots: Plots) -> None:
        self._offers, self._things, self._flows, self._plots = offers, things, flows, plots
        self._scene, self._descriptions = offers.scene, offers.descriptions

    def show(self, client: viser.ClientHandle, handle: Handle) -> None:
        """Show somebody the details of a thing."""
        handle = self._scene.handle(handle.name) or handle
        name, sources = handle.name, self._descriptions.own_first(values.sources(handle.tracked))
        explained = [node.explain(one) for one in handle.tracked]
        present = values.source_values(handle.tracked)
        choices = self._offers.choices(handle)
        rows = self._offers.rows(choices)
        with self._things.lock:
            modal = client.gui.add_modal(name)
            with modal:
                client.gui.add_markdown(self._text(handle, explained, sources, present))
                if len(choices) > 1:
                    self._add_choices(client, handle, choices)
                if self._offers.can_be_free(handle):
                    self._add_free(client, name)
                self._add_hold(client, name)
                for of, row in rows:
                    self._add_row(client, name, row, f'{ROW} {of}' if len(rows) > 1 else ROW)
                undo = client.gui.add_button(UNDO)
                close = client.gui.add_button('Close')
                client.gui.add_markdown('**Data flow**')
                flow = self._flows.add(client, lambda: self._sources(name), self._scene.origin(name)[0])
                plot = self._plots.add(client, lambda: self._tracked(name))

        def closed(_event: viser.GuiEvent) -> None:
            with self._things.lock:
                self._flows.remove(flow)
                self._plots.remove(plot)
                modal.close()

        undo.on_click(lambda event: self._offers.drags.undo(name))
        close.on_click(closed)

    def _tracked(self, name: str) -> Sequence[Any]:
        handle = self._scene.handle(name)
        return () if handle is None else handle.tracked

    def _sources(self, name: str) -> Set[values.Source]:
        return set(values.sources(self._tracked(name)))

    def _text(
        self, handle: Handle, explained: List[str], sources: List[values.Source], present: Dict[values.Source, Scalar]
    ) -> str:
        """Markdown: the expressions, the sources, and who sends them on."""
        lines = ['**Where it comes from**', '']
        lines += ['- {:.6g} = {}'.format(float(one), code(text)) for one, text in zip(handle.tracked, explained)]
        if handle.basis is not None:
            lines += ['', handle.basis.text]
        lines += ['', '**The numbers behind it**', '']
        for source in sources:
            note = self._descriptions.why_fixed(source)
            brief, full = self._descriptions.one(source, present.get(source)), self._descriptions.in_full(source)
            lines.append('- {} ({}){}'.format(code(brief), code(full), ', ' + note if note else ''))
        return '\n'.join(lines)

    def _add_choices(self, client: viser.ClientHandle, handle: Handle, choices: List[Choice]) -> None:
        """A button for each choice: a list to open would be open at once, and hide what is below it."""
        client.gui.add_markdown('**{}**'.format(HEADING))
        titles = [self._offers.title(choice) for choice in choices]
        buttons = [client.gui.add_button(title, color='gray') for title in titles]

        def show() -> None:
            for choice, button, title in zip(choices, buttons, titles):
                button.label = (CHOSEN if self._offers.is_chosen(handle, choice) else '') + title

        def choose(choice: Choice, _event: viser.GuiEvent) -> None:
            self._offers.choose(handle, choice.source)
            show()

        for button, choice in zip(buttons, choices):
            button.on_click(functools.partial(choose, choice))
        show()

    def _add_free(self, client: viser.ClientHandle, name: str) -> None:
        box = client.gui.add_checkbox(FREE, name in self._things.free)

        @box.on_update
        def free(_event: viser.GuiEvent) -> None:
            (self._things.free.add if box.value else self._things.free.discard)(name)

    def _add_hold(self, client: viser.ClientHandle, name: str) -> None:
        box = client.gui.add_checkbox(HOLD, self._offers.is_in_place(name))
        box.on_update(lambda event: self._offers.set_in_place(name, event.target.value))

    def _add_row(self, client: viser.ClientHandle, name: str, row: values.Source, label: str) -> None:
        buttons = client.gui.add_button_group(label, list(ROW_OPERATIONS))
        buttons.on_click(lambda event: self._offers.edit_row(name, row, ROW_OPERATIONS[event.target.value]))
