"""Where a location is created: the call, its place in a file, and what identifies it after the file was edited."""

import dis
import linecache
import os
import re
from types import FrameType
from typing import Any, NamedTuple


class CallSite(NamedTuple):
    """A call in a file: line and column count from 1, `text` is the line."""

    file: str
    line: int
    column: int
    text: str

    @property
    def place(self) -> str:
        """It, for people: `talker.py:12:9`."""
        return f'{os.path.basename(self.file)}:{self.line}:{self.column}'


def call_site(frame: FrameType) -> CallSite:
    """File, line, column (from 1) and text of the call that a frame is making.

    The column comes from `co_positions` (Python 3.11); before that, the offset of the call's instruction from the
    first one of its line stands in for it: it tells two calls on one line apart and is as stable as the line.
    """
    code, line = frame.f_code, frame.f_lineno
    column = frame.f_lasti + 1 - min(offset for offset, at in dis.findlinestarts(code) if at == line)
    positions = getattr(code, 'co_positions', None)
    if positions is not None:
        start_line, _, start_column, _ = list(positions())[frame.f_lasti // 2]
        if start_line is not None and start_column is not None:
            line, column = start_line, start_column + 1
    return CallSite(code.co_filename, line, column, linecache.getline(code.co_filename, line))


def identity_of(site: CallSite, key: Any) -> str:
    """What makes a location at a call site itself: not the number that is written there, which may be
    edited."""
    text = re.sub(r'[-+]?[\d.]+(e[-+]?\d+)?', '0', ''.join(site.text.split()))
    return f'{os.path.realpath(site.file)}\n{site.line}\n{site.column}\n{text}\n{key}'


def name_of(site: CallSite, key: Any) -> str:
    """A parameter's name for a call site that was given none: `talker_12_9`."""
    stem = os.path.splitext(os.path.basename(site.file))[0]
    parts = [stem, str(site.line), str(site.column)]
    if key is not None:
        parts.append(str(key))
    name = re.sub(r'\W', '_', '_'.join(parts), flags=re.ASCII)
    return name if name[0].isalpha() else 'l_' + name
