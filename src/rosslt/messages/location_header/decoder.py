"""Provenance that the C++ library wrote: see `header`."""

import operator
import re
from typing import Any, List, Sequence

from rosslt.messages.errors import BadHeader
from rosslt.messages.fault_log import warn_once
from rosslt.messages.location_header.header import FROM_ROS2, FUNCTIONS, ID_LIMIT, PaperIds
from rosslt.values import MATH, NotInvertible, Source, is_tracked, lazy, solve, track, untracked

TOKEN_LIMIT = 10000
"""The most tokens of an expression."""

BITS_LIMIT, TEXT_LIMIT = 64, 1 << 16
"""The most bits of an integer and characters of a text on the way: C++ has no longer integers."""

INDEX_DIGITS = 10
"""The most digits of an index: of longer texts, Python makes no number."""

_BINARY = {'+': operator.add, '-': operator.sub, '*': operator.mul, '/': operator.truediv}


def from_paper_header(message: Any, header: Any, ids: PaperIds) -> None:
    """Put the provenance of a header of the C++ library onto a message.

    A field whose expression cannot have made its value stays untracked, with a warning on rosout.

    Args:
        message: any message; lists that are tuples become lists where elements are tracked.
        header: with `paths` and `locations`, as `LocationHeader`.
        ids: of the bridge.

    Raises:
        BadHeader: a path leads to no field, or an expression is malformed; the message is as it was.
    """
    if len(header.paths) != len(header.locations):
        raise BadHeader('bad provenance: found %d paths and %d locations' % (len(header.paths), len(header.locations)))
    found = []
    for path, location in zip(header.paths, header.locations):
        parts = [FROM_ROS2.get(part, part) for part in path.split('/')]
        value = untracked(_at(message, _field_parts(parts, message), path))
        if type(value) not in (float, int, bool, str):
            raise BadHeader('bad provenance: found the path %r to a %s' % (path, type(value).__name__))
        if not 0 <= location.location_id < ID_LIMIT:
            raise BadHeader('bad provenance: found the location id %d at %s' % (location.location_id, path))
        source = ids.source(location.source_node, location.location_id)
        found.append((_field_parts(parts, message), value, _made(value, source, location.expression, path)))
    for parts, value, made in found:
        if made is not None:
            _put(message, parts, _with_provenance(value, made))
        else:
            warn_once(
                tuple(parts), 'bad provenance: %s holds %.60r, which its expression cannot make', '/'.join(parts), value
            )


def _with_provenance(value: Any, made: Any) -> Any:
    """The field's value, with the provenance of what was computed to be it up to rounding."""
    return lazy([value], [lambda _: made])[0]


def _field_parts(parts: List[str], message: Any) -> List[str]:
    return list(message.__slots__) if parts == ['.'] else parts


def _at(message: Any, parts: Sequence[str], path: str) -> Any:
    part = message
    for name in parts:
        if isinstance(part, (list, tuple, bytes)):
            if not name.isdecimal() or len(name) > INDEX_DIGITS or int(name) >= len(part):
                raise BadHeader(
                    'bad provenance: found the path %.200r, expected an index below %d for %.60r'
                    % (path, len(part), name)
                )
            part = part[int(name)]
        elif name in getattr(part, '__slots__', ()):
            part = getattr(part, name)
        else:
            raise BadHeader(
                'bad provenance: found the path %.200r, but no field %.60r in a %s' % (path, name, message._type)
            )
    return part


def _put(message: Any, parts: Sequence[str], value: Any) -> None:
    owner = _at(message, parts[:-1], '')
    if isinstance(owner, (tuple, bytes)):
        _put(message, parts[:-1], list(owner))
        owner = _at(message, parts[:-1], '')
    if isinstance(owner, list):
        owner[int(parts[-1])] = value
    else:
        setattr(owner, parts[-1], value)


def _made(value: Any, source: Source, expression: str, path: str) -> Any:
    """The tracked value that an expression makes, whose source has the value that makes it the field's; None if no
    value does."""
    tokens = _tokens(expression)
    if len(tokens) > TOKEN_LIMIT:
        raise BadHeader('bad provenance: found an expression of %d tokens at %s' % (len(tokens), path))
    if not tokens:
        return track(value, source)
    for start in (value, 1.0, 0.5) if isinstance(value, float) else (value,):
        try:
            made = _applied(track(start, source), tokens, path)
            start = solve(made, value, source)[source]
            return _applied(track(start, source), tokens, path)
        except (ArithmeticError, NotInvertible, ValueError):
            continue
    return None


def _tokens(expression: str) -> List[str]:
    """The tokens of an expression; a text between quotes may hold semicolons. What follows the last one is ignored, as
    the C++ library does."""
    # Without the end of the text as another end of a token, each character of what follows the last semicolon would be
    # tried as the beginning of one.
    return [token for token, end in re.findall(r'("[^"]*"|[^;]+)(;|\Z)', expression) if end]


def _applied(value: Any, tokens: Sequence[str], path: str) -> Any:
    stack = [value]
    for token in tokens:
        try:
            if token == 'swap':
                stack[-2], stack[-1] = stack[-1], stack[-2]
            elif token in _BINARY:
                other = stack.pop()
                stack[-1] = _operated(token, stack[-1], other)
            elif token in FUNCTIONS:
                stack[-1] = MATH[token](stack[-1])
            else:
                stack.append(_constant(token, value))
        except (IndexError, TypeError, ValueError) as error:
            if isinstance(error, ValueError) and token in FUNCTIONS:
                raise
            raise BadHeader(
                'bad provenance: found %.60r in the expression %.200r of %s' % (token, ';'.join(tokens) + ';', path)
            ) from error
    if not is_tracked(stack[-1]):
        raise BadHeader(
            'bad provenance: found the expression %.200r of %s, which leaves the source out'
            % (';'.join(tokens) + ';', path)
        )
    return stack[-1]


def _operated(symbol: str, left: Any, right: Any) -> Any:
    if symbol == '/' and isinstance(left, int) and isinstance(right, int):
        return MATH['trunc'](left / right)  # C++ divides integers to integers
    result = _BINARY[symbol](left, right)
    if isinstance(result, int) and result.bit_length() > BITS_LIMIT:
        raise OverflowError('an integer of %d bits' % result.bit_length())
    if isinstance(result, str) and len(result) > TEXT_LIMIT:
        raise OverflowError('a text of %d characters' % len(result))
    return result


def _constant(token: str, like: Any) -> Any:
    """A literal as one of the type that the expression is computed in."""
    if isinstance(like, str):
        return token[1:-1] if token.startswith('"') else token
    return int(token) if isinstance(like, int) else float(token)
