"""The one table of operations: what rosslt knows about arithmetic. A new operation is one row in `table.py`.

`form.py` says what a row and a record of its use hold; `inverses.py` has the inverses that take more than a line.
"""

from . import table
from .form import AFFINE, BY_CODE, FUNCTION, LAZY, SOURCE, Form, Operation

__all__ = ['AFFINE', 'BY_CODE', 'FUNCTION', 'LAZY', 'SOURCE', 'Form', 'Operation', 'table']
