"""Solving: what the sources must become so that a result becomes what is wanted (paper, IV.A, `force_value`).

`choice.py` chooses which source changes, `one.py` solves for one source, `several.py` for several results together,
`root_finding.py` and `least_squares.py` do the numerics.
"""

from .choice import solve

__all__ = ['solve']
