"""The names of NumPy, for tracked values: `from rosslt import numpy as np` instead of `import numpy as np`.

The functions keep the provenance of tracked scalars, of lists and arrays that hold them, and give what NumPy's give
for plain numbers. `array`, `zeros`, `ones` and their like make arrays that take tracked values, which NumPy's own
functions work on too (see `docs/values.md`).
"""

import types
from typing import Any

import numpy

from .values import numpy_functions

FUNCTIONS = numpy_functions()
linalg = types.ModuleType('rosslt.numpy.linalg', numpy.linalg.__doc__)
vars(linalg).update(
    (name, FUNCTIONS.get('linalg.' + name, thing)) for name, thing in vars(numpy.linalg).items() if name[0] != '_'
)
globals().update((name, function) for name, function in FUNCTIONS.items() if '.' not in name)

__all__ = list(numpy.__all__)
__all__ += ['linalg']


def __getattr__(name: str) -> Any:
    return getattr(numpy, name)
