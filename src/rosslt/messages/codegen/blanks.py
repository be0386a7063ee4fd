"""Code that makes empty messages of a class in a small part of the time that genpy's constructors take.

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
