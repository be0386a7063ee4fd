"""Fields of messages, as people write them: `pose/position/x`, `points[3].x`; and targets for them."""

import copy
import re

import yaml

from rosslt import values
from rosslt.cli.failure import Failure
from rosslt.cli.scalars import scalar


def field_of(message, path):
    """The part of a message at a path, the message itself at ''.

    Raises:
        Failure: there is no such part.
    """
    part, walked = message, ''
    for step in steps(path):
        try:
            part = part[step] if isinstance(step, int) else _attribute(part, step)
        except (TypeError, IndexError, AttributeError):
            raise Failure(_missing(part, step, walked)) from None
        walked += f'[{step}]' if isinstance(step, int) else f'.{step}' if walked else step
    return part


def steps(path):
    """The steps of a path: names and indices.

    Raises:
        Failure: it is no path.
    """
    found = re.findall(r'(\w+)|\[(\d+)\]', path)
    if re.sub(r'\w+|\[\d+\]|[./]', '', path):
        raise Failure(f'{path!r} is no field: give names with / or . between, and [INDEX] for an array')
    return [int(index) if index else name for name, index in found]


def joined(path, leaf):
    """The path of a leaf in a part that is itself at a path, as `values.leaves` writes paths."""
    whole = ''.join(f'[{step}]' if isinstance(step, int) else f'.{step}' for step in steps(path))
    return (whole + (leaf if leaf.startswith('[') or not leaf else '.' + leaf)).lstrip('.')


def target(part, text):
    """What a part of a message shall become, for `values.solve`.

    Args:
        part: a scalar, a message or an array of them.
        text: a scalar as `rosslt set` takes it; for anything else YAML, `{x: 1.0, y: 2.0}`. What is not mentioned may
            become anything.

    Raises:
        Failure: the text does not fit.
    """
    plain = values.untracked(part)
    if isinstance(plain, (bool, int, float, str)):
        try:
            return scalar(text, type(plain).__name__)
        except ValueError as error:
            raise Failure(str(error)) from None
    try:
        return _shaped(part, yaml.safe_load(text), 'the value')
    except yaml.YAMLError as error:
        raise Failure(f'{text!r} is no YAML: ' + ' '.join(str(error).split())) from None


def _shaped(part, wanted, where):
    if wanted is None:
        return None
    if hasattr(part, '_slot_types'):
        if not isinstance(wanted, dict):
            raise Failure(f'{where} must be given as {{FIELD: VALUE, ...}}, found {wanted!r}')
        unknown = [name for name in wanted if name not in part.__slots__]
        if unknown:
            raise Failure(_missing(part, unknown[0], where))
        shaped = copy.copy(part)
        for name in part.__slots__:
            setattr(shaped, name, _shaped(getattr(part, name), wanted.get(name), f'{name} of {where}'))
        return shaped
    if isinstance(part, (list, tuple)):
        if not isinstance(wanted, list) or len(wanted) != len(part):
            raise Failure(f'{where} must be given as a list of {len(part)}, found {wanted!r}')
        return [_shaped(each, value, f'[{index}] of {where}') for index, (each, value) in enumerate(zip(part, wanted))]
    if not isinstance(wanted, (bool, int, float, str)):
        raise Failure(f'{where} must be given as a scalar, found {wanted!r}')
    try:
        return scalar(str(wanted), type(values.untracked(part)).__name__)
    except (KeyError, ValueError) as error:
        raise Failure(f'{where}: {error}') from None


def _attribute(part, name):
    if name not in getattr(part, '__slots__', ()):
        raise AttributeError(name)
    return getattr(part, name)


def _missing(part, step, where):
    if hasattr(part, '_slot_types'):
        return '{} has no field {!r}, its fields are {}'.format(part._type, step, ', '.join(part.__slots__))
    if isinstance(part, (list, tuple)):
        return f'{where} has {len(part)} elements: give [INDEX], found {step!r}'
    return f'{where} is {values.untracked(part)!r}, which has no part {step!r}'
