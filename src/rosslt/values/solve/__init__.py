"""Solving: what the sources must become so that a result becomes what is wanted (paper, IV.A, `force_value`).

`choice.py` chooses which sources change, within what `freedom.py` says, `one.py` solves for one source, `several.py`
for several sources together (`components.py`, `equations.py` and `descent.py` are its parts): near by first, then from
other values in a fixed order. `nearest.py` comes as near as it gets if nothing gives the target, `continuation.py`
follows a target along a path. `root_finding.py` and `least_squares.py` do the numerics, `periods.py` knows by how much
an angle can be turned without a difference, and `budget.py` says what it may cost.
"""

from .continuation import continued
from .nearest import nearest, slopes, source_values
from .solving import solve

__all__ = ['continued', 'nearest', 'slopes', 'solve', 'source_values']
