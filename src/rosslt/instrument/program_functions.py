"""The compiled functions that rewritten programs call instead of Python's own, each under its name for pickle."""

from typing import Any, Dict

from rosslt.instrument.functions import MATH as MATH
from rosslt.instrument.functions import REFLECTING, to_float, to_int

_ALL: Dict[str, Any] = {**MATH, **REFLECTING, 'float': to_float, 'int': to_int}

for _function in _ALL.values():
    _function.__module__ = __name__

globals().update(_ALL)
