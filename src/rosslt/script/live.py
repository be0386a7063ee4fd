"""A live script: the text in force, a location for each number in it, and what happens when somebody changes it.

Two kinds of writers meet in the file. A source change rewrites one number. A person saves a whole text, which may
have been typed while numbers were rewritten. Neither loses: see `LiveScript`.
"""

import functools
import hashlib
import itertools
import os
import re
import threading
import time
from typing import (
    Any,
    Callable,
    Collection,
    Dict,
    Iterable,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Set,
    Tuple,
)

from rosslt import files, node, values
from rosslt.script import literals, running
from rosslt.script.errors import ScriptError
from rosslt.script.running import Step

#: The maximal age of a text that somebody began to edit and saved over newer numbers, in seconds. The numbers are then
#: put into the saved text. Editors themselves warn of older texts.
STALE = 2.0

#: The maximal number of retries of a change while others write the file.
ATTEMPTS = 100


class Settings(NamedTuple):
    """The precision that numbers are rounded to when they are rewritten, and the most steps of a script."""

    precision: float
    step_limit: int


DEFAULT_SETTINGS = Settings(0.001, running.STEP_LIMIT)


class _State(NamedTuple):
    """A version of the script: its text, a record for each number, and the resulting steps."""

    parsed: literals.Parsed
    places: List['_Place']
    steps: List[Step]


class LiveScript:
    """A script in force.

    A number in it keeps its location, and so its id, while numbers are rewritten and while somebody edits other
    lines. On a line that somebody has edited, numbers get new locations, and the old ones are gone: a change that
    was meant for the text before is refused.

    Args:
        path: the script's file.
        add, remove: as `node.add_location` and `node.remove_location`; make and forget locations.
        take: called with (steps, whether the script differs in its numbers alone) when a script comes into force.
        report: called with the ScriptError when a text cannot; the one before stays, or none at the start.
        settings: Settings.
        remembered: called with the text at the start; the names that the locations of that very text had in an
            earlier run, if that is known.
        remember: called with the text and the names whenever one of these has changed.

    Raises:
        ScriptError: the file cannot be read.
    """

    def __init__(
        self,
        path: str,
        add: Callable[..., Any],
        remove: Callable[[Any], None],
        take: Callable[[List[Step], bool], None],
        report: Callable[[ScriptError], None],
        settings: Settings = DEFAULT_SETTINGS,
        remembered: Callable[[str], Sequence[str]] = lambda text: (),
        remember: Callable[[str, Sequence[str]], None] = lambda text, names: None,
    ) -> None:
        self.path = path
        self._add, self._remove = add, remove
        self._take, self._report, self._settings = take, report, settings
        self._remember = remember
        # No location is made or forgotten while it is held.
        self._lock = threading.RLock()
        self._refused: Optional[str] = None  # a text in the file that cannot come into force
        # (time at which it was no longer in force, _State), since somebody saved a text
        self._past: List[Tuple[float, _State]] = []
        self._reserved: Set[str] = set()  # names of records in texts that are not in force yet
        text = files.read_settled(path)
        self._state = _State(literals.parse('', path), [], [])
        try:
            parsed, names = literals.parse(text, path), remembered(text)
            made = self._made(parsed, {}, dict(enumerate(names)) if len(names) == len(parsed.literals) else None)
        except ScriptError as error:
            self._refused = text
            report(error)
        else:
            self._reserved.clear()
            self._come_into_force(made, False)

    def reload(self) -> None:
        """Take in the text that is in the file, if it is another one than that in force."""
        for _ in range(ATTEMPTS):
            with self._lock:
                if files.holds(self.path, self._state.parsed.text):
                    self._note_mended()
                    return
                if self._refused is not None and files.holds(self.path, self._refused):
                    return
            try:
                if self._take_in(files.read_settled(self.path)):
                    return
            except files.Unsettled:
                continue  # it may be changes that do not let it settle
            except ScriptError as error:
                self._report(error)
                return

    def _change(self, place: '_Place', value: float) -> None:
        """Rewrite a number; the setter of its location.

        Raises:
            ScriptError: it is no longer in the script, or the script cannot run with the new value.
        """
        for _ in range(ATTEMPTS):
            with self._lock:
                state, text = self._state, files.read(self.path)
                if text == self._refused:
                    raise ScriptError(self.path, None, None, 'it has an error, which has to be corrected first')
                if text == state.parsed.text:
                    if place not in state.places:
                        raise ScriptError(self.path, None, None, '{} is no longer in it'.format(place.name))
                    index = state.places.index(place)
                    parsed = literals.rewritten(state.parsed, index, value, self._settings.precision, self.path)
                    if parsed is state.parsed:
                        return
                    steps = self._run(parsed, state.places)
                    if files.replace(self.path, text, parsed.text):
                        self._come_into_force(_State(parsed, state.places, steps), True)
                        return
            # Somebody has saved another text, and the watch has not read it yet.
            self._take_in(files.read_settled(self.path))
        raise files.Unsettled(self.path, None, None, 'other programs keep writing it')

    def _take_in(self, text: str) -> bool:
        """Have a text that somebody has saved come into force, or report why it cannot.

        Returns:
            False where the file holds yet another one by now.
        """
        with self._lock:
            if not files.holds(self.path, text):
                return False
            state = self._state
            base = self._base(text)
            if text == state.parsed.text:
                self._note_mended()
                return True
        try:
            parsed = literals.parse(text, self.path)
            known = {new: base.places[old] for old, new in literals.followed(base.parsed, parsed).items()}
            made = self._made(self._caught_up(parsed, base, state), known)
        except ScriptError as error:
            with self._lock:
                is_news, self._refused = self._refused != text, text
            if is_news:
                self._report(error)
            return True
        gone, kept = made.places, state.places
        try:
            with self._lock:
                if self._state is state and (
                    files.holds(self.path, text)
                    if made.parsed.text == text
                    else files.replace(self.path, text, made.parsed.text)
                ):
                    self._come_into_force(made, made.parsed.skeleton == state.parsed.skeleton)
                    self._past.clear()
                    gone, kept = kept, gone
        finally:
            with self._lock:
                self._reserved.difference_update([place.name for place in made.places])
            self._forget(gone, kept)
        return kept is made.places

    def _note_mended(self) -> None:
        """Say that the script in force is in the file again, where a text was refused since."""
        if self._refused is not None:
            self._refused = None
            self._take(self._state.steps, True)

    def _base(self, text: str) -> _State:
        """The state that somebody has begun with who has saved a text: of the recent ones, the most similar."""
        oldest = time.monotonic() - STALE
        recent = [self._state] + [state for until, state in reversed(self._past) if until > oldest]
        return min(recent, key=lambda state: literals.difference(state.parsed.text, text))

    def _caught_up(self, parsed: literals.Parsed, base: _State, state: _State) -> literals.Parsed:
        """A script that somebody has begun with one state, with the numbers that were rewritten since."""
        if base is state:
            return parsed
        for old, index in literals.followed(base.parsed, parsed, in_whole_lines=False).items():
            value = state.parsed.literals[old].value
            if value != base.parsed.literals[old].value:
                parsed = literals.rewritten(parsed, index, value, self._settings.precision, self.path)
        return parsed

    def _made(
        self, parsed: literals.Parsed, known: Mapping[int, '_Place'], names: Optional[Dict[int, str]] = None
    ) -> _State:
        """The state of a script that is not in force yet.

        Args:
            known: {index of a literal: the record that it has already}.
            names: {index of a literal: the name of its new record}, where these are remembered.

        Raises:
            ScriptError: it cannot come into force; then no location is left of it.
        """
        places: List[Any] = [known.get(index) for index in range(len(parsed.literals))]
        missing = [index for index, place in enumerate(places) if place is None]
        with self._lock:
            if names is None:
                names = self._names(parsed, missing)
            self._reserved.update(names.values())
        try:
            for index in missing:
                place = _Place(names[index], parsed.literals[index].value)
                place.location = self._add(
                    place.name,
                    self._site(parsed.text, parsed.literals[index]),
                    place.read,
                    functools.partial(self._change, place),
                )
                places[index] = place
            return _State(parsed, places, self._run(parsed, places))
        except BaseException:
            self._forget([place for place in places if place is not None], known.values())
            with self._lock:
                self._reserved.difference_update(names.values())
            raise

    def _names(self, parsed: literals.Parsed, indices: Iterable[int]) -> Dict[int, str]:
        """{index of a literal: a name for it}: where it stands in which text, so that no other number ever has it."""
        stem = re.sub(r'\W', '_', os.path.splitext(os.path.basename(self.path))[0], flags=re.ASCII)
        digest = hashlib.blake2b(parsed.text.encode('utf-8'), digest_size=4).hexdigest()
        taken = {place.name for place in self._state.places} | self._reserved
        names = {}
        for index in indices:
            line, column = parsed.literals[index][2:4]
            base = name = 'script_{}_{}_{}_{}'.format(stem, line, column, digest)
            turns = itertools.count(2)
            while name in taken:
                name = '{}_{}'.format(base, next(turns))
            names[index] = name
        return names

    def _run(self, parsed: literals.Parsed, places: Sequence['_Place']) -> List[Step]:
        numbers = [
            values.track(literal.value, place.location.source) for literal, place in zip(parsed.literals, places)
        ]
        return running.run(parsed, numbers, self.path, self._settings.step_limit)

    def _come_into_force(self, state: _State, is_same_but_for_numbers: bool) -> None:
        now = time.monotonic()
        self._past = [(until, past) for until, past in self._past if until > now - STALE] + [(now, self._state)]
        self._state, self._refused = state, None
        for place, literal in zip(state.places, state.parsed.literals):
            place.value = float(literal.value)
            place.location.site = self._site(state.parsed.text, literal)
        self._remember(state.parsed.text, [place.name for place in state.places])
        self._take(state.steps, is_same_but_for_numbers)

    def _forget(self, places: Iterable['_Place'], kept: Collection['_Place']) -> None:
        for place in places:
            if place not in kept:
                self._remove(place.location)

    def _site(self, text: str, literal: files.Number) -> node.CallSite:
        line = text[: literal.start].rpartition('\n')[2] + text[literal.start :].partition('\n')[0]
        return node.CallSite(os.path.abspath(self.path), literal.line, literal.column, line)


class _Place:
    """A number as it lives on while the text changes around it.

    Attributes:
        name: of its location.
        value: the one in force, always a float: an integer in a script can become any number.
        location: what `add` has made.
    """

    __slots__ = ('name', 'value', 'location')

    def __init__(self, name: str, value: float) -> None:
        self.name, self.value = name, float(value)
        self.location: Any = None

    def read(self) -> float:
        """The value; the getter of its location."""
        return self.value
