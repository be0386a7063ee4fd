"""Fields and values as people write them: `pose/position/x`, `points[3].x`, `1.5`, `{x: 1.0}`."""

import copy
import math
from typing import Dict, Iterable, List, Optional, Set, Union

import yaml

from rosslt import messages, values
from rosslt.cli.failure import Failure, did_you_mean
from rosslt.messages import Message, Scalar


def field_of(message: Message, path: str) -> Message:
    """The part of a message at a path, the message itself at ''.

    Raises:
        Failure: there is no such part.
    """
    try:
        return messages.part_at(message, path)[0]
    except messages.NoSuchPart as missing:
        raise Failure(_missing(missing.part, missing.step, missing.where)) from None
    except ValueError as error:
        raise Failure(str(error)) from None


def steps(path: str) -> List[Union[str, int]]:
    """The steps of a path: names and indices.

    Raises:
        Failure: it is not a path.
    """
    try:
        return messages.path_steps(path)
    except ValueError as error:
        raise Failure(str(error)) from None


def conditions(text: str) -> Dict[str, str]:
    """The conditions that `ns=base,id=3` writes, {field: value}.

    Raises:
        Failure: one is malformed.
    """
    found = [part.partition('=') for part in text.split(',') if part]
    for name, equals, _ in found:
        if not (name and equals):
            raise Failure(f'--where takes FIELD=VALUE, several with a comma between, found {text!r}')
    return {name: value for name, _, value in found}


def path_where(message: Message, path: str, wanted: Dict[str, str]) -> Optional[str]:
    """The path of a field in the thing of a message that meets conditions; None if the message has no such thing.

    A thing is the message itself, or an element of the first array that the path gives without an index, or with one,
    if it has the fields of the conditions. If the condition is about a list of names, it is the element of the field at
    the same index: `name=elbow` of a JointState.

    Args:
        path: the path of the field.
        wanted: {field of the thing: its value as a text}.

    Raises:
        Failure: there is no such field.
    """
    walked: List[Union[str, int]] = []
    for step in steps(path):
        part = field_of(message, _path(walked))
        if isinstance(part, (list, tuple)) and not isinstance(step, int) and wanted:
            index = next((index for index, one in enumerate(part) if _meets(one, wanted)), None)
            if index is None:
                return None
            walked.append(index)
            wanted = {}
        elif isinstance(part, (list, tuple)) and not isinstance(step, int):
            raise Failure(_missing(part, step, _path(walked)) + '; or say which with --where FIELD=VALUE')
        walked.append(step)
        if isinstance(step, int) and wanted and _has_fields(field_of(message, _path(walked)), wanted):
            if not _meets(field_of(message, _path(walked)), wanted):
                return None
            wanted = {}
    for name, text in list(wanted.items()):
        names = field_of(message, name)
        if isinstance(names, (list, tuple)):
            if text not in map(str, names):
                return None
            walked.append(list(map(str, names)).index(text))
            del wanted[name]
    field_of(message, _path(walked))
    return _path(walked) if _meets(message, wanted) else None


def values_where(message: Message, path: str, name: str) -> List[Scalar]:
    """Collect the plain values that the things of a message, as of `path_where`, have in the field of a condition.

    Args:
        path: the path of the field that is asked for, as of `path_where`.
        name: the field of the condition.

    Raises:
        Failure: there is no such field.
    """
    things = [message]
    walked: List[Union[str, int]] = []
    for step in steps(path):
        part = field_of(message, _path(walked))
        if isinstance(part, (list, tuple)):
            things += part
            if not isinstance(step, int):
                break
        walked.append(step)
    found = [values.untracked(field_of(thing, name)) for thing in things if _has_fields(thing, [name])]
    return [one for value in found for one in (value if isinstance(value, (list, tuple)) else [value])]


def _path(walked: List[Union[str, int]]) -> str:
    return ''.join(f'[{step}]' if isinstance(step, int) else f'.{step}' for step in walked).lstrip('.')


def _has_fields(part: Message, names: Iterable[str]) -> bool:
    try:
        return all(messages.part_at(part, name) for name in names)
    except messages.NoSuchPart:
        return False


def _meets(part: Message, wanted: Dict[str, str]) -> bool:
    return all(_is_written(values.untracked(field_of(part, name)), text) for name, text in wanted.items())


def meant_where(wanted: Dict[str, str], seen: Dict[str, Set[Scalar]]) -> str:
    """Suggest values for conditions that no thing meets, as `did_you_mean` does.

    Args:
        wanted: the conditions, {field: value as a text}.
        seen: {field: the values that things have in it}.
    """
    return ''.join(
        did_you_mean(text, [value for value in seen.get(name, ()) if isinstance(value, str)])
        for name, text in wanted.items()
        if not any(_is_written(value, text) for value in seen.get(name, ()))
    )


def _is_written(value: Scalar, text: str) -> bool:
    if type(value) not in (float, int):
        return str(value) == text
    try:
        return float(text) == value
    except ValueError:
        return False


def joined(path: str, leaf: str) -> str:
    """The path of a leaf in a part that is itself at a path, as `values.leaves` writes paths."""
    return (_path(steps(path)) + (leaf if leaf.startswith('[') or not leaf else '.' + leaf)).lstrip('.')


def target(message: Message, path: str, text: str) -> Message:
    """The target for a part of a message, as `values.solve` takes it.

    Args:
        message: the message.
        path: the path of the part: a scalar, a message or an array of them.
        text: a scalar as `rosslt set` takes it; for anything else YAML, `{x: 1.0, y: 2.0}`. Fields that it does not
            mention may become anything.

    Raises:
        Failure: the text does not fit.
    """
    part, type_ = messages.part_at(message, path)
    plain = values.untracked(part)
    try:
        if isinstance(plain, (bool, int, float, str)):
            wanted: Message = parse_scalar(text, type(plain).__name__)
        else:
            wanted = _shaped(part, yaml.safe_load(text), 'the value')
        messages.check_range(part, type_, wanted)
    except yaml.YAMLError as error:
        raise Failure(f'{text!r} is no YAML: ' + ' '.join(str(error).split())) from None
    except ValueError as error:
        raise Failure(str(error)) from None
    return wanted


def parse_scalar(text: str, kind: str) -> Scalar:
    """A text as a value of a type.

    Raises:
        ValueError: it is not such a thing.
    """
    if kind == 'str':
        try:
            text.encode('utf-8')
        except UnicodeEncodeError:
            raise ValueError(f'{text!r} is not UTF-8') from None  # as bytes of a shell may be
        return text
    if kind == 'bool':
        if text.lower() not in ('true', 'false'):
            raise ValueError(f'{text!r} is neither true nor false')
        return text.lower() == 'true'
    number = {'float': float, 'int': int}[kind]
    try:
        value = number(text)
    except ValueError:
        article = 'an' if kind == 'int' else 'a'
        raise ValueError(f'{text!r} is not {article} {kind}') from None
    if value - value != 0:
        raise ValueError(f'{text!r} is not finite')
    return value


def parses_as_float(text: str) -> bool:
    """Return True if a text is a finite number."""
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def source_values(part: Message) -> Dict[values.Source, Scalar]:
    """The sources of a part of a message, in order of appearance, each with the value that the message has of it."""
    return values.source_values([leaf for _, leaf in values.leaves(part)])


def _shaped(part: Message, wanted: Message, where: str) -> Message:
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
    kind = type(values.untracked(part)).__name__
    if kind == 'bytes':
        raise Failure(f'{where} is an array of {len(part)} bytes without provenance: leave it out')
    if not isinstance(wanted, (bool, int, float, str)):
        raise Failure(f'{where} must be given as a scalar, found {wanted!r}')
    try:
        return parse_scalar(str(wanted), kind)
    except (KeyError, ValueError) as error:
        raise Failure(f'{where}: {error}') from None


def _missing(part: Message, step: Union[str, int], where: str) -> str:
    if hasattr(part, '_slot_types'):
        meant, type_ = did_you_mean(str(step), part.__slots__), getattr(part, '_type', type(part).__name__)
        return f'{type_} has no field {step!r}{meant}, its fields are ' + ', '.join(part.__slots__)
    if isinstance(part, (list, tuple)):
        found = f'[{step}]' if isinstance(step, int) else step
        return f'{where} has {len(part)} elements: give one of {where}[INDEX], found {found}'
    return f'{where} is {values.untracked(part)!r}, which has no part {step!r}'
