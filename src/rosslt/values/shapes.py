"""Says whether an array may get another shape when its expressions are evaluated for other numbers.

An expression knows one element, so it has a value as long as the array has that element. Who replaces elements in an
array that stays needs to know that its shape is still the same.
"""

import contextlib
import threading
from typing import Iterator


class OtherShape(ArithmeticError):
    """Raised if NumPy makes an array of another shape for other numbers."""


class _Kept(threading.local):
    is_kept = False


_KEPT = _Kept()


@contextlib.contextmanager
def keeping_shapes() -> Iterator[None]:
    """While this lasts, evaluating an element of an array that would have another shape raises OtherShape."""
    before, _KEPT.is_kept = _KEPT.is_kept, True
    try:
        yield
    finally:
        _KEPT.is_kept = before


def are_kept() -> bool:
    """Return whether the shapes of arrays are to be the same in this thread."""
    return _KEPT.is_kept
