"""Output: tables that fit a terminal, and lines with tabs for a pipe."""

import sys
from typing import List, Optional, Sequence

from rosslt import files, values
from rosslt.cli.failure import Failure
from rosslt.node import Directory, Place

#: The most names that one sentence gives.
MOST_NAMES = 5


def is_terminal() -> bool:
    """Return True if standard output is a terminal."""
    return sys.stdout.isatty()


def few(names: Sequence[str], between: str = ', ') -> str:
    """The first few of several names."""
    more = len(names) - MOST_NAMES
    return between.join(names[:MOST_NAMES]) + (f' and {more} more' if more > 0 else '')


def shortened(text: str, longest: int) -> str:
    """A text that is too long, with its middle left out."""
    if len(text) <= longest:
        return text
    end = (longest - 3) // 2
    return text[: longest - 3 - end] + '...' + text[len(text) - end :]


def table(rows: Sequence[Sequence[str]], indent: str = '', left: Optional[int] = None) -> List[str]:
    """Lines of aligned columns.

    Args:
        rows: the rows, with as many cells each.
        indent: stands in front of each line.
        left: the number of columns that are aligned to the left, by default all; the others hold numbers.
    """
    if not rows:
        return []
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    sides = [str.ljust if left is None or column < left else str.rjust for column in range(len(widths))]
    return [
        (indent + '  '.join([side(cell, width) for side, cell, width in zip(sides, row, widths)])).rstrip()
        for row in rows
    ]


def write_note(verb: str, text: str) -> None:
    """Print a sentence: on a terminal beside the rest, in a pipe on standard error, as its lines have columns."""
    if is_terminal():
        print(text)
    else:
        print(f'rosslt {verb}: {text}', file=sys.stderr)


def write_diff(diff: str) -> None:
    """Print a unified diff of `files.unified_diff` as the bytes of the files, whatever they are encoded in, or `patch`
    would not know them again."""
    sys.stdout.flush()
    sys.stdout.buffer.write(diff.encode('utf-8', 'surrogateescape'))
    sys.stdout.buffer.flush()


def write_row(*cells: object) -> None:
    """Print one line with tabs between its cells; a tab or a line break within one would begin another."""
    row = '\t'.join(
        str(cell).replace('\\', r'\\').replace('\t', r'\t').replace('\n', r'\n').replace('\r', r'\r') for cell in cells
    )
    sys.stdout.write(row + '\n')  # at once: Ctrl-C may come between a row and its end


def write_result(line: str, *cells: object) -> None:
    """Print a line on a terminal, and cells in a pipe."""
    if is_terminal():
        print(line)
    else:
        write_row(*cells)


def write_text(path: str, text: str) -> None:
    """Write a text into a file; `-` is standard output.

    Raises:
        Failure: the file cannot be written, or is read-only.
    """
    if path == '-':
        sys.stdout.write(text)
        return
    try:
        files.overwrite(path, text)
    except files.FileError as error:
        raise Failure(str(error)) from None


def limits(place: Place) -> str:
    """Describe the limits of a location for a table: `0.5 .. 10.0`, `read-only`, or nothing."""
    location = place.location
    if location.read_only:
        return 'read-only'
    if location.minimum or location.maximum:
        return f'{location.minimum} .. {location.maximum}'.strip()
    return ''


def write_change(
    directory: Directory,
    source: values.Source,
    old: str,
    new: str,
    is_planned: bool = False,
    more: Sequence[object] = (),
) -> None:
    """Print that a source was changed, or would be.

    Args:
        directory: the Directory that may know its name, file and line.
        old, new: its values as texts.
        more: further cells, for a pipe.
    """
    place, name, planned = directory.of(source), directory.name(source), 'would change ' if is_planned else ''
    at = f'  [{place.short_file}]' if place else ''
    write_result(f'{planned}{name}: {old} -> {new}{at}', name, old, new, place.file if place else '', *more)
