"""A live script: the text in force, a location for each number in it, and what happens when somebody changes it.

Two kinds of writers meet in the file. A source change rewrites one number. A person saves a whole text, which is never
overwritten by a change: see `LiveScript`.
"""

import functools
import itertools
import os
import re
import threading
from decimal import Decimal
from typing import Any, Callable, Collection, Dict, Iterable, List, NamedTuple, Optional, Sequence

from rosslt import files, node, values
from rosslt.script import execution
from rosslt.script.execution import Step

#: A script, or a change of one, that cannot come into force.
ScriptError = files.FileError

#: The maximal number of retries of a change while others write the file.
ATTEMPTS = 100


class Settings(NamedTuple):
    """The precision that numbers are rounded to when they are rewritten, and the most steps of a script."""

    precision: float
    step_limit: int


DEFAULT_SETTINGS = Settings(0.001, execution.STEP_LIMIT)


class _State(NamedTuple):
    """A version of the script: its text, a record for each number and the row that it is in, and the resulting
    steps."""

    source: files.SourceText
    numbers: List['_Number']
    rows: List[str]
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
        remembered: called with the digest of the text at the start; the names that the locations of that very text had
            in an earlier run, if that is known.
        remember: called with the digest of the text and the names whenever one of these has changed.
        numbers_of_rows: called with the digests of the text in force and of one that is in the file instead; for each
            number of that, its index in the former, None for a new one; none at all if that is not known.

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
        remembered: Callable[[str], Sequence[str]] = lambda digest: (),
        remember: Callable[[str, Sequence[str]], None] = lambda digest, names: None,
        numbers_of_rows: Callable[[str, str], Sequence[Optional[int]]] = lambda before, after: (),
    ) -> None:
        self.path = path
        self._add, self._remove = add, remove
        self._take, self._report, self._settings = take, report, settings
        # Nobody may hold a lock that `add` and `remove` take while calling a setter: a node calls it without its own.
        self._lock = threading.RLock()
        self._refused: Optional[bytes] = None  # a content of the file that cannot come into force
        self._state = _State(files.SourceText(path, b''), [], [], [])
        self._remember, self._numbers_of_rows = remember, numbers_of_rows
        content = files.read_settled_bytes(path)
        self._take_in(content, remembered(files.digest_of(content)))

    def reload(self) -> None:
        """Take in the text of the file, if it differs from the one in force."""
        for _ in range(ATTEMPTS):
            with self._lock:
                if files.holds(self.path, self._state.source.content):
                    self._note_mended()
                    return
                if files.holds(self.path, self._refused):
                    return
            try:
                if self._take_in(files.read_settled_bytes(self.path)):
                    return
            except files.Unsettled:
                continue  # changes by this script may keep the file unsettled
            except ScriptError as error:
                self._report(error)
                return

    def _change(self, number: '_Number', value: float) -> None:
        """Rewrite a number; the setter of its location.

        Raises:
            ScriptError: it is no longer in the script, or the script cannot run with the new value.
        """
        for _ in range(ATTEMPTS):
            with self._lock:
                state, content = self._state, files.read_bytes(self.path)
                if content == self._refused:
                    raise ScriptError(self.path, None, None, 'it has an error, which has to be corrected first')
                if content == state.source.content:
                    if number not in state.numbers:
                        raise ScriptError(self.path, None, None, '{} is no longer in it'.format(number.name))
                    rounded_value = rounded(value, self._settings.precision)
                    edits = state.source.edits({state.numbers.index(number): rounded_value})
                    if not edits:
                        return
                    source = files.SourceText(self.path, files.replaced(content, edits))
                    steps = self._run(source, state.numbers)
                    if files.replace_bytes(self.path, content, source.content):
                        self._come_into_force(state._replace(source=source, steps=steps), True)
                        return
            # Somebody has saved another text, and the watch has not read it yet.
            self._take_in(files.read_settled_bytes(self.path))
        raise files.Unsettled(self.path, None, None, 'other programs keep writing it')

    def _take_in(self, content: bytes, names: Sequence[str] = ()) -> bool:
        """Have a text that somebody has saved come into force, or report why it cannot.

        Args:
            names: of its locations, if these are remembered.

        Returns:
            False if the file was changed again meanwhile.
        """
        before, after = self._state.source, files.digest_of(content)
        which = self._numbers_of_rows(before.digest, after) if after != before.digest else ()
        with self._lock:
            which = which if self._state.source is before else ()
            if not files.holds(self.path, content):
                return False
            if content == self._state.source.content:
                self._note_mended()
                return True
            try:
                made = self._made(files.SourceText(self.path, content), names, which)
                is_same_but_for_numbers = made.source.skeleton == self._state.source.skeleton
            except ScriptError as error:
                if content != self._refused:
                    self._refused = content
                    self._report(error)
                return True
            gone = self._state.numbers
            self._come_into_force(made, is_same_but_for_numbers)
            self._forget(gone, made.numbers)
            return True

    def _note_mended(self) -> None:
        """Say that the script in force is in the file again, if a text was refused since."""
        if self._refused is not None:
            self._refused = None
            self._take(self._state.steps, True)

    def _made(self, source: files.SourceText, names: Sequence[str], which: Sequence[Optional[int]]) -> _State:
        """The state of a text that somebody has saved; numbers keep their locations if it is known which they are, else
        those in lines that read the same.

        Raises:
            ScriptError: it cannot come into force; then no location is left of it.
        """
        records = self._records(source, which)
        numbers: List[_Number] = []
        taken = {number.name for number in self._state.numbers}
        try:
            for index, literal in enumerate(source.numbers):
                number = records.get(index)
                if number is None:
                    is_remembered = len(names) == len(source.numbers)
                    name = names[index] if is_remembered else self._name(source, literal, taken)
                    taken.add(name)
                    number = self._new_number(name, source, literal)
                numbers.append(number)
            return _State(source, numbers, files.rows_of_numbers(source), self._run(source, numbers))
        except BaseException:
            self._forget(numbers, records.values())
            raise

    def _records(self, source: files.SourceText, which: Sequence[Optional[int]]) -> Dict[int, '_Number']:
        """{index of a number in a text that somebody has saved: the one of the text in force that it is}."""
        numbers = self._state.numbers
        kept = {new: old for new, old in enumerate(which) if old is not None}
        is_known = len(which) == len(source.numbers) and len(set(kept.values())) == len(kept)
        if is_known and all(type(old) is int and 0 <= old < len(numbers) for old in kept.values()):
            return {new: numbers[old] for new, old in kept.items()}
        known = files.followed(self._state.source, source, exactly=True).literals
        return {new: numbers[old] for old, new in known.items() if old < len(numbers)}

    def _name(self, source: files.SourceText, literal: files.Literal, taken: Collection[str]) -> str:
        """A name for a new number: where it appeared in which text, so that no other number ever has it."""
        stem = re.sub(r'\W', '_', os.path.splitext(os.path.basename(self.path))[0], flags=re.ASCII)
        base = name = 'script_{}_{}_{}_{}'.format(stem, literal.line, literal.column, source.digest[:8])
        turns = itertools.count(2)
        while name in taken:
            name = '{}_{}'.format(base, next(turns))
        return name

    def _new_number(self, name: str, source: files.SourceText, literal: files.Literal) -> '_Number':
        number = _Number(name, float(literal.value))
        number.location = self._add(
            name, self._site(source, literal), number.read, functools.partial(self._change, number)
        )
        return number

    def _run(self, source: files.SourceText, numbers: Sequence['_Number']) -> List[Step]:
        tracked = [
            values.track(literal.value, number.location.source) for literal, number in zip(source.numbers, numbers)
        ]
        return execution.run(source, tracked, self._settings.step_limit)

    def _come_into_force(self, state: _State, is_same_but_for_numbers: bool) -> None:
        self._state, self._refused = state, None
        for number, literal, row in zip(state.numbers, state.source.numbers, state.rows):
            number.value = float(literal.value)
            number.location.site = self._site(state.source, literal)
            number.location.row = row and f'{os.path.abspath(self.path)}:{row}'
        self._remember(state.source.digest, [number.name for number in state.numbers])
        self._take(state.steps, is_same_but_for_numbers)

    def _forget(self, numbers: Iterable['_Number'], kept: Iterable['_Number']) -> None:
        for number in set(numbers).difference(kept):
            self._remove(number.location)

    def _site(self, source: files.SourceText, literal: files.Literal) -> node.CallSite:
        line = source.text[: literal.start].rpartition('\n')[2] + source.text[literal.start :].partition('\n')[0]
        return node.CallSite(os.path.abspath(self.path), literal.line, literal.column, line)


class _Number:
    """A number as it lives on while the text changes around it.

    Attributes:
        name: of its location.
        value: the one in force, always a float: an integer in a script can become any number.
        location: what `add` has made.
    """

    __slots__ = ('name', 'value', 'location')

    def __init__(self, name: str, value: float) -> None:
        self.name, self.value = name, value
        self.location: Any = None

    def read(self) -> float:
        """The value; the getter of its location."""
        return self.value


def rounded(value: float, precision: float) -> float:
    """The multiple of a precision that is nearest to a number."""
    if abs(value) > precision * 2**53:  # there are no digits to round
        return float(value)
    return float(round(value / precision) * Decimal(repr(precision)))
