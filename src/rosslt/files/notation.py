"""The notation of numbers, texts and truth values: a new one is written in the manner of the one that it replaces, and
reads back to exactly its value."""

import ast
import re
from decimal import Decimal
from typing import Any, Iterator, List, Sequence, Union

import yaml

_NUMBER = re.compile(r'(?P<sign>[-+]?)[ \t]*(?P<whole>\d*)(?P<point>\.?)(?P<fraction>\d*)(?P<exponent>[eE][-+]?\d+)?')

#: The maximal number of digits that are written out if an exponent would be shorter.
_LONGEST = 16

#: The start of a Python text literal: its prefix and its quote.
_QUOTE = re.compile(r'([uUrR]?)("""|\'\'\'|"|\')')

#: The words for truth values in YAML and launch files, True first.
_TRUTHS = (('true', 'false'), ('yes', 'no'), ('on', 'off'), ('1', '0'))

_Value = Union[int, float]

#: A number, a text or a truth value.
Scalar = Union[int, float, str, bool]


def is_scalar(value: object) -> bool:
    """Return whether a value is a number, a text or a truth value."""
    return type(value) in (int, float, str, bool)


def alike(one: object, other: object) -> bool:
    """Return whether both are numbers, both are texts, or both are truth values."""
    numbers = (int, float)
    return is_scalar(one) and (type(one) is type(other) or (type(one) in numbers and type(other) in numbers))


def equal(one: object, other: object) -> bool:
    """Return whether two scalars are the same; True is no 1 here."""
    return alike(one, other) and one == other


def same(one: object, other: object) -> bool:
    """Return whether two scalars are equal and of the same type; -0.0 is no 0.0 here."""
    return type(one) is type(other) and repr(one) == repr(other)


def text_in_manner_of(old: str, value: str, is_utf8: bool = True) -> str:
    """Write a text as a Python literal, in the style of the literal that it replaces.

    Args:
        old: how the text before is written.
        value: the text.
        is_utf8: whether the file is in UTF-8; in others all but ASCII is written as escapes.

    Returns:
        A literal that reads back to exactly that text: in the quotes of the former literal, else by `repr`.
    """
    match = _QUOTE.match(old)
    if match and value.isprintable() and ('\\' not in value or match[1] in ('r', 'R')):
        candidate = match[0] + value + match[2]
        if (is_utf8 or candidate.isascii()) and _python_text(candidate) == value:
            return candidate
    return repr(value) if is_utf8 else ascii(value)


def _python_text(text: str) -> Any:
    try:
        return ast.literal_eval(text)
    except (SyntaxError, ValueError):
        return None


def in_manner_of(old: str, value: _Value) -> str:
    """Write a number in Python, in the notation of the number that it replaces.

    `2.50` becomes `3.25` or `3.00`, `.5` becomes `.25`, `1e-3` becomes `2.5e-3`; if the manner cannot hold the value
    exactly, `repr` does.

    Args:
        old: how the number before is written.
        value: a finite number.

    Returns:
        A text that reads back to exactly that value.
    """
    return next((one for one in _numbers(old, value) if _says(_python(one), value)), repr(value))


def notations(old: str, value: Scalar) -> Iterator[str]:
    """The ways to write a value in YAML and launch files, those in the manner of the one that it replaces first.

    The language decides what each of them reads as: which one is taken is for the caller to find out.
    """
    if isinstance(value, bool):
        yield from _truths(old, value)
    elif isinstance(value, str):
        quoted = [
            yaml.safe_dump(value, default_style=mark, allow_unicode=True, width=float('inf')).rstrip('\n')
            for mark in ("'", '"')
        ]
        ways = [value, *quoted] if value else [*quoted, value]
        yield from sorted(ways, key=lambda one: one[:1] != old[:1])
    else:
        yield from _numbers(old, value)
        # YAML 1.1 takes `1e+300` as a text.
        mantissa, exponent, power = repr(value).partition('e')
        yield (mantissa if '.' in mantissa else mantissa + '.0') + exponent + power
        expanded = '{:f}'.format(Decimal(repr(value)))
        yield expanded if '.' in expanded else expanded + '.0'


def check_replaceable(file: str, old: str, present: object, said: Sequence[Scalar], value: Scalar) -> None:
    """Raise ValueError if a value must not replace the one in a file.

    Args:
        file: where it stands.
        old: how it is written there.
        present: what that reads as.
        said: what it may be; empty for whatever stands there.
        value: the new one.
    """
    if not alike(present, value):
        raise ValueError(f'{value!r} is of another kind than {old}, which {file} says')
    if said and not any(equal(present, one) for one in said):
        raise ValueError(f'it was edited since it was loaded: {file} says {old} instead of {said[0]!r}')


def _truths(old: str, value: bool) -> List[str]:
    """List the notations of a truth value in YAML and launch files, best first: `yes` becomes `no`, `True` `False`."""
    said = [pair[not value] for pair in _TRUTHS if old.lower() in pair] + ['true' if value else 'false']
    return [*(one.title() if old.istitle() else one.upper() if old.isupper() else one for one in said), said[-1]]


def _numbers(old: str, value: _Value) -> Iterator[str]:
    match = _NUMBER.fullmatch(old.strip())
    if match:
        yield from _candidates(match, value)
    yield repr(value)


def _python(text: str) -> _Value:
    return float(text) if re.search(r'[.eE]', text) else int(text)


def _says(read: _Value, value: _Value) -> bool:
    # A whole number may be written as one if it stands for a float: `x = 3` after `x = 2`.
    return float(read) == value and repr(float(read)) == repr(float(value))


def _candidates(old: 're.Match[str]', value: _Value) -> Iterator[str]:
    # repr has the fewest digits that say the number, and Decimal moves its point without rounding.
    exact = Decimal(repr(value))
    sign, exact = '-' if exact.is_signed() else '+' if old['sign'] == '+' else '', abs(exact)
    if old['exponent']:
        mantissa = exact.scaleb(-int(old['exponent'][1:]))
        if mantissa == 0 or Decimal('0.01') <= mantissa < 1000:
            yield sign + _positional(old, mantissa) + old['exponent']
        elif type(value) is float:
            power = exact.adjusted()
            letter, width = old['exponent'][0], len(old['exponent'].lstrip('eE+-'))
            mark = '-' if power < 0 else '+' if '+' in old['exponent'] else ''
            yield f'{sign}{_positional(old, exact.scaleb(-power))}{letter}{mark}{abs(power):0{width}d}'
    elif exact == 0 or -_LONGEST < exact.adjusted() < _LONGEST:
        yield sign + _positional(old, exact)


def _positional(old: 're.Match[str]', number: Decimal) -> str:
    """A number without an exponent, with as many decimals as the old one, or more if it needs them."""
    whole, _, fraction = '{:f}'.format(number).partition('.')
    fraction = fraction.rstrip('0')
    if not fraction and not old['point']:
        return whole
    if old['point'] and not old['whole'] and whole == '0' and fraction:
        whole = ''
    # `5.` and a whole number that gets decimals have no width to keep.
    return f'{whole}.{fraction.ljust(len(old["fraction"]), "0")}'
