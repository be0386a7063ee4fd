"""NumPy for tracked values: arrays that know where their elements come from, and NumPy's functions that make them.

This folder imports NumPy, so the room loads it only when it is asked for. `numbers.py` has the classes of numbers,
`graph.py` how arrays were computed, `memory.py` where their elements come from, `noted.py` which of them nobody has
written since, `tracked_array.py` the class of arrays,
`calling.py` what calls NumPy with them, `functions.py` NumPy's functions by name, `objects.py` functions and classes of
other libraries.
"""

from .calling import LOST, compute
from .functions import FUNCTIONS, replacements
from .graph import FAULTS
from .noted import Noted
from .numbers import CLASSES, PYTHON_NUMBERS, conversion, python_number, same_number, with_tracked
from .objects import can_keep, pure, pure_class, unkept
from .tracked_array import TrackedArray, holds_tracked, of_list, plain
