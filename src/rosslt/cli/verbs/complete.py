"""`rosslt complete LINE WORD`: what may stand at the end of a line, for bash; cmake/50.rosslt.bash calls it."""

import contextlib
import re

import genpy.message

from rosslt import messages
from rosslt.cli import VERBS
from rosslt.cli.directory import Directory
from rosslt.cli.failure import Failure
from rosslt.cli.master import find_master, full_name, tracked_nodes

#: How long to wait for anybody, in seconds: nobody likes a terminal that hangs.
_TIMEOUT = 0.7

#: The options that take an argument.
_TAKES_ARGUMENT = {'-n', '--bag', '--source', '--time', '--timeout'}


def run(arguments):
    """Print the completions.

    Args:
        arguments: the line up to the cursor, and what bash takes for its last word: the end of it, where the word has
            a colon.
    """
    line, seen = arguments
    words = line.split()[1:]
    word = words.pop() if words and not line[-1:].isspace() else ''
    with contextlib.suppress(Failure):
        for candidate in _candidates(words, word):
            if candidate.startswith(word) and candidate != word:
                print(candidate[len(word) - len(seen) :])


def _candidates(words, word):
    """Whole words that may stand there. One that is complete ends with a space."""
    if not words:
        return [verb + ' ' for verb in VERBS]
    if words[-1] == '--source':
        return _locations(word)
    if words[-1] in _TAKES_ARGUMENT:
        return []
    position = sum(not each.startswith('-') and before not in _TAKES_ARGUMENT for before, each in zip(words, words[1:]))
    kind = _KINDS.get((words[0], position))
    return kind(word) if kind else []


def _nodes(word):
    return [name + ' ' for name in _as_typed(tracked_nodes(find_master(_TIMEOUT)), word)]


def _locations(word):
    nodes = tracked_nodes(find_master(_TIMEOUT))
    path = word if word.startswith('/') else _namespace() + word
    begun = [name for name in nodes if path.startswith(name + '/')]
    places, _ = Directory().ask(begun, _TIMEOUT)
    names = [place.name + ' ' for name in begun for place in places.get(name, ())]
    return _as_typed([*names, *(name + '/' for name in nodes if name not in begun)], word)


def _topics(word, end=' '):
    types = dict(find_master(_TIMEOUT).getPublishedTopics('/'))
    path = word if word.startswith('/') else _namespace() + word
    topic = max((name for name in types if path.startswith(name + '/')), key=len, default=None)
    names = [name + end for name in types]
    if topic is not None:
        begun = path[len(topic) :].rpartition('/')[0]
        names += [f'{topic}{begun}/{field}' for field in _fields(types[topic], begun)]
    return _as_typed(names, word)


def _topics_with_fields(word):
    return _topics(word, end='/')


def _fields(type_, path):
    """The names of the fields of a message type at a path, each with what may follow it."""
    for name in re.findall(r'/(\w+)', path):
        type_ = dict(_slots(type_)).get(name, '').partition('[')[0]
    return [name + ('[' if '[' in slot else '/' if '/' in slot else ' ') for name, slot in _slots(type_)]


def _slots(type_):
    found = genpy.message.get_message_class(type_) if '/' in type_ else None
    if found is None:
        return []
    if messages.is_tracked_type(found):
        found = messages.plain_type(found)
    return list(zip(found.__slots__, found._slot_types))


def _as_typed(names, word):
    """Full names, or those in the own namespace where the word that is begun is none."""
    if not word or word.startswith('/'):
        return names
    return [name[len(_namespace()) :] for name in names if name.startswith(_namespace())]


def _namespace():
    return full_name('x')[:-1]


#: What may stand as an argument of a verb: (verb, its position) -> a function of the word that is begun.
_KINDS = {
    ('list', 0): _nodes,
    ('get', 0): _locations,
    ('set', 0): _locations,
    ('undo', 0): _nodes,
    ('save', 0): _nodes,
    ('echo', 0): _topics,
    ('force', 0): _topics_with_fields,
    ('graph', 0): _topics,
}
