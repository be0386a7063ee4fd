"""Completions of a command line, for bash; cmake/50.rosslt.bash calls this."""

import contextlib
import importlib
from typing import Iterable, List, Optional, Sequence, Tuple

from rosslt.cli import verb
from rosslt.cli.failure import Failure


def write_completions(line: str, seen: str) -> None:
    """Print the completions.

    Args:
        line: the line up to the cursor.
        seen: the last word as bash sees it: only its end if the word has a colon or an equals sign; that sign itself if
            nothing is behind it yet.
    """
    seen = '' if seen in ('=', ':') else seen
    words = line.split()[1:]
    word = words.pop() if words and not line[-1:].isspace() else ''
    with contextlib.suppress(Failure):
        for candidate in _candidates(words, word):
            if candidate.startswith(word) and candidate != word:
                print(candidate[len(word) - len(seen) :])


def _candidates(words: Sequence[str], word: str) -> Iterable[str]:
    """Whole words that may stand there. One that is complete ends with a space."""
    known = verb.names()
    if not words:
        return [name + ' ' for name in known]
    if words[0] not in known:
        return []
    arguments = verb.load(words[0]).ARGUMENTS
    waiting, positional = _parsed(arguments, words[1:])
    if waiting is None and word.startswith('-'):
        return [name + ' ' for argument in arguments if argument.is_option for name in argument.names]
    argument = waiting or _at(arguments, len(positional))
    if argument is None or not argument.completer:
        return []
    # Only arguments that need them wait for rospy and genpy.
    completers = importlib.import_module('rosslt.cli.completers')
    words_offered: Iterable[str] = getattr(completers, argument.completer)(word, positional)
    return words_offered


def _parsed(arguments: Sequence[verb.Argument], words: Sequence[str]) -> Tuple[Optional[verb.Argument], List[str]]:
    """The meaning of the complete words of a line: the option that waits for its word, and the positional words."""
    options = {name: argument for argument in arguments if argument.is_option for name in argument.names}
    waiting: Optional[verb.Argument] = None
    positional: List[str] = []
    for word in words:
        if waiting:
            waiting = None
        elif word.startswith('-'):
            option = options.get(word)
            waiting = option if option and option.takes_word else None
        else:
            positional.append(word)
    return waiting, positional


def _at(arguments: Sequence[verb.Argument], position: int) -> Optional[verb.Argument]:
    """The positional argument at a position, None if there are not so many."""
    positional = [argument for argument in arguments if not argument.is_option]
    if position < len(positional):
        return positional[position]
    return positional[-1] if positional and positional[-1].is_repeated else None
