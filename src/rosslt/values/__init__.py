"""Values that know where they came from and how they were computed (paper, section IV-B).

This room answers: how was a value computed, and which source values give a wanted result? It imports no ROS, and does
without its compiled core if there is none. It may import the standard library, and NumPy and SciPy where they are
installed. Other rooms use the names below and nothing behind them.
"""

import importlib
from typing import Any, Callable, Dict

from . import numpy_ufuncs, operators
from .affine import affine, linearized
from .angles import sources_of_angles
from .calls import operation
from .errors import Error, NotInvertible, NotTracked
from .explain import explain
from .fit import Fit, fit
from .functions import MATH, keeping, recorder, reflecting, stripper, to_bool, to_float, to_int
from .graph import evaluate, sources
from .instructions import AFFINE, CONSTANT, SOURCE, assemble, disassemble
from .operations import BY_CODE as OPERATIONS
from .operations import Operation
from .recording import OPERATION, allow, limit_recording, reapply, spend, timed, whole, widened
from .shapes import OtherShape, keeping_shapes
from .slots import KEEPS_LOCALS, exchange
from .solve import continued, effects, nearest, slopes, solve, source_values
from .sources import UNKNOWN, Source, UnnamedSource, describe_sources_with
from .tolerances import is_same
from .tracked import TRACKED as TRACKED_CLASSES
from .tracked import (
    lazy,
    lazy_of,
    origins,
    plain_scalar,
    remake,
    source_of_functions,
    track,
)
from .tree import each_leaf, is_object_array, is_tracked, leaves, rebuilt, untracked

__all__ = [
    'AFFINE',
    'CONSTANT',
    'KEEPS_LOCALS',
    'MATH',
    'OPERATION',
    'OPERATIONS',
    'SOURCE',
    'TRACKED_CLASSES',
    'Error',
    'Fit',
    'NotInvertible',
    'NotTracked',
    'Operation',
    'OtherShape',
    'Source',
    'UnnamedSource',
    'affine',
    'allow',
    'assemble',
    'continued',
    'describe_sources_with',
    'disassemble',
    'each_leaf',
    'effects',
    'evaluate',
    'exchange',
    'explain',
    'fit',
    'is_object_array',
    'is_same',
    'is_tracked',
    'keeping',
    'keeping_shapes',
    'lazy',
    'lazy_of',
    'leaves',
    'limit_recording',
    'linearized',
    'nearest',
    'numpy_arrays',
    'numpy_functions',
    'operation',
    'origins',
    'plain_scalar',
    'reapply',
    'rebuilt',
    'recorder',
    'reflecting',
    'remake',
    'slopes',
    'solve',
    'source_of_functions',
    'source_values',
    'sources',
    'sources_of_angles',
    'spend',
    'stripper',
    'timed',
    'to_bool',
    'to_float',
    'to_int',
    'track',
    'untracked',
    'whole',
    'widened',
]


def numpy_arrays() -> Any:
    """The folder `arrays`: NumPy's arrays and numbers with provenance. NumPy is imported for it."""
    return importlib.import_module('.arrays', __name__)


numpy_ufuncs.LOADERS.append(numpy_arrays)


def numpy_functions() -> Dict[str, Callable[..., Any]]:
    """NumPy's public functions by name (`dot`, `linalg.inv`), each keeping provenance; NumPy is imported for it."""
    functions: Dict[str, Callable[..., Any]] = numpy_arrays().FUNCTIONS
    return functions
