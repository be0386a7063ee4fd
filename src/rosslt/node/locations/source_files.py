"""Finds the values of this node in its source files, and makes the edits that save changed values there."""

import contextlib
import os
from typing import Any, Collection, Dict, Iterable, List, Optional, Set, Tuple

from rosslt import files
from rosslt.node.locations.location import Location, ParameterLocation
from rosslt.node.locations.mutex import CHANGE_LOCK

#: ({index of a literal in a file as it was loaded: who reads it}, the file now, {index then: index now}).
_Present = Tuple[Dict[int, List[Location]], files.SourceText, Dict[int, int]]


class NotWritten(Exception):
    """A value that stands in no file, or no longer; the text says why."""


class SourceFiles:
    """The source files of this process, as they were when their code was loaded."""

    def __init__(self) -> None:
        self._contents: Dict[str, bytes] = {}
        self._originals: Dict[str, files.SourceText] = {}
        # Values that were about to be written: if the file has one of them, nobody else has edited it.
        self._offered: Dict[Location, Set[Any]] = {}
        self._offered_digests: Set[str] = set()
        # {digest of what a save makes of a file: {index of a literal when it was loaded: its index there}}.
        self._saved: Dict[str, Dict[int, int]] = {}

    def keep(self, path: str, content: Optional[bytes] = None) -> None:
        """Remember a file.

        Args:
            path: of the file. One that is known already stays as it is.
            content: what was loaded; by default what is there now.
        """
        path = os.path.realpath(path)
        if path not in self._contents:
            try:
                self._contents[path] = files.read_bytes(path) if content is None else content
            except files.FileError:  # code that came from no file
                self._contents[path] = b''

    def original(self, path: str) -> files.SourceText:
        """A file as it was loaded.

        Raises:
            files.FileError: it has no content that could be read.
        """
        path = os.path.realpath(path)
        known = self._originals.get(path)
        if known is None:
            content = self._contents.get(path)
            if not content:
                raise files.FileError(path, None, None, 'it is not known what it said when it was loaded')
            known = self._originals[path] = files.SourceText(path, content)
        return known

    def is_saved_here(self, digest: str) -> bool:
        """Return whether a file's present content is a result of `edits`.

        Each content is recognized once only, since a user may restore it later.
        """
        with CHANGE_LOCK:
            is_saved = digest in self._offered_digests
            self._offered_digests.discard(digest)
            return is_saved

    def followed(
        self, original: files.SourceText, present: files.SourceText, locations: Collection[int]
    ) -> files.Followed:
        """`files.followed`, and what is known of the literals of a file that a save has written."""
        result = files.followed(original, present, locations)
        saved = self._saved.get(present.digest, {})
        lines = {present.literals[index].line for index in saved.values()}
        return result._replace(
            literals={**result.literals, **saved}, lines=[line for line in result.lines if line not in lines]
        )

    def edits(
        self, locations: Iterable[Location]
    ) -> Tuple[List[Tuple[Location, files.Edit]], List[Tuple[Location, str]]]:
        """Make the edits that write changed values of locations back to the source files.

        Args:
            locations: all those of this node.

        Returns:
            ([(location, edit), ...], [(changed location, why it cannot be written back), ...]).
        """
        by_file = _by_file(locations)
        edits: List[Tuple[Location, files.Edit]] = []
        left: List[Tuple[Location, str]] = []
        for path, those in by_file.items():
            changed = [one for one in those if not files.equal(one.value, one.value_in_code) or one in self._offered]
            if not changed:
                continue
            try:
                now = self._present(self.original(path), those)
                made, others = _edits_of_file(now, self.original(path), changed, self._offered)
            except files.FileError as error:
                left += [(location, str(error)) for location in changed]
            else:
                edits += made
                left += others
                for location, _ in made:
                    self._offered.setdefault(location, set()).add(location.value)
                if made:
                    digest = files.digest_of(files.replaced(now[1].content, [edit for _, edit in made]))
                    self._offered_digests.add(digest)
                    self._saved[digest] = now[2]
        return edits, left

    def places(self, locations: Iterable[Location]) -> Dict[Location, Tuple[int, int, Any]]:
        """Find the literals of locations in their files as these are now.

        Args:
            locations: all those of this node.

        Returns:
            {location that is read from a source file: (line, column, value there)}, from 1; (0, 0, None) where that is
            not certain.
        """
        found: Dict[Location, Tuple[int, int, Any]] = {}
        for path, those in _by_file(locations).items():
            found.update(dict.fromkeys(those, (0, 0, None)))
            with contextlib.suppress(files.FileError):
                readers, present, indices = self._present(self.original(path), those)
                for index, after in indices.items():
                    literal = present.literals[after]
                    where = (literal.line, literal.column, literal.value)
                    found.update(dict.fromkeys(readers.get(index, ()), where))
        return found

    def _present(self, original: files.SourceText, those: List[Location]) -> _Present:
        readers: Dict[int, List[Location]] = {}
        for location in those:
            index = location.find_in(original)
            if index is not None:
                readers.setdefault(index, []).append(location)
        present = files.SourceText(original.path, files.read_bytes(original.path))
        return readers, present, self.followed(original, present, readers).literals


def _by_file(locations: Iterable[Location]) -> Dict[str, List[Location]]:
    """{path: those that are read from this source file}."""
    found: Dict[str, List[Location]] = {}
    for location in locations:
        if location.value_in_code is not None:
            found.setdefault(os.path.realpath(location.site.file), []).append(location)
    return found


def _edits_of_file(
    now: _Present, original: files.SourceText, changed: List[Location], offered: Dict[Location, Set[object]]
) -> Tuple[List[Tuple[Location, files.Edit]], List[Tuple[Location, str]]]:
    """Make the edits of one file, for `SourceFiles.edits`."""
    readers, present, indices = now
    wanted: Dict[int, Any] = {}
    owners: Dict[int, Location] = {}
    left: List[Tuple[Location, str]] = []
    for location in changed:
        try:
            index = _index_of(location, original, indices, readers)
            value = present.literals[index].value
            if not any(
                files.equal(value, one) for one in (location.value_in_code, location.value, *offered.get(location, ()))
            ):
                raise NotWritten(
                    f'what stands at {location.place} was edited since it was read or saved: '
                    f'{present.path} says {value!r} now'
                )
        except NotWritten as why:
            if not files.equal(location.value, location.value_in_code):  # else it was saved before
                left.append((location, str(why)))
            continue
        if not files.equal(value, location.value):
            wanted[index], owners[index] = location.value, location
    return list(zip((owners[index] for index in sorted(wanted)), present.edits(wanted))), left


def _index_of(
    location: Location, original: files.SourceText, indices: Dict[int, int], readers: Dict[int, List[Location]]
) -> int:
    """The index of the literal in its present file that is a location's value.

    Raises:
        NotWritten: there is none, or the value must not be written there.
    """
    if location.unsaved:
        raise NotWritten(location.unsaved)
    index = location.find_in(original)
    if index is None:
        name = original.name_of_argument(location.site.line, location.site.column, 1, 'default')
        if name and isinstance(location, ParameterLocation):
            raise NotWritten(f'the default at {location.place} is {name}, and no literal: set what {name} comes from')
        raise NotWritten(
            f'it is not a number, a truth value or a text in one piece on a line of its own at {location.place}'
        )
    if not files.alike(location.value, location.value_in_code):
        raise NotWritten(
            f'{location.value!r} is of another kind than {location.value_in_code!r}, which {location.place} said'
        )
    if location.is_shared:
        raise NotWritten(f'its name is given in several places of the code, not at {location.place} alone')
    if any(other.value != location.value for other in readers[index]):
        raise NotWritten(f'what stands at {location.place} is that of several locations, with other values')
    if index not in indices:
        raise NotWritten(f'the line of {location.place} was edited since it was read')
    return indices[index]


#: The source files of this process.
SOURCE_FILES = SourceFiles()
