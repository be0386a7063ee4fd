"""What NumPy's numbers have and Python's have not, for numbers with provenance.

A number that is read from an array, or that a function of NumPy gives, is a `numpy.float64` without provenance and a
tracked float with it: a node may ask either for `x.item()` or `x.astype(int)`.
"""

from typing import Any

import numpy

from rosslt import values
from rosslt.instrument.array_numbers import to_float32

_SAME = ('item', 'tolist', 'copy', 'squeeze', 'sum', 'mean', 'min', 'max', 'prod', 'conj')
#: Not `dtype`, by which the room `values` tells NumPy's numbers and arrays from Python's.
_PLAIN = [
    'all',
    'any',
    'argmax',
    'argmin',
    'clip',
    'cumsum',
    'flatten',
    'itemsize',
    'nbytes',
    'ndim',
    'nonzero',
    'ravel',
    'repeat',
    'reshape',
    'shape',
    'size',
    'std',
    'strides',
    'tobytes',
    'transpose',
    'var',
]


def _itself(self: Any, *arguments: Any, **options: Any) -> Any:
    return self


def _of_numpy(kind: Any, name: str) -> property:
    return property(lambda self: getattr(kind(self._plain), name))


def _astype(kind: Any) -> Any:
    def astype(self: Any, dtype: Any, *arguments: Any, **options: Any) -> Any:
        """As of `numpy.generic`; floats of 64 and 32 bits and ints of 64 keep their provenance."""
        wanted = numpy.dtype(dtype).char
        if wanted == 'f':
            return to_float32(self)
        if wanted == 'd':
            return values.to_float(self)
        return values.to_int(self) if wanted == 'l' else kind(self._plain).astype(dtype, *arguments, **options)

    return astype


def _round(self: Any, decimals: Any = 0, out: Any = None) -> Any:
    return round(self, decimals)


def give_attributes_of_numpy() -> None:
    """Let tracked floats and ints have the attributes of `numpy.float64` and `numpy.int64`."""
    for kind, made_of in ((numpy.float64, 0.0), (numpy.int64, 0)):
        tracked = type(values.track(made_of, values.Source('/', 0)))
        for name in _SAME:
            setattr(tracked, name, _itself)
        for name in _PLAIN:
            setattr(tracked, name, _of_numpy(kind, name))
        tracked.T = property(_itself)
        tracked.astype = _astype(kind)
        tracked.round = _round
