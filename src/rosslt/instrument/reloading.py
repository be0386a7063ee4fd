"""Takes in what somebody edits in the source files of a running node.

Literals that were edited take effect at once: each is followed to where it stands now, and its location gets the number
that stands there, and the bounds of the comment beside it. Everything else that is another than when the node was
started is named, and needs a restart.
"""

import ast
import contextlib
import os
import threading
from typing import Any, Callable, Dict, List, Optional, Set

import rospy

from rosslt import files, node
from rosslt.instrument.cells import Cells, loaded_files
from rosslt.instrument.literals import SourceText, directives, find_literals
from rosslt.instrument.states import find_states

_lock = threading.Lock()
_watched: Set[str] = set()
_watch: Optional[files.FileWatch] = None
_is_started = False


def start() -> None:
    """Begin, once there is a node. The files are watched from a thread of their own: the node does not wait for it."""
    global _is_started
    with _lock:
        if _is_started:
            return
        _is_started = True
    threading.Thread(target=_begin, name='rosslt reloading', daemon=True).start()


def _begin() -> None:
    node.look_at_files_with(_look)
    for cells in loaded_files():
        watch(cells.path)
    _look()  # they may have been edited since they were loaded


def watch(path: str) -> None:
    """Watch a file that runs rewritten, if there is a node already."""
    global _watch
    with _lock:
        if not _is_started or path in _watched:
            return
        _watched.add(path)
        if _watch is None:
            _watch = files.FileWatch(path, _look)
        else:
            _watch.add(path)


def _look() -> List[str]:
    """Take in what the files say now.

    Returns:
        What else is another there, which needs a restart of the node: a text for each file.
    """
    readers = [_Reader.of(cells) for cells in loaded_files()]
    for reader in readers:
        with _lock:  # the watch looks, and so does who saves
            reader.look()
    return [f'{os.path.basename(reader.path)}: {reader.stale}' for reader in readers if reader.stale]


class _Reader:
    """Applies the changed literals of one file to its cells.

    Args:
        cells: its numbers.

    Attributes:
        path: of the file.
        stale: what else is another in the file than in the node, and what takes that in; '' if nothing is.
    """

    def __init__(self, cells: Cells) -> None:
        self._cells = cells
        self.path = cells.path
        self._digest = cells.digest  # of the content that was taken in last
        self._said: Dict[int, Any] = {}  # {index in the file as it was loaded: what was taken in last}
        self.stale = self._told = ''  # what was told of that content

    @classmethod
    def of(cls, cells: Cells) -> '_Reader':
        """The one of these cells."""
        return _readers.setdefault(id(cells), cls(cells))

    def look(self) -> None:
        """Take in the content of the file, if it has changed."""
        try:
            if self._is_seen():
                self.stale = self._told
                return
            content = files.read_settled_bytes(self._cells.path)
            digest = files.digest_of(content)
            if digest == self._digest:
                self.stale = self._told
                return
            new = files.SourceText(self._cells.path, content)
            original = node.SOURCE_FILES.original(self._cells.path)
        except files.Unsettled:
            self.stale = 'somebody keeps writing it'  # who is heard again
            return
        except files.FileError as error:
            stale = f'the node goes on with what was read before: {error.reason}'
            if stale != self.stale:
                rospy.logwarn('%s: the node goes on with what was read before', error)
            self.stale = stale
            return
        self._digest = digest
        self._take(original, new, node.SOURCE_FILES.is_saved_here(digest))

    def _is_seen(self) -> bool:
        """Return whether the file has the same content as before."""
        with contextlib.suppress(files.FileError):
            return files.digest_of(files.read_bytes(self._cells.path)) == self._digest
        return False

    def _take(self, original: files.SourceText, new: files.SourceText, is_saved_here: bool) -> None:
        numbers = self._numbers(original)
        locations = self._locations(numbers)
        result = node.SOURCE_FILES.followed(original, new, {*locations, *node.read_at(self._cells.path)})
        taken, refused = [], []
        try:
            taken += self._take_bounds(numbers, new, result.literals)
            self._identify(numbers, new, result.literals)
        except ValueError as error:
            refused.append(f'bounds ({error})')
        for before, after in sorted(result.literals.items()):
            literal = new.literals[after]
            if before not in locations or literal.value == self._said.get(before, original.literals[before].value):
                continue
            self._said[before] = literal.value
            location = locations[before]()
            if location is None:
                continue
            try:
                # A module that is loaded again may have taken it in before.
                if node.reread(location, literal.value, is_saved_here):
                    taken.append(f'{location.name} = {literal.value!r}')
            except ValueError as error:
                refused.append(f'{literal.value!r} in line {literal.line} ({error})')
        lines = files.changed_elsewhere(original, new, result, set(locations))
        said = [_of_lines(lines)] if lines else []
        said += ['lines that are gone'] if result.has_lost_lines else []
        stale = [f'{" and ".join(said)} changed in other ways'] if said else []
        stale += [f'{_of_lines(result.moved)} stand in another order'] if result.moved else []
        if not stale and not _has_same_blocks(original, new):
            stale = ['blocks of statements, or the blanks in a text, changed']
        self._tell([] if is_saved_here else taken, refused, ', and '.join(stale))

    def _take_bounds(self, numbers: Dict[int, int], new: files.SourceText, followed: Dict[int, int]) -> List[str]:
        """Give numbers the bounds that the comments say now; returns them as the log tells them.

        Raises:
            ValueError: a bound is not a number; all stay as they are.
        """
        limits_at = directives(new.tree, new.text)
        taken = []
        for before, after in sorted(followed.items()):
            limits = limits_at.get(new.literals[after].line, (None, None))
            if before not in numbers or limits == 'skip':  # which needs a restart
                continue
            minimum, maximum = limits
            number = numbers[before]
            literal = self._cells.literals[number]
            if (literal.minimum, literal.maximum) != limits:
                self._cells.literals[number] = literal._replace(minimum=minimum, maximum=maximum)
                location = self._cells.locations.get(number)
                if location is not None:
                    node.bound_anew(location, minimum, maximum)
                    low, high = ('' if limit is None else repr(limit) for limit in limits)
                    taken.append(f'{location.name} {f"in {low}..{high}" if low or high else "without bounds"}')
        return taken

    def _identify(self, numbers: Dict[int, int], new: files.SourceText, followed: Dict[int, int]) -> None:
        """Have numbers known by what the file says now: those of a table are known by the others in it.

        Raises:
            ValueError: a bound is not a number.
        """
        source, tree = SourceText(self._cells.path, new.content), ast.parse(new.content)
        found = find_literals(tree, source, find_states(tree))
        identities = {new.number_at(one.line, one.column): one.identity for _, one in found}
        for before, after in followed.items():
            number = numbers.get(before)
            if number is None or after not in identities:
                continue
            # One that nothing has read yet may have a changed value from an earlier run.
            is_other = identities[after] != self._cells.literals[number].identity
            location = self._cells.location(number) if is_other else self._cells.locations.get(number)
            if location is not None:
                node.identify(location, identities[after])

    def _numbers(self, original: files.SourceText) -> Dict[int, int]:
        """{index of a literal in the file as it was loaded: number of its cell}."""
        found = {original.number_at(one.line, one.column): at for at, one in enumerate(self._cells.literals)}
        return {index: number for index, number in found.items() if index is not None}

    def _locations(self, numbers: Dict[int, int]) -> Dict[int, Callable[[], Any]]:
        """{index of a literal in the file as it was loaded: gives the location that is read there}."""
        found: Dict[int, Callable[[], Any]] = {}
        for index, number in numbers.items():
            found[index] = lambda number=number: self._cells.location(number)  # type: ignore[misc]
        # The default of a parameter that is not set is that parameter's.
        for index, location in node.read_at(self._cells.path).items():
            if location.literal is None:
                found[index] = lambda location=location: location  # type: ignore[misc]
        return found

    def _tell(self, taken: List[str], refused: List[str], stale: str) -> None:
        """Log in one line which edits were taken in, and which need a restart."""
        parts = [', '.join(taken) + ' from now on'] if taken else []
        parts += [f'not taken: {", ".join(refused)}'] if refused else []
        stale = f'{stale}, which needs a restart of the node' if stale else ''
        if stale != self._told:
            parts += [stale] if stale else []
        self.stale = self._told = stale
        if parts:
            say = rospy.logwarn if refused else rospy.loginfo
            say('%s was edited: %s', os.path.basename(self._cells.path), '; '.join(parts))


def _has_same_blocks(one: files.SourceText, other: files.SourceText) -> bool:
    """Return whether the lines of two texts, which read the same, stand in the same blocks as well, as far as known."""
    with contextlib.suppress(files.FileError):  # nested too deeply
        return one.blocks() == other.blocks()
    return True


def _of_lines(lines: List[int]) -> str:
    return f'line{"s" if len(lines) > 1 else ""} {str(lines)[1:-1]}'


_readers: Dict[int, _Reader] = {}
