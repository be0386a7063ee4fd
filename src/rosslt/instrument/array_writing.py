"""The ways to change an array with provenance beside operators and `a[i] = x`: methods, attributes and functions of
NumPy that write to it, or give it another shape.

What these write has no provenance: an element must not keep that of the number which it held before.
"""

import sys
from typing import Any, Callable, Dict, Tuple

import numpy

from rosslt.instrument.array_arguments import plain
from rosslt.instrument.arrays import ArrayWithProvenance

_FLAT: Any = numpy.ndarray.flat
_SHAPE: Any = numpy.ndarray.shape

#: The functions that write to their first argument, and how that is called.
_WRITING = {
    numpy.copyto: 'dst',
    numpy.put: 'a',
    numpy.place: 'arr',
    numpy.putmask: 'a',
    numpy.fill_diagonal: 'a',
    numpy.put_along_axis: 'arr',
}


def written_by(function: Any, arguments: Tuple[Any, ...], options: Dict[str, Any]) -> Any:
    """The argument that a function of NumPy writes to, beside `out`; None where there is none."""
    name = _WRITING.get(function)
    if name is None:
        return None
    return arguments[0] if arguments else options[name]


def _writing(name: str) -> Callable[..., Any]:
    original = getattr(numpy.ndarray, name)

    def method(self: ArrayWithProvenance, *arguments: Any, **options: Any) -> Any:
        self.write_beside(None)
        return original(self, *map(plain, arguments), **plain(options))

    method.__name__ = name
    return method


class _Flat:
    """`numpy.ndarray.flat` of an array with provenance.

    Args:
        array: the array.
    """

    __slots__ = ('_array', '_flat')

    def __init__(self, array: ArrayWithProvenance) -> None:
        self._array = array
        self._flat = _FLAT.__get__(array)

    def __setitem__(self, key: Any, value: Any) -> None:
        self._flat[key] = plain(value)
        if self._array._beside is not None:
            self._array._beside.flat[key] = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._flat, name)


def _of_flat(name: str) -> Callable[..., Any]:
    return lambda self, *arguments: getattr(self._flat, name)(*arguments)


def _set_flat(array: ArrayWithProvenance, value: Any) -> None:
    array.write_beside(None)
    _FLAT.__set__(array, plain(value))


def _set_shape(array: ArrayWithProvenance, shape: Any) -> None:
    _SHAPE.__set__(array, shape)
    if array._beside is not None:
        array._beside = array._beside.reshape(shape)


class _Probe:
    def references(self) -> int:
        return sys.getrefcount(self)


def _references_of_one_name() -> int:
    """Count the references that a method sees to its object when exactly one name refers to the object."""
    probe = _Probe()
    return probe.references()


_ALONE = _references_of_one_name()


def _resize(self: Any, *shape: Any, refcheck: bool = True) -> None:
    """Override the method of `numpy.ndarray`: the elements lose their provenance.

    An array with provenance is a view of a plain one that has its numbers, and NumPy itself resizes no view.
    """
    base = self.base
    if base is not None and (type(base) is not numpy.ndarray or base.base is not None or base.size != self.size):
        numpy.ndarray.resize(self, *shape, refcheck=refcheck)  # which says that it is a view
        return
    if refcheck and sys.getrefcount(self) > _ALONE:
        raise ValueError(
            'cannot resize an array that references or is referenced\nby another array in this way.\n'
            'Use the np.resize function or refcheck=False'
        )
    made = self.view(numpy.ndarray).copy()
    made.resize(*shape, refcheck=False)
    self._beside = None
    self.__setstate__((1, made.shape, made.dtype, False, made.tobytes()))


for _name in ('put', 'sort', 'partition', 'itemset'):
    if hasattr(numpy.ndarray, _name):  # not every NumPy has the last one
        setattr(ArrayWithProvenance, _name, _writing(_name))
for _name in ('delitem', 'getitem', 'iter', 'next', 'len', 'array', 'eq', 'ne', 'lt', 'le', 'gt', 'ge'):
    setattr(_Flat, f'__{_name}__', _of_flat(f'__{_name}__'))
_ARRAY: Any = ArrayWithProvenance
_ARRAY.flat = property(_Flat, _set_flat)
_ARRAY.shape = property(_SHAPE.__get__, _set_shape)
_ARRAY.resize = _resize
