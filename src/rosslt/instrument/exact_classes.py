"""Plain numbers and texts for functions of other packages that ask for an exact class, or compare by value."""

import csv
import functools
import marshal
import socket
from typing import Any, Callable

import genpy
import genpy.message

from rosslt import values
from rosslt.instrument.cells import plain


def give_plain_ones() -> None:
    """Have such functions get plain values, whoever calls them: `http.client` hands them the port of a parameter."""
    socket.getaddrinfo = _with_plain_arguments(socket.getaddrinfo)
    csv.field_size_limit = _with_plain_arguments(csv.field_size_limit)
    marshal.dumps, marshal.dump = _else_plain(marshal.dumps), _else_plain(marshal.dump)
    strify, check = genpy.message.strify_message, genpy.message.check_type

    def strify_message(val: Any, *arguments: Any, **options: Any) -> Any:
        # A list of numbers is shown on one line.
        if type(val) in (list, tuple) and val and values.is_tracked(val[0]):
            val = [values.untracked(part) for part in val]
        return strify(val, *arguments, **options)

    def check_type(field_name: object, field_type: object, field_val: object) -> None:
        check(field_name, field_type, values.untracked(field_val))

    genpy.message.strify_message = genpy.strify_message = strify_message
    genpy.message.check_type = genpy.check_type = check_type


def _with_plain_arguments(function: Callable[..., Any]) -> Any:
    @functools.wraps(function)
    def called(*arguments: object, **options: object) -> Any:
        return function(*map(plain, arguments), **{name: plain(option) for name, option in options.items()})

    return called


def _else_plain(function: Callable[..., Any]) -> Any:
    """A function of `marshal`, which gets its first argument without provenance if it would refuse it."""

    @functools.wraps(function)
    def called(value: object, *arguments: object) -> Any:
        try:
            return function(value, *map(plain, arguments))
        except ValueError:
            return function(values.untracked(value), *map(plain, arguments))

    return called


def lru_cache(maxsize: Any = 128, typed: Any = False) -> Any:
    """`functools.lru_cache`, which takes arguments without provenance: numbers of two sources may be equal."""
    made = functools.lru_cache(plain(maxsize), typed)

    def decorated(function: Callable[..., Any]) -> Any:
        return _cached(made(function))

    return _cached(made) if hasattr(made, 'cache_info') else decorated


def _cached(original: Any) -> Any:
    called = functools.wraps(original.__wrapped__)(_with_plain_arguments(original))
    for name in ('cache_info', 'cache_clear', 'cache_parameters'):
        if hasattr(original, name):
            setattr(called, name, getattr(original, name))
    return called


def cache(user_function: Callable[..., Any]) -> Any:
    """`functools.cache`, as `lru_cache` here."""
    return lru_cache(maxsize=None)(user_function)
