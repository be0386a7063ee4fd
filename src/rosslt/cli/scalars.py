"""Scalars as people type them."""

from typing import Union


def parse_scalar(text: str, kind: str) -> Union[float, int, str, bool]:
    """A text as a value of a type.

    Args:
        text: `1.5`, `3`, `true`, or any text.
        kind: `float`, `int`, `str` or `bool`.

    Raises:
        ValueError: it is no such thing.
    """
    if kind == 'str':
        try:
            text.encode('utf-8')
        except UnicodeEncodeError:
            raise ValueError(f'{text!r} is not UTF-8') from None  # as bytes of a shell may be
        return text
    if kind == 'bool':
        if text.lower() not in ('true', 'false'):
            raise ValueError(f'{text!r} is neither true nor false')
        return text.lower() == 'true'
    number = {'float': float, 'int': int}[kind]
    try:
        value = number(text)
    except ValueError:
        raise ValueError(f'{text!r} is no {kind}') from None
    if value - value != 0:
        raise ValueError(f'{text!r} is not finite')
    return value
