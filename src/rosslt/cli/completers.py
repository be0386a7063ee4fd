"""Completions for the arguments of verbs: nodes, locations, topics, their fields, message types.

Each function takes the word that is begun and the positional arguments before it, and gives the words that may stand
there. A word that is complete ends with a space.
"""

import re
from typing import Iterable, List, Sequence, Tuple

import genpy.message

from rosslt import files, messages
from rosslt.cli.master import find_master, full_name, tracked_nodes
from rosslt.node import Directory

#: Timeout of completion for a master or a node, in seconds.
_TIMEOUT = 0.7

#: The type of the messages of joints.
_JOINTS = 'sensor_msgs/JointState'

#: What the name of a device begins with that is a frame of tf.
_TF = 'tf:'


def nodes(word: str, _before: Sequence[str] = ()) -> Iterable[str]:
    """Nodes that have locations."""
    return [name + ' ' for name in _as_typed(tracked_nodes(find_master(_TIMEOUT)), word)]


def locations(word: str, _before: Sequence[str] = ()) -> Iterable[str]:
    """NODE/LOCATION: nodes first, then the locations of the one that was chosen."""
    nodes = tracked_nodes(find_master(_TIMEOUT))
    path = word if word.startswith('/') else _namespace() + word
    begun = [name for name in nodes if path.startswith(name + '/')]
    places, _ = Directory().ask(begun, _TIMEOUT)
    names = [place.name + ' ' for name in begun for place in places.get(name, ())]
    return _as_typed([*names, *(name + '/' for name in nodes if name not in begun)], word)


def nodes_and_locations(word: str, _before: Sequence[str] = ()) -> Iterable[str]:
    """NODE or NODE/LOCATION."""
    return [*nodes(word), *locations(word)]


def row_operations(_word: str, _before: Sequence[str] = ()) -> Iterable[str]:
    """Complete the operations of `rosslt row`."""
    return [operation + ' ' for operation in files.OPERATIONS]


def topics(word: str, _before: Sequence[str] = (), end: str = ' ') -> Iterable[str]:
    """TOPIC[/FIELD]: published topics, and the fields of the one that was chosen."""
    types = dict(find_master(_TIMEOUT).getPublishedTopics('/'))
    path = word if word.startswith('/') else _namespace() + word
    topic = max((name for name in types if path.startswith(name + '/')), key=len, default=None)
    names = [name + end for name in types]
    if topic is not None:
        begun = path[len(topic) :].rpartition('/')[0]
        names += [f'{topic}{begun}/{field}' for field in _fields(types[topic], begun)]
    return _as_typed(names, word)


def fields(word: str, before: Sequence[str] = ()) -> Iterable[str]:
    """TOPIC/FIELD: as `topics`, but that a topic alone is not complete."""
    return topics(word, before, end='/')


def targets(word: str, _before: Sequence[str] = ()) -> Iterable[str]:
    """What a device may move: TOPIC[/FIELD], TOPIC:JOINT, NODE/LOCATION."""
    return _joints(word) if ':' in word else [*topics(word), *_joints(word), *locations(word)]


def devices(word: str, _before: Sequence[str] = ()) -> Iterable[str]:
    """What may move a thing or a number: TOPIC[/FIELD], tf:FRAME."""
    if not word.startswith(_TF):
        return [_TF, *topics(word)]
    published = dict(find_master(_TIMEOUT).getPublishedTopics('/'))
    frames = {
        name.lstrip('/')
        for message in _heard([topic for topic in ('/tf', '/tf_static') if topic in published])
        for transform in message.transforms
        for name in (transform.header.frame_id, transform.child_frame_id)
    }
    return [f'{_TF}{name} ' for name in sorted(frames)]


def matches(word: str, _before: Sequence[str] = ()) -> Iterable[str]:
    """WANTED=MEASURED: the fields of topics, and joints, on both sides."""
    wanted, equals, measured = word.partition('=')
    begun = measured if equals else wanted
    names = _joints(begun)
    if ':' not in begun:
        names = [*(topics(begun) if equals else fields(begun)), *names]
    if equals:
        return [f'{wanted}={name}' for name in names]
    return [name[:-1] + '=' if name.endswith(' ') else name for name in names]


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


def _joints(word: str) -> List[str]:
    """TOPIC:JOINT: topics of joints first, then the joints of the one that was chosen."""
    head, colon, _ = word.partition(':')
    types = dict(find_master(_TIMEOUT).getPublishedTopics('/'))
    if not colon:
        return _as_typed([topic + ':' for topic, type_ in types.items() if type_ == _JOINTS], word)
    topic = full_name(head)
    heard = _heard([topic]) if types.get(topic) == _JOINTS else []
    return [f'{head}:{name} ' for name in dict.fromkeys(name for message in heard for name in message.name)]


def _heard(names: Sequence[str]) -> List[messages.Message]:
    """The messages that topics send within a short time; none if nobody publishes them."""
    if not names:
        return []
    from rosslt.cli.reading import listener  # with a node of its own, which other words do without

    with listener(*names) as stream:
        return [heard.message for heard in stream.during(_TIMEOUT)]


def _fields(type_: str, path: str) -> List[str]:
    """The names of the fields of a message type at a path, each with what may follow it."""
    for name in re.findall(r'/(\w+)', path):
        type_ = dict(_slots(type_)).get(name, '').partition('[')[0]
    return [name + ('[' if '[' in slot else '/' if '/' in slot else ' ') for name, slot in _slots(type_)]


def _slots(type_: str) -> List[Tuple[str, str]]:
    found = genpy.message.get_message_class(type_) if '/' in type_ else None
    if found is None:
        return []
    if messages.is_tracked_type(found):
        found = messages.plain_type(found)
    return list(zip(found.__slots__, found._slot_types))


def _as_typed(names: List[str], word: str) -> List[str]:
    """Full names, or names in the own namespace if the word does not begin with /."""
    if not word or word.startswith('/'):
        return names
    return [name[len(_namespace()) :] for name in names if name.startswith(_namespace())]


def _namespace() -> str:
    return full_name('x')[:-1]
