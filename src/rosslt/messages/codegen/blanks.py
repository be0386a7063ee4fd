"""Code that makes messages of a class, empty or with the parts of another one, in a small part of the time that genpy's
constructors take.

These go through the names of all fields, and ask of each time in a message whether it is made of whole numbers.
"""

import functools
from typing import Any, Callable, Dict


@functools.lru_cache(maxsize=None)
def blank(message_class: Any) -> Callable[[], Any]:
    """A function that makes what `message_class()` makes, compiled when first asked for."""
    constants: Dict[str, Any] = {'new': object.__new__}
    lines = ['def make():']

    def made(part: Any) -> str:
        """The expression for a part of a message; the lines before it make what is in it."""
        if isinstance(part, list):
            return '[%s]' % ', '.join(map(made, part))
        if not hasattr(part, '__slots__'):
            return repr(part)
        name = 'part_%d' % len(lines)
        constants['class_' + name] = type(part)
        lines.append(' %s = new(class_%s)' % (name, name))
        lines.extend([' %s.%s = %s' % (name, field, made(getattr(part, field))) for field in part.__slots__])
        return name

    lines.append(' return ' + made(message_class()))
    exec(compile('\n'.join(lines), '<blank %s>' % message_class._type, 'exec'), constants)
    return constants['make']


@functools.lru_cache(maxsize=None)
def copier(message_class: Any) -> Callable[[Any], Any]:
    """A function that makes a message with the very parts of another one, compiled when first asked for."""
    constants: Dict[str, Any] = {'new': object.__new__, 'message_class': message_class}
    lines = ['def copied(message):', ' made = new(message_class)']
    lines.extend([' made.%s = message.%s' % (field, field) for field in message_class.__slots__])
    exec(compile('\n'.join([*lines, ' return made']), '<copy of %s>' % message_class._type, 'exec'), constants)
    return constants['copied']
