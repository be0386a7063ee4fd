"""Loads rewritten modules: the node itself, and those of the user's own modules that it imports.

The user's own are the modules beside the script and those of catkin workspaces; not the standard library, not what is
installed by Debian, pip or ROS, and not generated files. The bytecode of rewritten files is
kept in a folder of its own; Python's own `__pycache__` stays as it is.
"""

import builtins
import hashlib
import importlib.util
import marshal
import os
import re
import sys
import tempfile
from importlib.machinery import BuiltinImporter, FrozenImporter, ModuleSpec, PathFinder, SourceFileLoader
from typing import Any, Collection, Dict, List, Optional

from rosslt import node
from rosslt.instrument import cells, functions, reloading, starts
from rosslt.instrument.literals import Literal
from rosslt.instrument.set_up_names import SET_UP, Place
from rosslt.instrument.tree_rewriting import (
    CELLS,
    CONVERSIONS,
    CONVERT,
    CUT_OFF,
    OBJECT,
    OPERATORS,
    PLAIN,
    PLAIN_PARTS,
    ROUTE,
    ROUTE_ALL,
    SAME,
    TAKEN,
    Rewritten,
    in_place,
    name_of_cells,
    rewrite,
)

#: The marks of generated files, whose literals nobody edits.
_GENERATED = re.compile(rb'do not edit', re.IGNORECASE)
_OURS = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))


def cache_folder() -> str:
    """Return the folder that caches the bytecode of rewritten files."""
    base = os.environ.get('XDG_CACHE_HOME') or os.path.join(os.path.expanduser('~'), '.cache')
    return os.path.join(base, 'rosslt', f'rewritten-{sys.implementation.cache_tag}')


def rewritten(path: str, content: bytes, named: str) -> Rewritten:
    """A file, rewritten: from the cache if it was rewritten before.

    Args:
        path, content, named: as in `rewrite`.

    Raises:
        SyntaxError: as in `compile`.
    """
    node.SOURCE_FILES.keep(path, content)
    key = hashlib.blake2b(
        b'\0'.join([_version(), os.path.realpath(path).encode('utf-8', 'surrogateescape'), named.encode(), content]),
        digest_size=20,
    ).hexdigest()
    file = os.path.join(cache_folder(), key[:2], key)
    try:
        with open(file, 'rb') as cached:
            code, rows, digest, set_up, reaches_others = marshal.load(cached)
        ways = {name: [tuple([Place(*place) for place in way]) for way in found] for name, found in set_up.items()}
        return Rewritten(code, [Literal(*row) for row in rows], digest, ways, reaches_others)
    except (OSError, EOFError, ValueError, TypeError):
        pass
    made = rewrite(content, path, named)
    set_up = {name: [tuple([tuple(one) for one in way]) for way in found] for name, found in made.set_up.items()}
    rows = [tuple(literal) for literal in made.literals]
    _keep(file, marshal.dumps((made.code, rows, made.digest, set_up, made.reaches_others)))
    return made


def _keep(file: str, data: bytes) -> None:
    """Write a file of the cache, as a whole or not at all; a cache that cannot be written costs time only."""
    folder = os.path.dirname(file)
    try:
        os.makedirs(folder, mode=0o700, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=folder)
        with os.fdopen(handle, 'wb') as cached:
            cached.write(data)
        os.replace(temporary, file)
    except OSError:
        pass


#: The modules that determine how a file is rewritten.
_REWRITING = (
    *(
        f'instrument/{name}'
        for name in (
            *('callees', 'lifetimes', 'literal_names', 'literals', 'location_rules', 'plain_readings'),
            *('set_up_names', 'signatures', 'states', 'tables', 'tree_rewriting'),
        )
    ),
    'node/locations/literal_identities',
)
_made_by: List[bytes] = []


def _version() -> bytes:
    """Return a digest of the rewriting code and the Python version, which validates cached bytecode."""
    if not _made_by:
        digest = hashlib.blake2b(importlib.util.MAGIC_NUMBER, digest_size=16)
        for name in _REWRITING:
            with open(os.path.join(_OURS, name + '.py'), 'rb') as file:
                digest.update(file.read())
        _made_by.append(digest.digest())
    return _made_by[0]


def prepare(names: Dict[str, Any], made: Rewritten, path: str) -> None:
    """Have the rewritten code of a module find what it asks for.

    Args:
        names: of the module.
        made: its code.
        path: of its file.
    """
    from rosslt.instrument import routing

    node.include_file(names['__file__'])
    path = os.path.realpath(path)
    is_program = names['__name__'] == '__main__'
    if is_program:
        SET_UP.begin(names, made.set_up)
    elif made.reaches_others:
        SET_UP.forget()
    names[CELLS] = cells.cells_of(path, made.literals, made.digest, is_program)
    names[CELLS].take_over()
    reloading.watch(path)
    # A function of the module may be called with other globals.
    found = vars(builtins)
    found[name_of_cells(path, made.digest)] = names[CELLS]
    found.setdefault(PLAIN, cells.plain)  # as it is watched, if it is
    found.setdefault(PLAIN_PARTS, cells.plain_parts)
    found.setdefault(CUT_OFF, starts.cut_off)
    found[OBJECT] = cells.plain_object
    found[SAME] = cells.is_same
    found[TAKEN] = node.taken
    found[ROUTE] = routing.route
    found[ROUTE_ALL] = routing.route_all
    found[CONVERT] = functions.convert
    found[CONVERSIONS['float']] = functions.to_float
    found[CONVERSIONS['int']] = functions.to_int
    found[CONVERSIONS['type']] = functions.type_of
    found[CONVERSIONS['sum']] = functions.sum_of
    for name in OPERATORS.values():
        operator = name.strip('_').split('_', 1)[1]
        found[name] = functions.REFLECTING[operator]
        found[in_place(name)] = functions.REFLECTING['i' + operator]


class OwnModules:
    """A finder of the user's own modules, which come rewritten.

    Args:
        beside: the folder of the script.
        include: names of other modules to rewrite, with all below them.
    """

    def __init__(self, beside: str, include: Collection[str] = ()) -> None:
        self._beside = os.path.realpath(beside)
        self._include = tuple(include)

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Optional[ModuleSpec]:
        """Find a module to rewrite, as `importlib.abc.MetaPathFinder` does; None for all other modules."""
        if name.partition('.')[0] in ('rosslt', 'rospy', 'genpy'):
            return None
        if BuiltinImporter.find_spec(name) or FrozenImporter.find_spec(name):
            return None  # a file of the same name does not come before these
        spec = PathFinder.find_spec(name, path, target)
        if spec is None or type(spec.loader) is not SourceFileLoader or not spec.origin:
            return None
        if not (self._is_included(name) or self._is_own(spec.origin)):
            return None
        spec.loader = RewritingLoader(name, spec.origin)
        return spec

    def _is_included(self, name: str) -> bool:
        return any(name == one or name.startswith(one + '.') for one in self._include)

    def _is_own(self, file: str) -> bool:
        file = os.path.realpath(file)
        if file.startswith(_OURS + os.sep):
            return False
        if file.startswith(self._beside + os.sep):
            return not any(
                part in ('site-packages', 'dist-packages') for part in file[len(self._beside) :].split(os.sep)
            )
        return node.is_own_file(file)


class RewritingLoader(SourceFileLoader):
    """Loads a module from its source, rewritten; as it is if it cannot be rewritten."""

    _made: Optional[Rewritten] = None

    def get_code(self, fullname: str) -> Any:
        path = self.get_filename(fullname)
        content = self.get_data(path)
        if not _GENERATED.search(content[:400]):
            try:
                self._made = rewritten(path, content, path)
                return self._made.code
            except SyntaxError:
                pass  # which Python itself reports
            except (ValueError, RecursionError, KeyError, IndexError, AttributeError) as error:
                print(f'rosslt: {path} runs untracked: {type(error).__name__}: {error}', file=sys.stderr)
        return super().get_code(fullname)

    def exec_module(self, module: Any) -> None:
        code = self.get_code(module.__name__)
        if code is None:
            raise ImportError(f'cannot load module {module.__name__!r}')
        if self._made is not None:
            prepare(module.__dict__, self._made, self.path)
        exec(code, module.__dict__)


__all__ = ['OwnModules', 'cache_folder', 'prepare', 'rewritten']
