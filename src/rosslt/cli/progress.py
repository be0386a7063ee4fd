"""A progress bar for people: on a terminal only, and gone when the work is done."""

import sys
from typing import Callable

#: How many characters the bar has.
LENGTH = 40


def bar(what: str) -> Callable[[int, int], None]:
    """A function that shows how far something is: `show(how many are done, of how many)`.

    Args:
        what: is being done.
    """
    if not sys.stderr.isatty():
        return lambda done, total: None

    def show(done: int, total: int) -> None:
        if done >= total:
            print('\r\033[K', end='', file=sys.stderr, flush=True)
            return
        filled = LENGTH * done // total
        marks = '#' * filled + '.' * (LENGTH - filled)
        print(f'\r{what} [{marks}] {100 * done // total} %', end='', file=sys.stderr, flush=True)

    return show
