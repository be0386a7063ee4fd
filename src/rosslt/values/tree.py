"""Messages, lists, dicts and arrays: finding the scalars in them, and copying them with others.

A message is anything with `__slots__` and `_slot_types`, as genpy's messages have; genpy is not imported.
"""

import copy
import operator
from typing import Callable, Iterator, List, Tuple

from .annotations import Value
from .operations import AFFINE, LAZY
from .tracked import SCALARS, TRACKED, resolve


def is_message(x: Value) -> bool:
    """Return True for a ROS message: it has fields in `__slots__` and their types in `_slot_types`."""
    return hasattr(x, '_slot_types') and hasattr(x, '__slots__') and not is_instant(x)


def is_instant(x: Value) -> bool:
    """Return True for a ROS time or duration: it has slots secs and nsecs and is not a message."""
    # rospy's times inherit the `_slot_types` of genpy's; only messages have a `_type`.
    return hasattr(x, 'secs') and hasattr(x, 'nsecs') and not hasattr(x, '_type')


def is_object_array(x: Value) -> bool:
    """Return True for a NumPy array of Python objects, which may hold tracked values."""
    return getattr(getattr(x, 'dtype', None), 'char', '') == 'O' and hasattr(x, 'tolist')


def is_tracked_array(x: Value) -> bool:
    """Return True for an array of numbers that know their provenance (`arrays.TrackedArray`)."""
    return getattr(x, 'has_provenance', None) is True


def parts(x: Value) -> Iterator[Tuple[str, Value]]:
    """The parts of a message, list, tuple, dict or object array, each with its step of the path."""
    if is_message(x):
        return (('.' + name, getattr(x, name)) for name in x.__slots__)
    if is_instant(x):
        return iter((('.secs', x.secs), ('.nsecs', x.nsecs)))
    if isinstance(x, dict):
        return (('[%r]' % (key,), part) for key, part in x.items())
    if isinstance(x, (list, tuple)) or is_object_array(x):
        return (('[%d]' % index, part) for index, part in enumerate(x))
    if is_tracked_array(x):
        return (('[%d]' % index, part) for index, part in enumerate(x.tolist())) if x.shape else iter([('', x.item())])
    return iter(())


def leaves(x: Value) -> List[Tuple[str, Value]]:
    """The scalars in `x`, flattened, in order, with their paths.

    Args:
        x: a value, message, list, tuple, dict or NumPy object array, nested as they may be.

    Returns:
        `[(path, scalar), ...]`; a path is `position.x`, `points[3].x`, `['gain']`, or '' for a scalar. A
        bytes (a `uint8[]` field) or an array of plain numbers counts as one leaf, as nothing in it is tracked.
    """
    return [('', x)] if type(x) in SCALARS else list(each_leaf(x))


def scalars(x: Value) -> List[Value]:
    """The scalars in `x` in the order in which `rebuilt` asks for others. An array makes its elements each time that
    they are read, and whether one of them is tracked may be known only the next time."""
    return [leaf for _, leaf in leaves(x) if type(leaf) in SCALARS]


def each_leaf(x: Value) -> Iterator[Tuple[str, Value]]:
    """Iterate over the leaves of `x` as `(path, scalar)` without collecting all of them first, unlike `leaves`."""
    waiting = [('', iter([('', x)]))]
    while waiting:
        path, inner = waiting[-1]
        for step, part in inner:
            where = path + step if path else step.lstrip('.')
            if type(part) in SCALARS:
                yield where, part
                continue
            is_whole = isinstance(part, (list, tuple, dict)) or is_message(part) or is_instant(part)
            if is_whole or ((is_object_array(part) or is_tracked_array(part)) and part.size):
                waiting.append((where, parts(part)))
                break
            yield where, part
        else:
            waiting.pop()


def rebuilt(x: Value, change: Callable[[Value], Value]) -> Value:
    """Copy `x` deeply, with `change(leaf)` instead of each scalar leaf.

    Args:
        x: as for `leaves`; a message keeps its class, and any other object is deep-copied.
        change: returns the new value for a scalar.
    """
    if type(x) in SCALARS:
        return change(x)
    if is_message(x) or is_instant(x):
        names = x.__slots__ if is_message(x) else ('secs', 'nsecs')
        result = copy.copy(x)
        for name in names:
            setattr(result, name, rebuilt(getattr(x, name), change))
        return result
    if isinstance(x, dict):
        return type(x)((key, rebuilt(part, change)) for key, part in x.items())
    if isinstance(x, (list, tuple)):
        items = [rebuilt(part, change) for part in x]
        return type(x)(*items) if hasattr(x, '_fields') else type(x)(items)
    if is_object_array(x):
        result = x.copy()
        for index, part in enumerate(x.flat):
            result.flat[index] = rebuilt(part, change)
        return result
    if is_tracked_array(x):
        return x.of(rebuilt(x.tolist(), change))
    return copy.deepcopy(x)


def copied(x: Value) -> Value:
    """A copy of a list, tuple, dict, message or array, nested as they may be, in which all other objects are the same;
    any other object itself."""
    if type(x) in SCALARS:
        return x
    if isinstance(x, tuple):
        items = [copied(part) for part in x]
        if all(map(operator.is_, items, x)):
            return x
        return type(x)(*items) if hasattr(x, '_fields') else type(x)(items)
    result: Value
    if isinstance(x, list):
        result = copy.copy(x)
        result[:] = [copied(part) for part in x]
    elif isinstance(x, dict):
        result = copy.copy(x)
        result.update((key, copied(part)) for key, part in x.items())
    elif is_message(x) or is_instant(x):
        result = copy.copy(x)
        for name in x.__slots__ if is_message(x) else ():
            setattr(result, name, copied(getattr(x, name)))
    else:
        return x.copy() if hasattr(x, 'dtype') and hasattr(x, 'tolist') else x
    return result


def is_tracked(x: Value) -> bool:
    """Return True if `x` has provenance: it is a tracked value or holds one."""
    return any(type(leaf) in TRACKED and _has_record(leaf) for _, leaf in leaves(x))


def _has_record(leaf: Value) -> bool:
    """Return False for an element of an array whose provenance is looked up in vain."""
    record = leaf._record
    if record[0] is LAZY and getattr(record[1], 'is_uncertain', False):
        record = resolve(leaf)
    return record[0] is not AFFINE or bool(record[1])


def untracked(x: Value) -> Value:
    """`x` without provenance: the plain value, or a deep copy of the message, list or dict with plain values."""
    return rebuilt(x, lambda leaf: leaf._plain if type(leaf) in TRACKED else leaf)


def paired(x: Value, target: Value) -> List[Tuple[str, Value, Value]]:
    """The leaves of `x` beside those of a target of the same shape: `[(path, leaf, target leaf), ...]`.

    Parts whose target is None are left out.

    Raises:
        ValueError: the shapes differ; the message names the path.
    """
    found = []
    stack = [('', x, target)]
    while stack:
        path, part, wanted = stack.pop()
        if wanted is None:
            continue
        if hasattr(wanted, 'tolist'):
            wanted = wanted.tolist()
        inner = [] if type(part) in SCALARS else list(parts(part))
        if not inner:
            found.append((path, part, wanted))
            continue
        others = dict(parts(wanted))
        if set(others) != {step for step, _ in inner}:
            raise ValueError('%s and its target differ in shape' % (path or 'the value'))
        stack.extend((path + step if path else step.lstrip('.'), one, others[step]) for step, one in reversed(inner))
    return found
