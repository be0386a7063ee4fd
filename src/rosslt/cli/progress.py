"""A progress bar for people: on a terminal only, where something takes long, and gone when the work is done."""

import sys
import time
from typing import Callable

#: The number of characters of the bar.
LENGTH = 40

#: Before when nothing is shown, in seconds.
DELAY = 0.5


def bar(what: str) -> Callable[[int, int], None]:
    """A function that shows how far something is: `show(how many are done, of how many)`.

    Args:
        what: is being done.
    """
    if not sys.stderr.isatty():
        return lambda done, total: None

    due = time.monotonic() + DELAY

    def show(done: int, total: int) -> None:
        if time.monotonic() < due:
            return
        if done >= total:
            print('\r\033[K', end='', file=sys.stderr, flush=True)
            return
        filled = LENGTH * done // total
        marks = '#' * filled + '.' * (LENGTH - filled)
        print(f'\r{what} [{marks}] {100 * done // total} %', end='', file=sys.stderr, flush=True)

    return show
