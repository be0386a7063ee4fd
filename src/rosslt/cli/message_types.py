"""Message types, for tab completion. Before a workspace is built, nothing else of the command can be loaded."""

from typing import Iterable, Sequence

from rosslt import messages


def message_types(word: str, _before: Sequence[str] = ()) -> Iterable[str]:
    """Message types: packages first, then the types of the one that was chosen."""
    path = messages.MessagePath()
    package, slash, _ = word.partition('/')
    if not slash:
        return [name + '/' for name in path.packages()]
    try:
        return [name + ' ' for name in path.types(package)]
    except messages.UnknownType:
        return []


def message_packages(_word: str, _before: Sequence[str] = ()) -> Iterable[str]:
    """Packages that have messages."""
    return [name + ' ' for name in messages.MessagePath().packages()]
