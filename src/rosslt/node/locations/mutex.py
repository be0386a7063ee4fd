"""The lock of a node's locations, which is never held while a function of the user is called."""

import contextlib
import threading
from typing import Any, Iterator

#: Held while locations come and go, and while their values change.
CHANGE_LOCK = threading.RLock()


@contextlib.contextmanager
def change_lock_released() -> Iterator[None]:
    """Release CHANGE_LOCK if this thread holds it, and take it again, as `threading.Condition.wait` does."""
    lock: Any = CHANGE_LOCK
    if not lock._is_owned():
        yield
        return
    state = lock._release_save()
    try:
        yield
    finally:
        lock._acquire_restore(state)
