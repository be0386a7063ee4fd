"""What somebody may have meant who misspelt a name."""

import difflib
from typing import Iterable


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """The known name that is most like a word, as ` (did you mean NAME?)`; '' where none is like it."""
    found = difflib.get_close_matches(word, list(known), n=1)
    return f' (did you mean {found[0]}?)' if found else ''
