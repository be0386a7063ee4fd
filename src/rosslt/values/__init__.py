"""Values that know where they came from and what was done to them (paper, section IV.B).

This room answers: what was done to a value, and what must its sources become to make it another? It
is pure Python and imports no ROS; NumPy is used where the caller brings it. It may import the standard
library only. Other rooms use the names below and nothing behind them.
"""

from . import operators  # noqa: F401, completes the tracked classes
from .affine import affine
from .errors import Error, NotInvertible, NotTracked
from .explain import explain
from .functions import MATH, to_bool, to_float, to_int
from .graph import evaluate, sources
from .instructions import AFFINE, CONSTANT, SOURCE, assemble, disassemble
from .numpy_ufuncs import compute_ufuncs_with
from .operations import BY_CODE as OPERATIONS
from .operations import Operation
from .reapply import reapply
from .solve import solve
from .sources import Source, describe_source, describe_sources_with
from .tracked import from_affine, lazy, origins, track
from .tree import is_tracked, leaves, untracked

__all__ = [
    'AFFINE',
    'CONSTANT',
    'MATH',
    'OPERATIONS',
    'SOURCE',
    'Error',
    'NotInvertible',
    'NotTracked',
    'Operation',
    'Source',
    'affine',
    'assemble',
    'compute_ufuncs_with',
    'lazy',
    'describe_source',
    'describe_sources_with',
    'disassemble',
    'evaluate',
    'explain',
    'from_affine',
    'is_tracked',
    'leaves',
    'origins',
    'reapply',
    'solve',
    'sources',
    'to_bool',
    'to_float',
    'to_int',
    'track',
    'untracked',
]
