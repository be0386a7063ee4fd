"""Where a location is created: the call, its place in a file, and what identifies it after the file was edited.

The places come from the syntax tree of the file, so that they are the same on every version of Python.
"""

import ast
import contextlib
import copy
import dis
import functools
import hashlib
import io
import linecache
import os
import re
import tokenize
from types import CodeType, FrameType
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple

#: Line numbers from here on are in no file; they distinguish calls in code that is compiled from a changed tree.
_FIRST_MARK = 1_000_000


class CallSite(NamedTuple):
    """A call in a file: line and column count from 1, `text` is the line.

    What identifies it when lines come and go above it: the function that it is in, and its place among the calls in
    lines of equal text there.

    Attributes:
        function: the names of the classes and functions around it, `Talker.target`; '' at the top of the file.
        target: the variable, attribute or keyword that is set to it, '' where there is none.
        nth, total: which one it is among the calls in such lines of the function, and of how many.
    """

    file: str
    line: int
    column: int
    text: str
    function: str = ''
    target: str = ''
    nth: int = 0
    total: int = 1

    @property
    def place(self) -> str:
        """The place as people read it: `talker.py:12:9`."""
        return f'{os.path.basename(self.file)}:{self.line}:{self.column}'


def call_site(frame: FrameType) -> CallSite:
    """The call that a frame is making.

    Where the file cannot be read, or is not the one that runs, the column is 1 on a Python that does not keep columns.
    """
    code = frame.f_code
    lines = linecache.getlines(code.co_filename, frame.f_globals)
    module = _parsed(''.join(lines))
    call = None if module is None else _by_position(frame, module) or _by_offset(frame, module)
    if call is not None:
        return call.site(code.co_filename)
    line, column = frame.f_lineno, 1
    position = _position(frame)
    if position is not None:
        line, column = position[0], position[1] + 1
    text = lines[line - 1] if line <= len(lines) else ''
    calls = [found.offset for found in dis.get_instructions(code) if found.opname.startswith('CALL')]
    index = sum(offset < frame.f_lasti for offset in calls)
    return CallSite(code.co_filename, line, column, text, code.co_name, '', index, len(calls))


def identity_of(site: CallSite, key: Any) -> str:
    """What identifies a location at a call site: not the number that is written there, which may be
    edited, nor the line, which may move."""
    place = f'{site.function}\n{_without_numbers(site.text)}\n{site.nth} of {site.total}'
    return f'{os.path.realpath(site.file)}\n{place}\n{key}'


def name_of(site: CallSite, key: Any) -> str:
    """A parameter's name for a call site that was given none, of its file, function, variable and a few digits that
    tell it from others there: `talker_target_radius_3f2a`."""
    stem = os.path.splitext(os.path.basename(site.file))[0]
    digits = hashlib.blake2b(identity_of(site, None).encode('utf-8'), digest_size=2).hexdigest()
    parts = [part for part in (stem, site.function, site.target, digits) if part]
    if key is not None:
        parts.append(str(key))
    name = re.sub(r'\W+', '_', '_'.join(parts), flags=re.ASCII)
    return name if name[0].isalpha() else 'l_' + name


class _Call(NamedTuple):
    """A call in a syntax tree.

    Attributes:
        start, end: line from 1 and column from 0, in bytes.
        first_line: the line that it begins in.
        text: its lines, without comments.
        others: as of CallSite.
    """

    start: Tuple[int, int]
    end: Tuple[int, int]
    first_line: str
    text: str
    function: str
    target: str
    nth: int = 0
    total: int = 1

    def site(self, file: str) -> CallSite:
        column = len(self.first_line.encode('utf-8')[: self.start[1]].decode('utf-8', 'replace')) + 1
        return CallSite(file, self.start[0], column, self.text, self.function, self.target, self.nth, self.total)


class _Module:
    """The calls of a file.

    Attributes:
        tree: its syntax tree.
        calls: in the order in which `ast.walk` meets them.
        by_end: the same, by where they end, which is another place for each.
    """

    def __init__(self, text: str) -> None:
        self.tree = ast.parse(text)
        self._compiled: Optional[List[Tuple[CodeType, CodeType]]] = None
        lines = _lines_without_comments(text)
        with_comments = text.splitlines()
        functions: Dict[ast.AST, str] = {}
        targets: Dict[ast.AST, str] = {}
        _name_surroundings(self.tree, functions, targets)
        found = [
            _Call(
                (node.lineno, node.col_offset),
                (node.end_lineno or 0, node.end_col_offset or 0),
                with_comments[node.lineno - 1],
                '\n'.join(lines[node.lineno - 1 : node.end_lineno]),
                functions[node],
                targets[node],
            )
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Call)
        ]
        equal: Dict[Tuple[str, str], List[_Call]] = {}
        for call in sorted(found, key=lambda call: (call.start, call.end)):
            equal.setdefault((call.function, _without_numbers(call.text)), []).append(call)
        places = {call.end: (index, len(group)) for group in equal.values() for index, call in enumerate(group)}
        self.calls = [call._replace(nth=places[call.end][0], total=places[call.end][1]) for call in found]
        self.by_end = {call.end: call for call in self.calls}

    def compiled(self) -> List[Tuple[CodeType, CodeType]]:
        """Each code object of the file, beside the same one whose calls have lines of their own."""
        if self._compiled is None:
            self._compiled = list(_pairs(_compiled(self.tree), _compiled(_marked(self.tree))))
        return self._compiled


@functools.lru_cache(maxsize=64)
def _parsed(text: str) -> Optional[_Module]:
    if not text:
        return None
    try:
        return _Module(text)
    except (SyntaxError, ValueError, RecursionError):
        return None  # the running code is not from this text: the file was edited meanwhile, or is not a Python file


def _position(frame: FrameType) -> Optional[Tuple[int, int, Tuple[int, int]]]:
    """Line, column and end of what a frame is at, as Python 3.11 knows it; columns count bytes from 0."""
    positions = getattr(frame.f_code, 'co_positions', None)
    if positions is None:
        return None
    line, end_line, column, end_column = list(positions())[frame.f_lasti // 2]
    if None in (line, end_line, column, end_column):
        return None
    return line, column, (end_line, end_column)


def _by_position(frame: FrameType, module: _Module) -> Optional[_Call]:
    position = _position(frame)
    if position is None:
        return None
    # Not by where it starts: that of a method over several lines is the method's name.
    call = module.by_end.get(position[2])
    return call if call is not None and call.start <= position[:2] else None


def _by_offset(frame: FrameType, module: _Module) -> Optional[_Call]:
    """The call that an instruction is, found without columns.

    The file is compiled again with lines that tell calls apart: the instructions stay the same, and that at the
    frame's offset has the line of its call.
    """
    if _position(frame) is not None:
        return None  # Python says where it is, and the file has no call there
    for code, marked in module.compiled():
        if code == frame.f_code and code.co_code == marked.co_code == frame.f_code.co_code:
            line = _line_at(marked, frame.f_lasti)
            if line >= _FIRST_MARK:
                return module.calls[line - _FIRST_MARK]
    return None


def _compiled(tree: ast.AST) -> CodeType:
    return compile(tree, '<calls>', 'exec', dont_inherit=True)  # type: ignore[call-overload]


def _marked(tree: ast.AST) -> ast.AST:
    """A copy of a tree in which each call has a line of its own, in the order of `ast.walk`."""
    tree = copy.deepcopy(tree)
    calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    for line, call in enumerate(calls, _FIRST_MARK):
        call.lineno = call.end_lineno = line
        call.col_offset, call.end_col_offset = 0, 1
        if isinstance(call.func, ast.Attribute):
            call.func.end_lineno = line  # which Python 3.10 takes for the line of a method's call
    return tree


def _pairs(code: CodeType, other: CodeType) -> Iterator[Tuple[CodeType, CodeType]]:
    """Two code objects of the same structure, and those in them, side by side."""
    waiting = [(code, other)]
    while waiting:
        code, other = waiting.pop()
        yield code, other
        waiting.extend(zip(*(filter(_is_code, both.co_consts) for both in (code, other))))


def _is_code(constant: Any) -> bool:
    return isinstance(constant, CodeType)


def _line_at(code: CodeType, offset: int) -> int:
    line = 0
    for start, at in dis.findlinestarts(code):
        if start > offset:
            break
        line = at or line
    return line


def _name_surroundings(tree: ast.AST, functions: Dict[ast.AST, str], targets: Dict[ast.AST, str]) -> None:
    """Note for each node in which function it is, and what is set to it."""
    waiting: List[Tuple[ast.AST, str, str]] = [(tree, '', '')]
    while waiting:
        node, function, target = waiting.pop()
        functions[node], targets[node] = function, target
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            function, target = f'{function}.{node.name}'.lstrip('.'), ''
        elif isinstance(node, ast.Assign):
            target = _target_name(node.targets[0])
        elif isinstance(node, ast.AnnAssign):
            target = _target_name(node.target)
        elif isinstance(node, ast.keyword) and node.arg:
            target = node.arg
        waiting.extend((child, function, target) for child in ast.iter_child_nodes(node))


def _target_name(target: ast.AST) -> str:
    if isinstance(target, ast.Attribute):
        return target.attr
    return target.id if isinstance(target, ast.Name) else ''


def _without_numbers(text: str) -> str:
    """A text without white space, all numbers in it the same: they may be edited."""
    return re.sub(r'[-+]?[\d.]+(e[-+]?\d+)?', '0', ''.join(text.split()))


def _lines_without_comments(text: str) -> List[str]:
    lines = text.splitlines()
    with contextlib.suppress(tokenize.TokenError, SyntaxError):
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT:
                row, column = token.start
                lines[row - 1] = lines[row - 1][:column]
    return lines
