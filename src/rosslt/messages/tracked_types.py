"""Tracked message types: a provenance header beside the message (paper, section IV).

`PoseTracked` is `rosslt/Provenance provenance` and `geometry_msgs/Pose data`. They are generated in the build of a
package (see `msg_files`), or made here, at run time.
"""

import functools
import threading
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple, Union

import genmsg
import genmsg.msg_loader
import genpy.dynamic
import genpy.generator
import genpy.message

from rosslt.messages.codec import attach, encode
from rosslt.messages.errors import UnknownType
from rosslt.messages.fields import Message, MessageClass
from rosslt.messages.msg_files.definitions import (
    FIELDS,
    PROVENANCE,
    MessagePath,
    definition_of_tracked,
    long_name,
    short_name,
    split_type,
)
from rosslt.messages.numpy_arrays import packed_arrays

_SEPARATOR = '\n' + '=' * 80 + '\nMSG: '

_tracked: Dict[type, type] = {}
_names: Dict[str, Tuple[str, str]] = {}
# genpy's generator keeps its state in globals, too.
_lock = threading.Lock()


def is_tracked_type(cls: MessageClass) -> bool:
    """Return True for the class of a tracked message type."""
    types: Sequence[str] = getattr(cls, '_slot_types', ())
    return len(types) == 2 and types[0] == PROVENANCE and list(cls.__slots__) == FIELDS


@functools.lru_cache(maxsize=None)
def plain_type(tracked_class: MessageClass) -> Any:
    """The message class of a tracked type's data.

    Raises:
        TypeError: the class is not that of a tracked type.
    """
    if not is_tracked_type(tracked_class):
        raise TypeError('%s is no tracked message type' % getattr(tracked_class, '_type', tracked_class))
    return type(tracked_class().data)


def tracked_type(message_type: Union[str, type]) -> Any:
    """The tracked message class of a message type.

    A generated class is taken first: that of the package rosslt, of the message's own package, of the first other
    package (by name) in the workspaces and installed ones. If there is none, the class is made at run time; it has the
    name, the md5 and the bytes of the one that the package rosslt would have generated.

    Args:
        message_type: `'geometry_msgs/Pose'`, or a message class; a tracked one is returned as it is.

    Raises:
        UnknownType: there is no such message type, or no Python code for it.
        TypeError: what was given is neither a name nor a message class.
    """
    if isinstance(message_type, str):
        split_type(message_type)
        message_class = genpy.message.get_message_class(message_type)
        if message_class is None:
            raise UnknownType('found no Python class of %s: %s' % (message_type, _why_missing(message_type)))
    elif isinstance(message_type, type) and issubclass(message_type, genpy.Message):
        message_class = message_type
    else:
        raise TypeError('expected a message type, as geometry_msgs/Pose or its class, found %r' % (message_type,))
    if is_tracked_type(message_class):
        return message_class
    with _lock:
        if message_class not in _tracked:
            _tracked[message_class] = _generated(message_class) or _made(message_class)
        return _tracked[message_class]


def _why_missing(name: str) -> str:
    path = MessagePath().find(name)
    return 'it is defined in %s, but its package is not built, or installed without Python' % path


def _generated(message_class: MessageClass) -> Optional[type]:
    """The generated class, if a package has one for exactly that message."""
    name = message_class._type
    for candidate in _candidates(name):
        cls = genpy.message.get_message_class(candidate)
        if is_tracked_type(cls) and cls._slot_types[1] == name and plain_type(cls)._md5sum == message_class._md5sum:
            return cls
    return None


def _candidates(name: str) -> Iterator[str]:
    """The names that a generated type may have, the usual ones first: only they cost no search of the disk."""
    own, _ = split_type(name)
    for package in ('rosslt', own):
        yield '%s/%s' % (package, short_name(name))
    yield from sorted(MessagePath().tracked_types_of(name), key=lambda found: (not found.startswith(own + '/'), found))


def _made(message_class: MessageClass) -> type:
    """A tracked class made at run time."""
    name, md5sum = message_class._type, message_class._md5sum
    provenance = genpy.message.get_message_class(PROVENANCE)
    if provenance is None:
        raise UnknownType(
            'found no Python class of %s: the package rosslt is not built, or the setup.bash of its '
            'workspace was not sourced' % PROVENANCE
        )
    full_name = 'rosslt/' + short_name(name)
    if genpy.message.get_message_class(full_name) or _names.setdefault(full_name, (name, md5sum)) != (name, md5sum):
        full_name = 'rosslt/' + long_name(name)
    parts = message_class._full_text.split(_SEPARATOR)
    texts = {full_name: definition_of_tracked(name), PROVENANCE: provenance._full_text, name: parts[0]}
    for part in parts[1:]:
        dependency, _, text = part.partition('\n')
        texts[dependency.strip()] = text
    importable = genpy.message.get_message_class(name)
    if importable is None or importable._md5sum != md5sum:
        # for example a message of a bag: its definition, and those of messages in it, exist as text only
        full_text = _SEPARATOR.join([texts.pop(full_name)] + ['%s\n%s' % each for each in texts.items()])
        return genpy.dynamic.generate_dynamic(full_name, full_text)[full_name]
    return _compiled(full_name, texts)


def _compiled(full_name: str, texts: Dict[str, str]) -> type:
    """Compile the class that genpy generates for a definition; its fields use classes that exist already."""
    context = genmsg.MsgContext.create_default()
    specs = {name: genmsg.msg_loader.load_msg_from_string(context, text, name) for name, text in texts.items()}
    lines: List[str] = list(genpy.generator.msg_generator(context, specs[full_name], {}))
    namespace: Dict[str, Any] = {'__name__': 'rosslt.msg'}
    exec(compile('\n'.join(lines), '<%s, made at run time>' % full_name, 'exec'), namespace)
    return namespace[specs[full_name].short_name]


def wrap(message: Message, tracked_class: MessageClass, provenance: Optional[bytes] = None) -> Message:
    """A tracked message that holds an ordinary one and the provenance of its tracked leaves.

    Args:
        message: an ordinary message; it is not copied.
        tracked_class: the tracked class of the message's type.
        provenance: as `encode` gave it; by default it is encoded now.

    Raises:
        TypeError: the message is of another type.
    """
    tracked: Message = tracked_class()
    if message._md5sum != plain_type(tracked_class)._md5sum:
        raise TypeError(
            'expected a message of type %s for %s, found one of type %s'
            % (tracked._slot_types[1], tracked._type, message._type)
        )
    tracked.provenance.data = encode(message) if provenance is None else provenance
    tracked.data = message
    return packed_arrays(tracked_class)(tracked)


def unwrap(tracked_message: Message) -> Message:
    """The ordinary message of a tracked one, with the provenance on its leaves.

    Raises:
        BadHeader: the provenance is not right; the message is as it was, untracked.
    """
    message = tracked_message.data
    attach(message, tracked_message.provenance.data)
    return message
