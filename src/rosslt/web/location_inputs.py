"""The numbers of the page: a slider, a field or a box for each location, by node and by file.

A number without a slider has a text field. Its text is checked here and not by the browser, which would report
nothing if the text is not a number.
"""

import collections
import functools
import json
import math
import os
import time
from typing import Any, Callable, ContextManager, Dict, List, Mapping, Optional, Tuple

import viser

from rosslt.markers import contained
from rosslt.node import Place, origin_of
from rosslt.web.drawing import MANY
from rosslt.web.locations import PAUSE, Key, Locations, Wish, number_in

#: A slider has about so many steps.
STEPS = 1000

#: The mark of a changed location.
MARK = '● '


class Field:
    """The field of one location.

    Attributes:
        place: the location as its owner last reported it.
        widget: viser's.
        kind: all that its drawing depends on.
        typed: (who, text) of what waits for the end of typing, or None.
        touched: when a hand last moved it. The owner's reports do not move it until the hand pauses.
    """

    def __init__(self, place: Place, widget: Any, kind: Any) -> None:
        self.place, self.widget, self.kind = place, widget, kind
        self.typed: Optional[Tuple[viser.ClientHandle, str]] = None
        self.touched = -math.inf


class Numbers:
    """All fields.

    Args:
        server: viser's.
        lock: of the page.
        locations: what they show.
        add_buttons: called with the name of a node once its folder is there, to add its buttons to it.
        tell: called with (client, title, text) if a change is refused.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        lock: ContextManager[bool],
        locations: Locations,
        add_buttons: Callable[[str], None],
        tell: Callable[[viser.ClientHandle, str, str], None],
    ) -> None:
        self._server, self._lock, self._locations = server, lock, locations
        self._add_buttons, self._tell = add_buttons, tell
        self._folders: Dict[Tuple[str, ...], Any] = {}
        self._openers: Dict[Tuple[str, ...], viser.GuiButtonHandle] = {}  # of the folders that nobody has opened yet
        self._fields: Dict[Key, Field] = {}
        self._all = server.gui.add_checkbox('Show all numbers', False, hint='also those that give a formula its shape')
        self._hint = server.gui.add_markdown('Waiting for a node that has locations.')

    def update(self) -> None:
        """Show what the owners report now, and ask for what has been typed."""
        with self._lock:
            self._locations.shows_all = self._all.value
            places = self._locations.places()
            self._hint.visible = not places
            there = {(node, place.location.id): place for node, those in places.items() for place in those}
            for key in [key for key in self._fields if key not in there]:
                self._fields.pop(key).widget.remove()
            self._keep_folders(places)
            for order, (key, place) in enumerate(there.items()):
                with contained(f'{place.name} cannot be shown'):
                    self._show(key, place, order)
            for field in self._fields.values():
                if field.typed is not None and time.monotonic() - field.touched > PAUSE:
                    self._take_typed(field, *field.typed)

    def _keep_folders(self, places: Dict[str, List[Place]]) -> None:
        wanted: Dict[Tuple[str, ...], int] = {}  # {(node, or node and file): how many numbers there are}
        for node, those in places.items():
            wanted[(node,)] = len(those)
            wanted.update(collections.Counter((node, place.location.file) for place in those))
        # the folders of files before the folders of nodes that they are in
        for path in sorted(set(self._folders).difference(wanted), key=len, reverse=True):
            self._folders.pop(path).remove()
            if path in self._openers:
                self._openers.pop(path).remove()
        for path, count in wanted.items():
            if path not in self._folders:
                self._add_folder(path, count)
            if path in self._openers and self._openers[path].label != _opening(path, count):
                self._openers[path].label = _opening(path, count)

    def _add_folder(self, path: Tuple[str, ...], count: int) -> None:
        """Add the folder of a node, or that of a file: one with many numbers is a button until somebody opens it."""
        gui = self._server.gui
        if len(path) == 1:
            self._folders[path] = gui.add_folder(path[0])
            with self._folders[path]:
                self._add_buttons(path[0])
            return
        with self._folders[path[:1]]:
            folder = self._folders[path] = gui.add_folder(_file_name(path), visible=count <= MANY)
            if not folder.visible:
                opener = self._openers[path] = gui.add_button(_opening(path, count), color='gray')
                opener.on_click(functools.partial(self._open, path))

    async def _open(self, path: Tuple[str, ...], _event: viser.GuiEvent) -> None:
        with self._lock:
            if path in self._openers:
                self._openers.pop(path).remove()
                self._folders[path].visible = True

    def _show(self, key: Key, place: Place, order: float) -> None:
        kind, field = _kind(place), self._fields.get(key)
        if field is None or field.kind != kind:
            if field is not None:
                field.widget.remove()
            with self._folders[place.node, place.location.file]:
                field = self._fields[key] = Field(place, self._widget(place, order), kind)
            field.widget.on_update(functools.partial(self._moved, key))
        field.place = place
        if field.widget.order != order:
            field.widget.order = order
        label = (MARK if _is_changed(place) else '') + _label(place)
        if field.widget.label != label:
            field.widget.label = label
        is_quiet = time.monotonic() - field.touched > PAUSE and field.typed is None
        if is_quiet and field.widget.value != _shown(place):
            field.widget.value = _shown(place)

    def _widget(self, place: Place, order: float) -> Any:
        gui, value, told = self._server.gui, _shown(place), hint(place, self._locations.origins)
        fault = place.location.fault
        options = {'disabled': bool(place.read_only or fault), 'hint': told, 'order': order}
        if place.location.type == 'bool' and not fault:
            return gui.add_checkbox(_label(place), value, **options)
        if not _has_slider(place):
            return gui.add_text(_label(place), value, **options)
        number = int if place.location.type == 'int' else float
        low, high = number(place.minimum), number(place.maximum)
        return gui.add_slider(_label(place), low, high, _step(number, high - low), value, **options)

    async def _moved(self, key: Key, event: viser.GuiEvent) -> None:
        if event.client is None:  # it was this program
            return
        with self._lock:
            field = self._fields.get(key)
            if field is None or field.place.read_only or field.place.location.fault:
                return
            field.touched = time.monotonic()
            if field.kind[0] in ('slider', 'bool'):
                self._wish(field, event.client, field.widget.value)
            else:
                field.typed = event.client, field.widget.value

    def _take_typed(self, field: Field, client: viser.ClientHandle, text: str) -> None:
        field.typed, field.touched = None, time.monotonic()
        value, why = (text, '') if field.kind[0] == 'str' else number_in(field.place, text)
        if why:
            self._refuse(field, client, why)
        else:
            self._wish(field, client, value)

    def _wish(self, field: Field, client: viser.ClientHandle, value: object) -> None:
        told = functools.partial(self._tell, client, f'{_label(field.place)} is changed')
        refused = functools.partial(self._refuse, field, client)
        self._locations.wish(field.place, Wish(value, str(client.client_id), refused, told))

    def _refuse(self, field: Field, client: viser.ClientHandle, reason: str) -> None:
        """Say why a value is not taken; the field goes back to the one in force."""
        self._tell(client, f'{_label(field.place)} stays {field.place.location.value}', reason)
        field.touched = -math.inf


def _file_name(path: Tuple[str, ...]) -> str:
    return os.path.basename(path[1]) or 'parameters'


def _opening(path: Tuple[str, ...], count: int) -> str:
    """The text of the button that opens the folder of a file."""
    return f'{_file_name(path)}: show {count} numbers'


def _kind(place: Place) -> Tuple[Any, ...]:
    """All that the drawing of a field depends on: the kind of field first."""
    location = place.location
    kind = 'fault' if location.fault else 'slider' if _has_slider(place) else location.type
    return (kind, location.type, location.minimum, location.maximum, location.read_only, location.file, location.line)


def _is_changed(place: Place) -> bool:
    """Return whether a location has another value than the code says."""
    literal, value = place.location.literal, place.location.value
    return bool(literal and value) and literal != value and bool(json.loads(literal) != json.loads(value))


def _has_slider(place: Place) -> bool:
    """Return whether a location is a number between two bounds; a getter may be beyond them."""
    if place.location.fault or place.location.type not in ('int', 'float'):
        return False
    if place.minimum is None or place.maximum is None:
        return False
    return bool(place.minimum < place.maximum and place.minimum <= place.value <= place.maximum)


def _shown(place: Place) -> Any:
    """Return the text or value in the field of a location: its value, or why it has none."""
    if place.location.fault:
        return place.location.fault
    if place.location.type == 'bool':
        return bool(place.value)
    if _has_slider(place):
        return (int if place.location.type == 'int' else float)(place.value)
    return str(place.value)


def _step(number: Any, length: float) -> Any:
    """The step of a field: a power of ten that divides a length into about STEPS."""
    if number is int or not math.isfinite(length) or length <= 0.0:
        return number(1)
    return 10.0 ** math.floor(math.log10(length / STEPS))


def _label(place: Place) -> str:
    """The label of a field: the name of the location, else its line and column in the file that its folder names."""
    location = place.location
    return place.local_name if location.is_named else 'line {}:{}'.format(location.line, location.column)


def hint(place: Place, origins: Mapping[str, Any]) -> str:
    """The hint of a field: where its number stands.

    Args:
        place: its location.
        origins: {full name of a parameter: where it is given}, as `rosslt launch` has noted it.
    """
    location = place.location
    line = '{}:{}'.format(location.file, location.line) if location.file else ''
    parts = [line or 'a parameter']
    if line and location.name.startswith('/'):  # a parameter's: the line is that which reads it
        given = origin_of(location.name, origins)
        parts = ['given in {}, read at {}'.format(given['file'], line) if given else 'a parameter, read at ' + line]
        if given and given['file'] == location.file:  # of a node that runs as it is: nobody knows where it reads it
            parts = ['given at ' + line]
    if location.literal:
        parts.append('the code says ' + location.literal)
    if location.read_only:
        parts.append('it takes no change')
    if location.at_next_start:
        parts.append('a change ' + location.at_next_start)
    elif location.plain_copies:
        parts.append(location.plain_copies)
    return ', '.join(parts)
