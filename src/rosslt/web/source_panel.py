"""The source beside the view: what each visitor sees of the files that numbers come from, and does there.

A visitor has a WebSocket. Both sides send JSON objects: the page what has changed of `SourcePanel._state`, and what
there is to say; a browser what `SourcePanel._take` takes.
"""

import asyncio
import collections
import contextlib
import json
from typing import Any, ContextManager, Deque, Dict, List, Optional, Set, Tuple

from websockets.exceptions import ConnectionClosed
from websockets.http11 import Response

from rosslt import files, values
from rosslt.markers import Graph, contained
from rosslt.node import Place
from rosslt.web import documents, saving, site
from rosslt.web.location_inputs import hint
from rosslt.web.locations import Locations, Wish, value_in

#: The path of the connections.
PATH = '/source'

#: The period at which visitors are told what has changed, in seconds.
PERIOD = 0.1


class BadMessage(Exception):
    """A message of a browser that is refused; says why."""


class Visitor:
    """Somebody who looks at the panel.

    Attributes:
        name: who has the wishes.
        file: the file that is open; '' for none.
        offer: the diff of the file that the browser shows, or None.
        hovers: the number that the mouse is over, or None.
        basis: what the state that the browser has was made of.
        sent: what the browser has of the state: {name: JSON}, and of the values.
        to_say: messages that are not part of the state.
    """

    def __init__(self, name: str) -> None:
        self.name, self.file = name, ''
        self.offer: Optional[saving.Offer] = None
        self.hovers: Optional[values.Source] = None
        self.basis: object = None
        self.sent: Dict[str, str] = {}
        self.sent_values: Dict[str, Any] = {}
        self.to_say: Deque[Dict[str, Any]] = collections.deque()


class SourcePanel:
    """The panels of all visitors; a `Site`.

    Args:
        lock: of the page.
        locations: whose files are shown.

    Attributes:
        selected: the sources of the things that are selected in the view, those that are their own first.
    """

    def __init__(self, lock: ContextManager[bool], locations: Locations) -> None:
        self._lock, self._locations = lock, locations
        self.selected: List[values.Source] = []
        self._visitors: Set[Visitor] = set()
        self._count = 0
        self._documents: Dict[str, Tuple[Any, documents.Document]] = {}  # and what each was made of

    def hovered(self) -> Set[values.Source]:
        """The numbers that a mouse is over."""
        with self._lock:
            return {visitor.hovers for visitor in self._visitors if visitor.hovers is not None}

    def look(self, _graph: Graph) -> None:
        """Read the files anew that somebody looks at and that have changed, or whose locations have."""
        with self._lock:
            wanted = {visitor.file for visitor in self._visitors}
            self._documents = {file: known for file, known in self._documents.items() if file in wanted}
        for file, places in self._files().items():
            if file in wanted:
                with contained(f'{file} cannot be shown'):
                    self._read(file, places)

    def response(self, target: str) -> Optional[Response]:
        """The answer to a request for a file of the page, as of a Site."""
        return site.response(target)

    def talks_at(self, target: str) -> bool:
        """Return whether connections at a path are those of panels, as of a Site."""
        return target.partition('?')[0] == PATH

    async def talk(self, connection: Any) -> None:
        """Serve a visitor, as of a Site."""
        loop = asyncio.get_running_loop()
        with self._lock:
            self._count += 1
            visitor = Visitor(f'source {self._count}')
            self._visitors.add(visitor)
        telling = asyncio.create_task(self._tell(connection, visitor))
        try:
            with contextlib.suppress(ConnectionClosed):
                async for text in connection:
                    await loop.run_in_executor(None, self._take, visitor, text)
        finally:
            telling.cancel()
            with self._lock:
                self._visitors.remove(visitor)

    async def _tell(self, connection: Any, visitor: Visitor) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                # What is said of a change comes after the change.
                said = [visitor.to_say.popleft() for _ in range(len(visitor.to_say))]
                news: Dict[str, Any] = {}
                with contained('the source cannot be shown'):
                    news = self._news(visitor)
                for message in filter(None, [news, *said]):
                    await connection.send(json.dumps(message))
                await asyncio.sleep(PERIOD)

    def _news(self, visitor: Visitor) -> Dict[str, Any]:
        """What of the state a visitor does not know yet."""
        with self._lock:
            basis = (
                self._locations.reports,
                self._locations.shows_all,
                self.selected,
                visitor.file,
                self._known(visitor),
            )
        if basis == visitor.basis:
            return {}
        visitor.basis = basis
        state, present = self._state(visitor)
        told = {name: json.dumps(value) for name, value in state.items()}
        news = {name: value for name, value in state.items() if visitor.sent.get(name) != told[name]}
        sent = {} if 'document' in news else visitor.sent_values
        changed = {name: value for name, value in present.items() if sent.get(name) != value}
        visitor.sent, visitor.sent_values = told, present
        return {**news, 'values': changed} if changed else news

    def _state(self, visitor: Visitor) -> Tuple[Dict[str, Any], Dict[str, Any]]:
        """All that a visitor sees: files, the open document, what is selected; and the values of the numbers in it."""
        there = self._files()
        by_key = {documents.key_of(place): place for places in there.values() for place in places}
        selected = [(source, by_key.get((source.node, source.location_id))) for source in self.selected]
        state: Dict[str, Any] = {
            'files': [
                {'file': file, 'nodes': sorted({place.node for place in places})} for file, places in there.items()
            ],
            'selected': [
                {'number': _name(source), 'file': self._file_of(place)}
                for source, place in selected
                if place is not None
            ],
        }
        with self._lock:
            known = self._known(visitor)
        if known is None or visitor.file not in there:
            return {**state, 'document': None}, {}
        document = known[1]
        marks = [(by_key[key], mark) for key, mark in document.marks.items() if key in by_key]
        numbers = [
            {
                'number': _name(place.source),
                'name': place.name,
                'type': place.location.type,
                'line': mark.line,
                'column': mark.column,
                'token': mark.token,
            }
            for place, mark in marks
        ]
        given = self._locations.origins
        shown = {'file': visitor.file, 'text': document.text, 'notes': document.notes, 'numbers': numbers}
        return {**state, 'document': shown}, {_name(place.source): _value(place, mark, given) for place, mark in marks}

    def _known(self, visitor: Visitor) -> Optional[Tuple[Any, documents.Document]]:
        """The file that a visitor looks at, and what it was made of."""
        return self._documents.get(visitor.file)

    def _files(self) -> Dict[str, List[Place]]:
        """{file: the locations in it}, sorted."""
        found: Dict[str, List[Place]] = {}
        for places in self._locations.places().values():
            for place in places:
                file = self._file_of(place)
                if file:
                    found.setdefault(file, []).append(place)
        return dict(sorted(found.items()))

    def _file_of(self, place: Place) -> str:
        return documents.file_of(place, self._locations.origins)

    def _read(self, file: str, places: List[Place]) -> None:
        try:
            content = files.read_bytes(file)
        except files.FileError as error:
            basis, document = None, documents.Document('', {}, [str(error)])
        else:
            origins = self._locations.origins
            reported = [
                (
                    documents.key_of(place),
                    place.location.line,
                    place.location.column,
                    place.location.literal,
                    origins.get(place.location.name),
                )
                for place in places
            ]
            basis = content, reported
            with self._lock:
                known = self._documents.get(file)
            if known is not None and known[0] == basis:
                return
            document, is_complete = documents.read(file, content, places, origins)
            if not files.holds(file, content):
                return  # the owners may have told of another content; the next look reads it again
            if not is_complete:
                basis = None  # so does the next look
        with self._lock:
            self._documents[file] = basis, document

    def _take(self, visitor: Visitor, text: Any) -> None:
        """Do what a browser wants, or say why not."""
        takes = {'open': self._open, 'hover': self._hover, 'wish': self._wish, 'diff': self._diff, 'save': self._save}
        try:
            try:
                message = json.loads(text)
            except (ValueError, RecursionError) as error:
                raise BadMessage(f'this is not JSON: {error}') from None
            if not isinstance(message, dict) or len(message) != 1 or not takes.keys() >= message.keys():
                raise BadMessage(f'a message is an object with one of {", ".join(takes)}')
            ((kind, content),) = message.items()
            takes[kind](visitor, content)
        except BadMessage as error:
            visitor.to_say.append({'refused': str(error)})
        except Exception:  # others go on using the connection
            visitor.to_say.append({'refused': 'this has failed; the log of `rosslt web` says why'})
            with contained('what somebody does in the source has failed'):
                raise

    def _open(self, visitor: Visitor, file: Any) -> None:
        """Open a file that a location stands in."""
        there = self._files()
        if not isinstance(file, str) or file not in there:
            raise BadMessage('no location stands in this file')
        self._read(file, there[file])
        visitor.file, visitor.offer = file, None

    def _hover(self, visitor: Visitor, number: Any) -> None:
        """Have what a number moves marked in the view; nothing for None, and for a number whose node has just ended."""
        if not (number is None or isinstance(number, str)):
            raise BadMessage('a hover is over a number, by its name, or over null')
        source = None
        with contextlib.suppress(BadMessage):
            source = self._place(number).source
        with self._lock:
            visitor.hovers = source

    def _wish(self, visitor: Visitor, wish: Any) -> None:
        """Have a number changed: what is typed, and a turn, within which all changes are undone as one."""
        if not isinstance(wish, dict) or not isinstance(wish.get('text'), str) or type(wish.get('turn')) is not int:
            raise BadMessage('a wish has the number, a text and a turn')
        number = wish.get('number')
        place = self._place(number)
        if self._file_of(place) != visitor.file:  # its node was started anew from another file
            raise BadMessage('this number is not in the open file')

        def decided() -> None:
            visitor.to_say.append({'decided': {'number': number, 'text': wish['text']}})

        def refused(reason: str) -> None:
            decided()
            visitor.to_say.append({'said': f'{place.local_name} stays {place.location.value}: {reason}'})

        def told(text: str) -> None:
            visitor.to_say.append({'said': f'{place.local_name} is changed: {text}'})

        def taken() -> None:
            decided()
            if place.location.at_next_start:
                told(f'it {place.location.at_next_start}')

        value, why = value_in(place, wish['text'])
        why = _why_fixed(place) or why
        if why:
            refused(why)
        else:
            self._locations.wish(place, Wish(value, visitor.name, refused, told, taken, wish['turn']))

    def _diff(self, visitor: Visitor, file: Any) -> None:
        """Show what saving would write into the open file, with all that this visitor has wished."""
        places = self._files().get(visitor.file)
        if places is None or file != visitor.file:
            raise BadMessage('this file is not open')
        self._locations.wait_for_wishes()
        offered = saving.offer(file, places)
        visitor.offer = offered if offered.edits else None
        shown = {'file': file, 'lines': offered.lines} if offered.edits else None
        visitor.to_say.append({'diff': shown, 'said': '\n'.join(offered.left)})

    def _save(self, visitor: Visitor, file: Any) -> None:
        """Write the diff that this visitor sees."""
        offered, visitor.offer = visitor.offer, None
        if offered is None or file != visitor.file:
            raise BadMessage('there is no diff to save')
        visitor.to_say.append({'diff': None, 'said': saving.write(offered)})

    def _place(self, number: Any) -> Place:
        """The location of a number, as the page names it.

        Raises:
            BadMessage: there is none.
        """
        for place in (place for places in self._files().values() for place in places):
            if _name(place.source) == number:
                return place
        raise BadMessage('there is no such number')


def _name(source: values.Source) -> str:
    """What a number is called in messages."""
    return f'{source.node} {source.location_id}'


def _why_fixed(place: Place) -> str:
    """Why a location takes no change; '' if it does."""
    location = place.location
    if location.fault or location.locked:
        return str(location.fault or location.locked)
    if place.read_only:
        return 'it takes no change'
    # A parameter that has just got a value of another kind is reported with its new type later.
    has_lines = isinstance(place.value, str) and documents.NEWLINE.search(place.value)
    return 'a text of several lines is not typed here' if has_lines else ''


def _value(place: Place, mark: documents.Mark, given: Any) -> Dict[str, Any]:
    """What of a value changes: the one in force, written as in the file, and what is to be known of it."""
    location = place.location
    is_as_written = bool(location.fault) or files.equal(place.value, mark.value)
    return {
        'text': mark.token if location.fault else _written(place, mark, is_as_written),
        'changed': not is_as_written,
        'value': location.value,
        'minimum': location.minimum,
        'maximum': location.maximum,
        'fixed': _why_fixed(place),
        'hint': hint(place, given),
    }


def _written(place: Place, mark: documents.Mark, is_as_written: bool) -> str:
    """The value in force, in the manner of the file; a text as it is, without quotes."""
    if isinstance(place.value, str):
        return place.value
    if is_as_written:
        return mark.token
    if isinstance(place.value, bool):
        return next(files.notations(mark.token, place.value))
    return files.in_manner_of(mark.token, place.value)
