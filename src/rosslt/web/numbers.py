"""The numbers of the page: a slider, a field or a box for each location, by node and by file."""

import functools
import math
import os
import threading
import time
import traceback
from typing import Any, Callable, Dict, List, Tuple

import rospy

from rosslt.node import Place
from rosslt.web.locations import Key, Locations

#: A slider has about so many steps.
STEPS = 1000

#: The fields of a file with more of them are not seen before somebody opens their folder: a browser draws each.
MANY = 50

#: How long a person may pause while typing into a field, in seconds: what stands there then is wanted.
TYPING = 0.7

#: For how long after a hand has moved a field the owner's reports do not move it, in seconds.
HAND_IS_ON_IT = 0.5

#: The largest whole number that a browser tells from the next one.
LARGEST = 2**53

#: What marks a location that has been changed.
MARK = '● '


class Field:
    """The field of one location.

    Attributes:
        place: the location as its owner last reported it.
        widget: viser's.
        kind: all that its drawing depends on.
        typed: (when, who, value) of what waits for the end of typing, or None.
        touched: when a hand last moved it.
    """

    def __init__(self, place: Place, widget: Any, kind: Any) -> None:
        self.place, self.widget, self.kind = place, widget, kind
        self.typed: Any = None
        self.touched = -math.inf


class Numbers:
    """All fields.

    Args:
        server: viser's.
        locations: what they show.
        add_buttons: called with the name of a node once its folder is there, to add its buttons to it.
        tell: called with (client, title, text) where a change is refused.
    """

    def __init__(
        self,
        server: Any,
        locations: Locations,
        add_buttons: Callable[[str], None],
        tell: Callable[[Any, str, str], None],
    ) -> None:
        self._server, self._locations = server, locations
        self._add_buttons, self._tell = add_buttons, tell
        self._lock = threading.RLock()
        self._folders: Dict[Tuple[str, ...], Any] = {}
        self._fields: Dict[Key, Field] = {}
        self._hint = server.gui.add_markdown('Waiting for a node that has locations.')

    def update(self) -> None:
        """Show what the owners report now, and ask for what has been typed."""
        with self._lock:
            places = self._locations.places()
            self._hint.visible = not places
            there = {(node, place.location.id): place for node, those in places.items() for place in those}
            for key in [key for key in self._fields if key not in there]:
                self._fields.pop(key).widget.remove()
            self._keep_folders(places)
            for order, (key, place) in enumerate(there.items()):
                try:
                    self._show(key, place, order)
                except Exception:  # one odd location must not hide all others
                    rospy.logerr_throttle(30, '%s cannot be shown\n%s', place.name, traceback.format_exc())
            self._apply_typed()

    def follow(self) -> None:
        """Show what has changed since the last call; this takes little where there are many fields."""
        with self._lock:
            for key, place in self._locations.fresh().items():
                if key in self._fields:
                    self._show(key, place, self._fields[key].widget.order)

    def _keep_folders(self, places: Dict[str, List[Place]]) -> None:
        wanted: Dict[Tuple[str, ...], str] = {}
        for node, those in places.items():
            wanted[(node,)] = node
            for place in those:
                wanted[node, place.location.file] = os.path.basename(place.location.file) or 'parameters'
        # the folders of files before the folders of nodes that they are in
        for path in sorted(set(self._folders).difference(wanted), key=len, reverse=True):
            self._folders.pop(path).remove()
        for path, label in wanted.items():
            if path in self._folders:
                continue
            if len(path) == 1:
                self._folders[path] = self._server.gui.add_folder(label)
                with self._folders[path]:
                    self._add_buttons(label)
            else:
                count = sum(place.location.file == path[1] for place in places[path[0]])
                with self._folders[path[:1]]:
                    self._folders[path] = self._server.gui.add_folder(label, expand_by_default=count <= MANY)

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
        label = (MARK if self._locations.is_changed(place) else '') + _label(place)
        if field.widget.label != label:
            field.widget.label = label
        is_quiet = time.monotonic() - field.touched > HAND_IS_ON_IT and field.typed is None
        value = _text(place) if kind[0] == 'text only' else place.value
        if is_quiet and field.widget.value != value:
            field.widget.value = value

    def _widget(self, place: Place, order: float) -> Any:
        gui, value = self._server.gui, place.value
        options = {'disabled': place.read_only, 'hint': _hint(place), 'order': order}
        if _kind(place)[0] == 'text only':
            return gui.add_text(_label(place), _text(place), **{**options, 'disabled': True})
        if place.location.type == 'bool':
            return gui.add_checkbox(_label(place), bool(value), **options)
        if place.location.type == 'str':
            return gui.add_text(_label(place), str(value), **options)
        low, high = place.minimum, place.maximum
        number = int if place.location.type == 'int' else float
        if low is not None and high is not None and low < high:
            return gui.add_slider(
                _label(place), number(low), number(high), _step(number, high - low), number(value), **options
            )
        limits = {name: number(bound) for name, bound in (('min', low), ('max', high)) if bound is not None}
        return gui.add_number(_label(place), number(value), step=_step(number, abs(value) or 1.0), **limits, **options)

    async def _moved(self, key: Key, event: Any) -> None:
        if event.client is None:  # it was this program
            return
        with self._lock:
            field = self._fields.get(key)
            if field is None or field.place.read_only or field.kind[0] == 'text only':
                return
            value, field.touched = field.widget.value, time.monotonic()
            if field.kind[0] in ('slider', 'bool'):
                self._wish(field, event.client, value)
            else:
                field.typed = (field.touched, event.client, value)

    def _apply_typed(self) -> None:
        now = time.monotonic()
        for field in self._fields.values():
            if field.typed is not None and now - field.typed[0] > TYPING:
                _, client, value = field.typed
                field.typed = None
                self._wish(field, client, value)

    def _wish(self, field: Field, client: Any, value: Any) -> None:
        place = field.place

        def refused(reason: str) -> None:
            self._tell(client, '{} stays {}'.format(_label(place), place.location.value), reason)
            field.touched = -math.inf

        self._locations.wish(place, value, str(client.client_id), refused)


def _kind(place: Place) -> Tuple[Any, ...]:
    """All that the drawing of a field depends on: the kind of field first."""
    location = place.location
    kind = 'text only' if location.fault else location.type
    if kind in ('int', 'float'):
        low, high = place.minimum, place.maximum
        kind = 'slider' if low is not None and high is not None and low < high else 'number'
        if any(isinstance(one, int) and abs(one) > LARGEST for one in (place.value, low, high)):
            kind = 'text only'
    return (kind, location.type, location.minimum, location.maximum, location.read_only, location.file, location.line)


def _text(place: Place) -> str:
    """What stands in a field that takes no change: why there is no value, or one that is too large."""
    return place.location.fault or str(place.value)


def _step(number: Any, length: float) -> Any:
    """The step of a field: a power of ten that divides a length into about STEPS."""
    if number is int or not math.isfinite(length) or length <= 0.0:
        return number(1)
    return 10.0 ** math.floor(math.log10(length / STEPS))


def _label(place: Place) -> str:
    """What a field is called: the name of the location, else where it stands in the file that its folder names."""
    location = place.location
    return place.local_name if location.is_named else 'line {}:{}'.format(location.line, location.column)


def _hint(place: Place) -> str:
    location = place.location
    parts = ['{}:{}'.format(location.file, location.line) if location.file else 'a parameter']
    if location.literal:
        parts.append('the code says ' + location.literal)
    if location.read_only:
        parts.append('it takes no change')
    return ', '.join(parts)
