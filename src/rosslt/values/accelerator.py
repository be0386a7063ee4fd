"""The compiled core of this room, if there is one: what it does, the Python here does as well (PEP 399).

`catkin build` compiles it from `core/`. It lies beside the generated messages, if the devel space has a folder of
this package; the name of its file says for which Python it was built, so that no other Python loads it.
"""

import importlib
import inspect
import os
from typing import Any, Callable, TypeVar

INTERFACE = 20
"""The version of `core/module.c` that this code needs: a workspace may hold an older build."""


def _loaded() -> Any:
    if os.environ.get('ROSSLT_PURE', '') not in ('', '0'):
        return None
    try:
        core = importlib.import_module('rosslt._core')
    except ImportError:
        return None
    return core if core.INTERFACE == INTERFACE else None


CORE: Any = _loaded()
"""The compiled core, None if there is none, or if ROSSLT_PURE=1 asks for Python alone."""

Decorated = TypeVar('Decorated', bound=Callable[..., Any])
"""A function that is decorated."""


def documented(function: Callable[..., Any]) -> str:
    """The docstring of a function behind its signature, which is how a compiled function has both."""
    names = inspect.signature(function)
    bare = [one.replace(annotation=inspect.Parameter.empty) for one in names.parameters.values()]
    shown = names.replace(parameters=bare, return_annotation=inspect.Signature.empty)
    return '%s%s\n--\n\n%s' % (function.__name__, shown, inspect.getdoc(function) or '')
