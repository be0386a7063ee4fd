"""The one table of operations: what rosslt knows about arithmetic. A new operation is one row in `table.py`.

`row.py` says what a row holds, `form.py` in which forms a record uses one, `notation.py` how both are written for
people; `inverses.py` has the inverses that take more than a line.
"""

from . import table
from .form import (
    AFFINE,
    AFFINE_INSTRUCTION,
    CONSTANT_INSTRUCTION,
    LAZY,
    SOURCE,
    SOURCE_INSTRUCTION,
    Form,
    Record,
)
from .notation import FUNCTION
from .row import BY_CODE, Operation

__all__ = [
    'AFFINE',
    'AFFINE_INSTRUCTION',
    'BY_CODE',
    'CONSTANT_INSTRUCTION',
    'FUNCTION',
    'LAZY',
    'SOURCE',
    'SOURCE_INSTRUCTION',
    'Form',
    'Operation',
    'Record',
    'table',
]
