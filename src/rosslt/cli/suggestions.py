"""Suggestions for misspelt names."""

import difflib
from typing import Iterable


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """The known name that is most like a word, as ` (did you mean NAME?)`; '' where none is like it."""
    found = difflib.get_close_matches(word, list(known), n=1)
    return f' (did you mean {found[0]}?)' if found else ''


def did_you_mean_beginning(path: str, known: Iterable[str]) -> str:
    """Suggest a known name for the beginning of a path: `/traget/pose/x` suggests `/target`."""
    steps, known = path.split('/'), list(known)
    guesses = []
    for count in range(2, len(steps) + 1):
        begun = '/'.join(steps[:count])
        for found in difflib.get_close_matches(begun, known, n=1):
            guesses.append((difflib.SequenceMatcher(None, begun, found).ratio(), found))
    return f' (did you mean {max(guesses)[1]}?)' if guesses else ''
