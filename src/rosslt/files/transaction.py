"""Several edits of several files: all of them or none, and as text for people beforehand."""

import difflib
import os
import re
from typing import Dict, List, Optional, Sequence, Tuple

from rosslt.files.atomic_replacement import read_bytes, replace_bytes
from rosslt.files.errors import FileError
from rosslt.files.python_source import Edit, digest_of, replaced

_EDITED = 'it was edited at this moment; try again'


def _contents(edits: Sequence[Edit]) -> Dict[str, Tuple[bytes, bytes]]:
    """{path: (content, content after the edits)}.

    Raises:
        FileError: a file is not there, holds another content than the edits are meant for, or would have to hold two
            things at one position.
    """
    by_file: Dict[str, List[Edit]] = {}
    for edit in edits:
        by_file.setdefault(os.path.realpath(edit.file), []).append(edit)
    contents = {}
    for path, parts in by_file.items():
        content = read_bytes(path)
        if any(digest_of(content) != edit.digest or content[edit.start : edit.end] != edit.old for edit in parts):
            raise FileError(path, None, None, _EDITED)
        contents[path] = content, replaced(content, _once(path, content, parts))
    return contents


def _once(path: str, content: bytes, edits: Sequence[Edit]) -> List[Edit]:
    """Edits of one file, each once: several nodes may have read the same number, and be saved together.

    Raises:
        FileError: they would write different things at one position.
    """
    found = {(edit.start, edit.end, edit.new): edit for edit in edits}
    ordered = sorted(found.values(), key=lambda edit: edit.start)
    for one, other in zip(ordered, ordered[1:]):
        if other.start < one.end:
            before = content[: one.start].decode('utf-8', 'replace')
            line, column = before.count('\n') + 1, len(before) - before.rfind('\n')
            wanted = ' and '.join(f'{edit.new.decode()} (for {edit.what})' for edit in (one, other))
            reason = f'several values were read here, and {one.old.decode()} cannot become both {wanted}'
            raise FileError(path, line, column, reason)
    return ordered


def write(edits: Sequence[Edit]) -> None:
    """Write edits into their files: all of them, or none.

    Raises:
        FileError: a file cannot be written, or was edited meanwhile; then all are as they were.
    """
    contents = _contents(edits)
    done: List[str] = []
    try:
        for path, (before, after) in contents.items():
            if not replace_bytes(path, before, after):
                raise FileError(path, None, None, _EDITED)
            done.append(path)
    except FileError as error:
        for path in reversed(done):
            before, after = contents[path]
            if not replace_bytes(path, after, before):
                raise FileError(
                    error.file, None, None, f'{error.reason}; {path}, which was edited since, stays changed'
                ) from None
        raise


def taking_back(edits: Sequence[Edit], digest: str) -> List[Edit]:
    """The edits that take edits of one file back.

    Args:
        edits: in any order, each once.
        digest: the hash of the file with the edits.
    """
    return [
        edit._replace(digest=digest, start=start, end=start + len(edit.new), old=edit.new, new=edit.old)
        for edit in edits
        for start in [edit.start + _growth([one for one in edits if one is not edit], edit.start)]
    ]


def beside(edits: Sequence[Edit], others: Sequence[Edit], digest: str) -> Optional[List[Edit]]:
    """Edits as they are once others have been done in their file; None if both would write at one place.

    Args:
        edits, others: each once, meant for the same content.
        digest: the hash of the file with the others.
    """
    if any(one.start < edit.end and edit.start < one.end for edit in edits for one in others):
        return None
    return [
        edit._replace(digest=digest, start=edit.start + grown, end=edit.end + grown)
        for edit in edits
        for grown in [_growth(others, edit.start)]
    ]


def _growth(edits: Sequence[Edit], place: int) -> int:
    """By how many bytes edits in front of a place move it."""
    return sum(len(edit.new) - len(edit.old) for edit in edits if edit.end <= place)


def unified_diff(edits: Sequence[Edit], context: int = 3) -> str:
    """Show edits as a unified diff that `patch -p0` takes.

    Bytes that are not in UTF-8 are surrogates in it, as in `surrogateescape`.

    Args:
        edits: of one or several files.
        context: the maximal number of lines around each change.

    Raises:
        FileError: as in `write`.
    """
    lines: List[str] = []
    for path, (before, after) in _contents(edits).items():
        # As `patch` counts lines: a form feed ends none.
        old, new = (re.findall(r'[^\n]*\n|[^\n]+', text.decode('utf-8', 'surrogateescape')) for text in (before, after))
        for line in difflib.unified_diff(old, new, path, path, n=context):
            lines.append(line if line.endswith('\n') else line + '\n\\ No newline at end of file\n')
    return ''.join(lines)
