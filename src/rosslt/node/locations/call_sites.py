"""Finds the call that creates a location: its position in a file, and what identifies it after the file was edited.

Positions come from the syntax tree of the file and identities from its tokens, so that both are the same on every
version of Python.
"""

import ast
import copy
import dis
import functools
import hashlib
import linecache
import operator
import os
import re
from types import CodeType, FrameType
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple

from rosslt.node.locations.literal_identities import identities

#: Line numbers from here on are in no file; they distinguish calls in code that is compiled from a changed tree.
_FIRST_MARK = 1_000_000


class CallSite(NamedTuple):
    """A call in a file: line and column count from 1, `text` is the line.

    Attributes:
        function: the names of the classes and functions around it, `Talker.target`; '' at the top of the file.
        target: the variable, attribute or keyword that is set to it, '' if there is none.
        identity: identifies it within its file, also after edits elsewhere.
    """

    file: str
    line: int
    column: int
    text: str
    function: str = ''
    target: str = ''
    identity: str = ''

    @property
    def place(self) -> str:
        """Its position as people read it: `talker.py:12:9`."""
        return f'{os.path.basename(self.file)}:{self.line}:{self.column}'


def call_site(frame: FrameType) -> CallSite:
    """The call that a frame is making.

    If the file cannot be read, or is not the one that runs, the column is 1 on a Python that does not keep columns.
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
    return CallSite(code.co_filename, line, column, text, code.co_name, '', _identity_in_code(frame))


def identity_of(site: CallSite, key: object) -> str:
    """The identity of a location: of its call and its key. Neither the number that is written there, which may be
    edited, nor the line, which may move, is part of it."""
    return f'{os.path.realpath(site.file)}\n{site.identity}\n{"" if key is None else word_of(key)}'


def name_of(site: CallSite, key: object) -> str:
    """The parameter's name for a call site that was given none: its file, function, variable and a few digits that tell
    it from others there, `talker_target_radius_3f2a91c0`."""
    stem = os.path.splitext(os.path.basename(site.file))[0]
    parts = [part for part in (stem, site.function, site.target, _digits(identity_of(site, None))) if part]
    name = re.sub(r'\W+', '_', '_'.join(parts), flags=re.ASCII)
    name = name if name[0].isalpha() else 'l_' + name
    return name if key is None else f'{name}_{word_of(key)}'


def word_of(key: Any) -> str:
    """A key as a word of a ROS name, different for each key.

    Whole numbers from 0 on and Python names stay as they are; anything else gets digits that stand for its type and its
    `str()`. Truth values are not whole numbers here.
    """
    if type(key) is str and key.isascii() and key.isidentifier() and not _ENDS_IN_DIGITS(key):
        return key
    try:
        number = None if isinstance(key, bool) else operator.index(key)
    except TypeError:
        number = None
    if number is None:
        kind, text = type(key).__name__, str(key)
    else:
        kind, text = 'int', str(number)
        if number >= 0:
            return text
    return f'{re.sub(r"[^A-Za-z0-9]+", "_", text)}_{_digits(kind + text)}'


#: Matches words that may end with the digits that `word_of` appends.
_ENDS_IN_DIGITS = re.compile(r'.*_[0-9a-f]{8}\Z').match


def _digits(text: str) -> str:
    return hashlib.blake2b(text.encode('utf-8', 'surrogatepass'), digest_size=4).hexdigest()


def _identity_in_code(frame: FrameType) -> str:
    """Identifies a call without the text of its file: its number among the calls of that very code."""
    code = frame.f_code
    calls = [found.offset for found in dis.get_instructions(code) if found.opname.startswith('CALL')]
    constants = [constant for constant in code.co_consts if isinstance(constant, (str, int, float))]
    nth = sum(offset < frame.f_lasti for offset in calls)
    return f'{code.co_name}\n{code.co_names}{code.co_varnames}{constants}\n{nth} of {len(calls)}'


class _Call(NamedTuple):
    """A call in a syntax tree.

    Attributes:
        start, end: line from 1 and column from 0, in bytes.
        text: the line that it begins in.
        function, target, identity: those of the CallSite.
    """

    start: Tuple[int, int]
    end: Tuple[int, int]
    text: str
    function: str
    target: str
    identity: str

    def site(self, file: str) -> CallSite:
        column = len(self.text.encode('utf-8')[: self.start[1]].decode('utf-8', 'replace')) + 1
        return CallSite(file, self.start[0], column, self.text, self.function, self.target, self.identity)


class _Module:
    """The calls of a file.

    Attributes:
        tree: its syntax tree.
        calls: in the order in which `ast.walk` meets them.
        by_end: the same calls by their end, which is different for each.
    """

    def __init__(self, text: str) -> None:
        self.tree = ast.parse(text)
        self._compiled: Optional[List[Tuple[CodeType, CodeType]]] = None
        lines = text.split('\n')  # as the parser does: a form feed ends no line
        surroundings = _surroundings(self.tree)
        found = [node for node in ast.walk(self.tree) if isinstance(node, ast.Call)]
        # The numbers of a call of the same function are those of another location.
        named = identities(self.tree, text, [(node, _last_name(node.func)) for node in found])
        self.calls = [
            _Call(
                (node.lineno, node.col_offset),
                (node.end_lineno or 0, node.end_col_offset or 0),
                lines[node.lineno - 1],
                *surroundings[node],
                identity,
            )
            for node, identity in zip(found, named)
        ]
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
    """Line, column and end of a frame's present expression, as Python 3.11 knows it; columns count bytes from 0."""
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


def _is_code(constant: object) -> bool:
    return isinstance(constant, CodeType)


def _line_at(code: CodeType, offset: int) -> int:
    line = 0
    for start, at in dis.findlinestarts(code):
        if start > offset:
            break
        line = at or line
    return line


def _surroundings(tree: ast.AST) -> Dict[ast.AST, Tuple[str, str]]:
    """{part of a syntax tree: (function around it, variable that it is assigned to)}, as in the CallSite."""
    found: Dict[ast.AST, Tuple[str, str]] = {}
    waiting = [(tree, '', '')]
    unpacked: Dict[ast.AST, str] = {}  # {a value in `x, y = 1, 2`: its variable}
    while waiting:
        node, function, target = waiting.pop()
        target = unpacked.get(node, target)
        found[node] = function, target
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            function, target = f'{function}.{node.name}'.lstrip('.'), ''
        elif isinstance(node, ast.Assign):
            target = _last_name(node.targets[0])
            targets, value = node.targets[0], node.value
            if isinstance(targets, ast.Tuple) and isinstance(value, ast.Tuple) and len(targets.elts) == len(value.elts):
                unpacked.update(zip(value.elts, map(_last_name, targets.elts)))
        elif isinstance(node, ast.AnnAssign):
            target = _last_name(node.target)
        elif isinstance(node, ast.keyword) and node.arg:
            target = node.arg
        waiting.extend((child, function, target) for child in ast.iter_child_nodes(node))
    return found


def _last_name(target: ast.AST) -> str:
    """The last part of a name; '' of anything else."""
    if isinstance(target, ast.Attribute):
        return target.attr
    return target.id if isinstance(target, ast.Name) else ''
