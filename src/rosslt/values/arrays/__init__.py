"""NumPy for tracked values: arrays that hold them, and NumPy's functions on such arrays.

This folder imports NumPy, so the room loads it only when it is asked for (`rosslt.numpy`). `tracked_array.py` is the
class, `functions.py` the functions, `linear_algebra.py` those that NumPy itself computes in floats only.
"""

from .functions import FUNCTIONS
from .tracked_array import TrackedArray, array

__all__ = ['FUNCTIONS', 'TrackedArray', 'array']
