"""Fault localization: which of the earlier changes reach the line of the node's own code that raises an exception."""

import ast
import inspect
import itertools
import linecache
import os
import types
from typing import Any, Callable, Collection, Dict, Iterable, Iterator, List, Mapping, Set, Tuple

from rosslt import values
from rosslt.messages import Scalar
from rosslt.node.json_scalars import to_json
from rosslt.node.locations.location import Location
from rosslt.node.memory.own_code import raised_by, raised_in

#: The most changes that a text about an exception names.
MOST_NAMED = 3

#: The most elements that are looked at of what is indexed by a computed index: it may contain itself.
MOST_ELEMENTS = 1000

#: The operators that raise a ZeroDivisionError if their right operand is 0.
_DIVISIONS = (ast.Div, ast.FloorDiv, ast.Mod)


def locations_read(error: BaseException, locations: Collection[Location]) -> Set[Location]:
    """Return the locations that are in the line that raised an exception, or reach the names that this line reads."""
    frame, line = raised_in(error)
    file = os.path.realpath(frame.f_code.co_filename)
    names = {**frame.f_globals, **frame.f_locals}
    parts = [part for whole in _expressions(frame, line) for part in ast.walk(whole)]
    reached = {source for part in parts for value in _read_in(part, names) for source in values.sources(value)}
    return {
        one
        for one in locations
        if one.source in reached or (os.path.realpath(one.site.file), one.site.line) == (file, line)
    }


def described_error(
    error: BaseException,
    earlier: Mapping[Location, Tuple[Scalar, Scalar]],
    read: Set[Location],
    name_of: Callable[[values.Source], str],
    is_taken_back: bool,
    ends_node: bool,
) -> str:
    """An exception in one line: where it comes from, and which earlier changes may count there.

    Args:
        earlier: {location: (value before, value after)}, from the latest one; the value before is that in the code if a
            literal was changed before the node was started.
        read: the changed locations that reach the line, as `locations_read` finds them; others are named only if none
            are known.
        name_of: what a source is called in a command.
        is_taken_back: whether later changes are taken back.
        ends_node: whether the node ends; what it says of the commands holds while it does not run.
    """
    file, line = raised_by(error)
    zeros = _sources_of_zero_divisors(error)
    counting = [(one, change) for one, change in earlier.items() if one in read or not read]
    texts = []
    for one, (old, new) in sorted(counting, key=lambda change: change[0].source not in zeros):
        name = name_of(one.source)
        when = ' before the node was started' if one.remembered else ''
        is_left = one.remembered or (ends_node and one.literal is not None)
        back = f'reset {name}' if is_left else f'set {name} {to_json(old)}'
        does = 'says how to take it back' if ends_node else 'takes it back'
        texts.append(f'{one.name} {old!r} -> {new!r}{when} (`rosslt {back}` {does})')
    more = [f'{len(texts) - MOST_NAMED} more'] if texts[MOST_NAMED:] else []
    which = f'which {"also " * is_taken_back}reads what was changed before: ' if read else 'changed before: '
    told = f', {which}{", ".join([*texts[:MOST_NAMED], *more])}' if texts else ''
    return f'{type(error).__name__}: {error} ({os.path.basename(file)}:{line}{told})'


def with_effects(described: str, ends_node: bool, others: Iterable[Mapping[Location, Tuple[Scalar, Scalar]]]) -> str:
    """An exception in one line, with what it does besides taking back the change that somebody is told of.

    Args:
        described: as `described_error` gives it.
        others: {location: (value before, value after)} of each other request that is taken back.
    """
    gone = [f'{one.name} {old!r} -> {new!r}' for changes in others for one, (old, new) in changes.items()]
    effects = [*(['ends the node'] if ends_node else []), *([f'takes back {", ".join(gone)}, too'] if gone else [])]
    return f'{described}, which {" and ".join(effects)}' if effects else described


def _sources_of_zero_divisors(error: BaseException) -> Set[values.Source]:
    """The sources of the numbers by which the line of an exception divides, and that are 0."""
    if not isinstance(error, ZeroDivisionError):
        return set()
    frame, line = raised_in(error)
    names = {**frame.f_globals, **frame.f_locals}
    operations = [part for whole in _expressions(frame, line) for part in ast.walk(whole)]
    divisors = [one.right for one in operations if isinstance(one, ast.BinOp) and isinstance(one.op, _DIVISIONS)]
    read = [value for divisor in divisors for part in ast.walk(divisor) for value in _read_in(part, names)]
    return {source for value in read if value == 0 for source in values.sources(value)}


def _expressions(frame: types.FrameType, line: int) -> List[ast.expr]:
    """The expressions that begin in a line of the code that a frame runs."""
    try:
        tree = ast.parse(''.join(linecache.getlines(frame.f_code.co_filename, frame.f_globals)))
    except (SyntaxError, ValueError, SystemError):  # Python 3.11 raises the last one if two threads parse
        return []
    return [part for part in ast.walk(tree) if isinstance(part, ast.expr) and part.lineno == line]


def _read_in(part: ast.AST, names: Dict[str, Any]) -> Iterator[Any]:
    """The number or text that a part of a line reads, or those of which it is one, as far as its variables, attributes
    and elements can be looked up without a call of the node's code."""
    value = _value_of(part, names)
    if values.plain_scalar(value) is not None:
        yield value
    elif value is None and isinstance(part, ast.Subscript):  # any of its elements
        elements = values.each_leaf(_value_of(part.value, names))
        yield from (leaf for _, leaf in itertools.islice(elements, MOST_ELEMENTS))


def _value_of(part: ast.AST, names: Dict[str, Any]) -> Any:
    """Return the value of a constant, a variable, an attribute or an element; None if it is not known."""
    if isinstance(part, ast.Constant):
        return part.value
    if isinstance(part, ast.UnaryOp) and isinstance(part.op, ast.USub):
        index = _value_of(part.operand, names)
        return -index if type(index) is int else None
    if isinstance(part, ast.Name):
        return names.get(part.id)
    if isinstance(part, ast.Attribute):
        owner = _value_of(part.value, names)
        found = inspect.getattr_static(owner, part.attr, None)
        is_field = isinstance(found, types.MemberDescriptorType) and not isinstance(owner, type)
        return getattr(owner, part.attr, None) if is_field else found
    if isinstance(part, ast.Subscript):
        whole, index = _value_of(part.value, names), values.plain_scalar(_value_of(_index(part), names))
        if type(whole) is dict:
            return whole.get(index)
        if type(whole) in (list, tuple) and isinstance(index, int) and -len(whole) <= index < len(whole):
            return whole[index]
    return None


def _index(part: ast.Subscript) -> Any:
    """The expression in the brackets, which Python 3.8 wraps."""
    inner: Any = part.slice
    return inner.value if type(inner).__name__ == 'Index' else inner
