"""The buttons of a node: take its last change back, reset its numbers, show what they affect, and save them."""

import functools
from typing import Any, Callable, List

import rospy
import viser

from rosslt import files, msg, node, values
from rosslt.web.flows import Flows
from rosslt.web.locations import TIMEOUT, Locations
from rosslt.web.markdown import block

NOTHING_TO_SAVE = 'nothing to save: all is as the files say'

#: Called with (client, title, text) to show a notice to somebody.
Tell = Callable[[viser.ClientHandle, str, str], None]


class Buttons:
    """The buttons of all nodes.

    Args:
        server: viser's.
        locations: of all nodes.
        flows: shows what the numbers of a node affect.
        tell: shows a notice to somebody.
    """

    def __init__(self, server: viser.ViserServer, locations: Locations, flows: Flows, tell: Tell) -> None:
        self._server, self._locations, self._flows, self._tell = server, locations, flows, tell

    def add(self, name: str) -> None:
        """Add those of one node, where viser's next element would be."""
        does = {'undo': self._undo, 'reset': self._reset, 'save': self._ask_to_save, 'affects': self._show_flow}
        buttons = self._server.gui.add_button_group('', list(does))

        @buttons.on_click
        def clicked(event: viser.GuiEvent) -> None:
            if event.client is None:
                return
            try:
                does[event.target.value](name, event.client)
            except values.Error as error:
                self._tell(event.client, name, str(error))

    def _undo(self, name: str, client: viser.ClientHandle) -> None:
        found, _ = node.histories([name], '', TIMEOUT)
        last = node.last_change(found)
        if last is None:
            self._tell(client, name, 'there is no change to take back')
            return
        concerned, unknown = node.taking_part(self._locations.nodes(), last.request_id, TIMEOUT)
        if unknown:
            which = ' and '.join(unknown)
            self._tell(client, name, f'nothing is taken back: {which} may have changed, too, and does not answer')
            return
        undone = node.undo_request(last.request_id, concerned, rospy.get_name(), TIMEOUT)
        for other, reason in undone.reasons.items():
            self._tell(client, other, 'cannot undo: ' + reason)
        for other, changes in undone.changes.items():
            self._tell(client, other, ', '.join(map(_told, changes)))

    def _reset(self, name: str, client: viser.ClientHandle) -> None:
        found, silent = node.directory().ask([name], TIMEOUT)
        if name in silent:
            self._tell(client, name, 'it does not answer: ' + silent[name])
            return
        changed = node.request_values(node.values_in_code(found[name]), TIMEOUT)
        told = [
            f'{node.directory().name(source)}: {node.to_json(old)} → {node.to_json(new)}'
            for source, (old, new) in changed.items()
        ]
        self._tell(client, name, ', '.join(told) or 'all is as the code says')

    def _show_flow(self, name: str, client: viser.ClientHandle) -> None:
        """Show which fields of which topics the numbers affect, and through which nodes."""
        self._flows.open(
            client,
            'What {} affects'.format(name),
            lambda: {place.source for place in self._locations.places().get(name, ())},
        )

    def _ask_to_save(self, name: str, client: viser.ClientHandle) -> None:
        """Show what would be written, and ask whether it should."""
        edits, unsaved = node.changes_to_save(name, TIMEOUT)
        try:
            diff = files.unified_diff(edits)
        except files.FileError as error:
            self._tell(client, name, 'nothing can be saved: {}'.format(error))
            return
        left = '\n'.join('{} cannot be saved: {}'.format(one.name, one.reason) for one in unsaved)
        if not edits:
            self._tell(client, name, left or node.differing_in(name, TIMEOUT) or NOTHING_TO_SAVE)
            return
        modal = client.gui.add_modal('Save the changes of {}?'.format(name))
        with modal:
            client.gui.add_markdown(block(diff, 'diff'))
            if left:
                client.gui.add_markdown(block(left))
            write = client.gui.add_button('Write', color='green')
            leave = client.gui.add_button('Leave the files as they are')
        write.on_click(functools.partial(self._save, name, edits, modal))
        leave.on_click(lambda event: modal.close())

    def _save(self, name: str, edits: List[files.Edit], modal: Any, event: viser.GuiEvent) -> None:
        """Write what has been shown, and nothing else."""
        modal.close()
        try:
            files.write(edits)
        except files.FileError as error:
            self._tell(event.client, name, 'nothing is written: {}'.format(error))
        else:
            node.tell_saved(name, edits, TIMEOUT)
            saved = sorted({edit.file for edit in edits})
            self._tell(event.client, name, 'saved in ' + ', '.join(saved))


def _told(change: msg.AppliedChange) -> str:
    return '{}: {} → {}'.format(change.name, change.old_value, change.new_value)
