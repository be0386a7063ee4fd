"""Code that walks the fields of a message, written and compiled once for each message class.

Looking at each field by its name costs more than serializing the message does, so the walks are written out as straight
code: attribute by attribute if a type is fixed, one loop for each array. An array whose elements have arrays
themselves is left to a function for its elements.
"""

import functools
import operator
import struct
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple

from rosslt.messages.fields import BYTES, SCALARS, VARIABLE, Field, Layout, MessageClass, kind_of
from rosslt.values import TRACKED_CLASSES as TRACKED
from rosslt.values import is_object_array

BYTES_LIMIT = 1 << 18
"""Arrays of bytes longer than that are taken for data, of which no single byte is tracked: to be tracked, they would
have to be received as lists, eight times their size."""

END = 1 << 62
"""Stands behind the last wanted index; no message has so many leaves."""


class Walkers(NamedTuple):
    """The compiled walks of a message class."""

    layout: Layout
    collect: Callable[..., Any]
    """`collect(message, 0, found, limit=END)` appends `(index, value, kind)` for each tracked leaf, little more than so
    many, and returns how many leaves there are in all."""
    locate: Callable[..., Any]
    """`locate(message, 0, wanted, 0, found.append, arrays.append)` appends `(owner, key, value, kind)` for each wanted
    leaf; `wanted` holds indices that rise, and END at last. It ends at a byte in an array of more than BYTES_LIMIT. An
    owner that is a list is a copy of an array of scalars, with its `(owner, name, array, copy)` in arrays."""
    end: Callable[..., Any]
    """`end(data, 0, len(data))`: where the serialized message that data begins with ends. Beyond the data, or
    struct.error, if it is cut short."""


@functools.lru_cache(maxsize=None)
def walkers(message_class: MessageClass) -> Walkers:
    """The walks of a message class, compiled when first asked for."""
    layout = Layout(message_class)
    return Walkers(layout, *_WalkerCompiler(layout).compiled())


def has_arrays(message_class: MessageClass) -> bool:
    """Return whether messages of a class have arrays."""
    layout = walkers(message_class).layout
    return layout.flat(layout.name) is None


def items_of(array: Any) -> Any:
    """The elements of an array that is not an exact list or tuple, if they may be tracked: else nothing."""
    if isinstance(array, (list, tuple)):
        return array
    return array.tolist() if getattr(array, 'has_provenance', None) or is_object_array(array) else ()


def listed(array: Any) -> List[Any]:
    """The elements of an array of scalars as Python's own."""
    return array.tolist() if hasattr(array, 'tolist') else list(array)


def _getter(path: str) -> Tuple[Optional[Callable[[Any], Any]], str]:
    owner, _, name = path.rpartition('.')
    return (operator.attrgetter(owner) if owner else None), name


class _WalkerCompiler:
    """Writes the walks of one message class.

    They are functions `collect_N`, `locate_N` and `end_N` for each type N that is walked by a function of its own: the
    message type itself, and elements of arrays that have arrays.
    """

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._numbers = {layout.name: 0}
        self._constants: Dict[str, Any] = {
            'TRACKED': TRACKED,
            'items_of': items_of,
            'listed': listed,
            'END': END,
            'BYTES_LIMIT': BYTES_LIMIT,
            'length_at': struct.Struct('<I').unpack_from,
        }
        self._lines: List[str] = []

    def compiled(self) -> List[Callable[..., Any]]:
        written = 0
        while written < len(self._numbers):
            type_ = list(self._numbers)[written]
            self._write_collect(written, type_)
            self._write_locate(written, type_)
            self._write_end(written, type_)
            written += 1
        code = compile('\n'.join(self._lines), '<walks of %s>' % self._layout.name, 'exec')
        exec(code, self._constants)
        return [self._constants[walk + '_0'] for walk in ('collect', 'locate', 'end')]

    def _number(self, type_: str) -> int:
        return self._numbers.setdefault(type_, len(self._numbers))

    def _write(self, depth: int, line: str, *arguments: object) -> None:
        self._lines.append('    ' * depth + (line % arguments if arguments else line))

    def _runs(self, type_: str) -> List[Any]:
        """A type as what is walked in one go: lists of `(path, scalar type)`, and arrays as `(path, Field)`."""
        runs: List[Any] = []
        for path, _, field in self._layout.parts(type_):
            if field.length is not None:
                runs.append((path, field))
            elif runs and isinstance(runs[-1], list):
                runs[-1].append((path, field.type))
            else:
                runs.append([(path, field.type)])
        return runs

    # `b` is the index of the next leaf: each walk gets the index of its first leaf and returns the one after its last.

    def _write_collect(self, number: int, type_: str) -> None:
        self._write(0, 'def collect_%d(m, b, found, limit=END):', number)
        for run in self._runs(type_):
            if isinstance(run, list):
                self._write_collect_leaves(1, 'm', run)
            else:
                self._write_collect_array(*run)
        self._write(1, 'return b')

    def _write_collect_leaves(self, depth: int, name: str, leaves: List[Tuple[str, str]]) -> None:
        owners = {'': name}
        for number, (path, scalar) in enumerate(leaves):
            owner, _, last = path.rpartition('.')
            if owner not in owners:
                owners[owner] = 'o%d' % len(owners)
                self._write(depth, '%s = %s.%s', owners[owner], name, owner)
            self._write(depth, 'v = %s.%s', owners[owner], last)
            self._write(depth, 'if type(v) in TRACKED: found.append((b + %d, v, %r))', number, kind_of(scalar))
        self._write(depth, 'b += %d', len(leaves))

    def _write_collect_array(self, path: str, field: Field) -> None:
        self._write(1, 'a = m.%s', path)
        leaves = self._layout.flat(field.type)
        if field.type in SCALARS:
            count = 'len(a)' if field.length == VARIABLE else str(field.length)
            limit = ' if len(a) <= BYTES_LIMIT else ()' if field.type in BYTES else ''
            self._write(1, 'if type(a) is not bytes:')
            self._write(2, 'i = (a if type(a) is list or type(a) is tuple else items_of(a))%s', limit)
            self._write(2, 'if not TRACKED.isdisjoint(map(type, i)):')
            self._write(3, 'for j, v in enumerate(i, b):')
            self._write(4, 'if type(v) in TRACKED:')
            self._write(5, 'found.append((j, v, %r))', kind_of(field.type))
            self._write(5, 'if len(found) > limit: break')
            self._write(1, 'b += %s', count)
        elif leaves is None:
            self._write(1, 'for e in a: b = collect_%d(e, b, found, limit)', self._number(field.type))
        elif leaves:
            self._write(1, 'n = b + len(a) * %d', len(leaves))
            self._write(1, 'for e in a:')
            self._write(2, 'if len(found) > limit: break')
            self._write_collect_leaves(2, 'e', leaves)
            self._write(1, 'b = n')

    # `i` is the wanted index that comes next, in `w` at `p`; `find` and `array` append to what the caller gets.

    def _write_locate(self, number: int, type_: str) -> None:
        self._write(0, 'def locate_%d(m, b, w, p, find, array):', number)
        self._write(1, 'i = w[p]')
        for index, run in enumerate(self._runs(type_)):
            name = '%d_%d' % (number, index)
            if isinstance(run, list):
                self._write_locate_leaves(name, 'm', run, str(len(run)))
            else:
                self._write_locate_array(name, *run)
        self._write(1, 'return b, p')

    def _write_locate_leaves(self, name: str, owner: str, leaves: List[Tuple[str, str]], count: str) -> None:
        """The leaves of the message (`m`) or of an element (`a[q]`) of an array without arrays."""
        self._constants['LEAVES_' + name] = [_getter(path) + (kind_of(scalar),) for path, scalar in leaves]
        self._write(1, 'n = b + %s', count)
        self._write(1, 'while i < n:')
        if owner == 'm':
            self._write(2, 'g, k, s = LEAVES_%s[i - b]', name)
        else:
            self._write(2, 'q, r = divmod(i - b, %d)', len(leaves))
            self._write(2, 'g, k, s = LEAVES_%s[r]', name)
        self._write(2, 'o = %s if g is None else g(%s)', owner, owner)
        self._write(2, 'find((o, k, getattr(o, k), s))')
        self._write(2, 'p += 1')
        self._write(2, 'i = w[p]')
        self._write(1, 'b = n')

    def _write_locate_array(self, name: str, path: str, field: Field) -> None:
        self._write(1, 'a = m.%s', path)
        leaves = self._layout.flat(field.type)
        if field.type in SCALARS:
            getter, last = _getter(path)
            self._constants['OWNER_' + name] = getter
            self._write(1, 'n = b + len(a)')
            if field.type in BYTES:
                self._write(1, 'if i < n and len(a) > BYTES_LIMIT:')
                self._write(2, 'p = len(w) - 1')
                self._write(2, 'i = END')
            self._write(1, 'if i < n:')
            self._write(2, 'c = listed(a)')
            self._write(2, 'array((%s, %r, a, c))', 'OWNER_%s(m)' % name if getter else 'm', last)
            self._write(2, 'while i < n:')
            self._write(3, 'find((c, i - b, c[i - b], %r))', kind_of(field.type))
            self._write(3, 'p += 1')
            self._write(3, 'i = w[p]')
            self._write(1, 'b = n')
        elif leaves is None:
            self._write(1, 'for e in a:')
            self._write(2, 'if w[p] == END: return b, p')
            self._write(2, 'b, p = locate_%d(e, b, w, p, find, array)', self._number(field.type))
            self._write(1, 'i = w[p]')
        elif leaves:
            self._write_locate_leaves(name, 'a[q]', leaves, 'len(a) * %d' % len(leaves))

    # `p` is where the next field begins, `z` where the data ends.

    def _write_end(self, number: int, type_: str) -> None:
        self._write(0, 'def end_%d(d, p, z):', number)
        fixed = 0
        for run in self._runs(type_):
            if isinstance(run, list):
                for _, scalar in run:
                    size = self._layout.size(scalar)
                    if size is None:
                        self._write(1, 'p += %d + length_at(d, p + %d)[0]', fixed + 4, fixed)
                        fixed = 0
                    else:
                        fixed += size
                continue
            field = run[1]
            size = self._layout.size(field.type)
            if size is not None and field.length != VARIABLE:
                fixed += size * field.length
                continue
            if fixed:
                self._write(1, 'p += %d', fixed)
                fixed = 0
            if field.length == VARIABLE:
                self._write(1, 'n = length_at(d, p)[0]')
                self._write(1, 'p += 4' + (' + n * %d' % size if size is not None else ''))
            if size is not None:
                continue
            self._write(1, 'for _ in range(%s):', 'n' if field.length == VARIABLE else field.length)
            if field.type == 'string':
                self._write(2, 'p += 4 + length_at(d, p)[0]')
            else:
                self._write(2, 'p = end_%d(d, p, z)', self._number(field.type))
            self._write(2, 'if p > z: return p')
        self._write(1, 'return p + %d', fixed)
