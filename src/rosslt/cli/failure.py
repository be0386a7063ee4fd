"""The exceptions that end the command with an error, and what may have been meant."""

import difflib
from typing import Iterable


class Failure(Exception):
    """The command failed: exit code 1. The text says why, in one line."""


class Misused(Exception):
    """The arguments do not fit together: exit code 2, as for those that the parser refuses."""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """The known name that is most like a word, as ` (did you mean NAME?)`; '' if none is like it."""
    names = {name.lower(): name for name in known}
    found = difflib.get_close_matches(word.lower(), names, n=1)
    return f' (did you mean {names[found[0]]}?)' if found else ''


def did_it_begin_with(path: str, known: Iterable[str]) -> str:
    """`did_you_mean` for a path that should begin with one of several names: as many of its words are compared with a
    name as that has, those with most words first."""
    words, names = path.split('/'), list(known)
    for count in sorted({name.count('/') for name in names}, reverse=True):
        meant = did_you_mean('/'.join(words[: count + 1]), [name for name in names if name.count('/') == count])
        if meant:
            return meant
    return ''
