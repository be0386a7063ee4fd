"""Solving: the source values that make results equal their targets (paper, IV.A, `force_value`).

`solving.py` chooses which sources change, within the constraints of `freedom.py`. `scalar.py` solves for one source,
`system.py` for several sources together (`components.py`, `equations.py` and `descent.py` are its parts): near by
first, then from other values in a fixed order, at last from all over the bounds. `nearest.py` finds the nearest answer
if the target cannot be reached, and `continuation.py` follows a target along a path. `root_finding.py` and
`least_squares.py` do the numerics, `periods.py` knows by how much an angle can turn without effect, and `budget.py`
limits the work.
"""

from .continuation import continued
from .nearest import effects, nearest, slopes, source_values
from .solving import solve

__all__ = ['continued', 'effects', 'nearest', 'slopes', 'solve', 'source_values']
