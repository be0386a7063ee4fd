"""A cache of limited size that drops its oldest entries."""

import threading
from typing import Dict, Generic, Hashable, Optional, TypeVar

Value = TypeVar('Value')


class BoundedCache(Generic[Value]):
    """Keeps the values that were put into it last. Several threads may use it.

    Args:
        size: the largest number of values.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._values: Dict[Hashable, Value] = {}
        # Reentrant, as a signal's handler may publish in the middle of a publish.
        self._lock = threading.RLock()

    def get(self, key: Hashable) -> Optional[Value]:
        """The value of a key, None where it is not remembered."""
        return self._values.get(key)

    def put(self, key: Hashable, value: Value) -> None:
        """Store a value for a key and replace its earlier value."""
        with self._lock:
            self._values[key] = value
            if len(self._values) > self._size:
                del self._values[next(iter(self._values))]

    def clear(self) -> None:
        """Forget everything."""
        with self._lock:
            self._values.clear()
