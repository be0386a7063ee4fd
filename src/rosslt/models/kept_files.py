"""Files of what was learned of nodes: one for each node and program.

A file is JSON. Somebody may have written it by hand or damaged it, so all of it is checked when it is read.
"""

import contextlib
import hashlib
import json
import math
import os
import re
import reprlib
import tempfile
from dataclasses import asdict
from typing import Any, Callable, Dict, List, NoReturn, Optional, Sequence, Tuple

from rosslt import files
from rosslt.models.kept import File, Kept, Version
from rosslt.models.learned import Dependency, Learned
from rosslt.models.learning import Answer
from rosslt.models.profiles import COUPLED, DISCONTINUOUS, KINKED, SATURATED, SMOOTH, STEPPED, UNSETTLED
from rosslt.models.replays import Number

#: The layout of the files. One with another number is not read.
LAYOUT = 1

#: The most bytes of a file that is read: thousands of dependencies have less than a hundredth.
LARGEST = 2**26

#: The kinds of dependencies that have a slope, and all.
WITH_SLOPE = (SMOOTH, COUPLED)
KINDS = (*WITH_SLOPE, KINKED, SATURATED, STEPPED, DISCONTINUOUS, UNSETTLED)

_Check = Callable[[Any, str], Any]
"""Gives a part of a file as it is in memory, or raises `_Wrong`; takes the part, and where it is."""


class BadFile(Exception):
    """A file does not hold what was learned of a node; the text names it, and what is wrong."""


class _Wrong(Exception):
    """What is wrong in a file."""


def _file_name(version: Version) -> str:
    digests = ''.join(file.digest for file in version.program)
    return f'{_base(version.node)}-{hashlib.sha256(digests.encode()).hexdigest()[:16]}.json'


def _base(node: str) -> str:
    return re.sub(r'[^\w.]', '_', node.strip('/').replace('/', '.'), flags=re.ASCII)


def keep(folder: str, kept: Kept) -> str:
    """Write what was learned, in place of what was learned of this node with this program.

    Args:
        folder: is made if it is missing.
        kept: what was learned.

    Returns:
        the path of the file.

    Raises:
        OSError: it cannot be written.
    """
    os.makedirs(folder, exist_ok=True)
    path = os.path.join(folder, _file_name(kept.version))
    handle, temporary = tempfile.mkstemp(dir=folder)
    try:
        with os.fdopen(handle, 'w', encoding='utf-8') as file:
            json.dump(_as_json(kept), file, indent=1, allow_nan=False)
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise
    return path


def kept_of(folder: str, node: str, now: Optional[Version] = None) -> Optional[Kept]:
    """Read what was learned of a node with the program that it runs now, else what was learned of it last.

    Args:
        folder: where files are kept.
        node: its full name.
        now: the node that runs; None if it is not known.

    Returns:
        None if nothing was learned of it.

    Raises:
        BadFile: a file of the node is none.
    """
    own = os.path.join(folder, _file_name(now)) if now else ''
    paths = [own] if os.path.exists(own) else kept_files(folder, re.escape(_base(node)))
    found = [kept for kept in map(read_kept, paths) if kept.version.node == node]
    return max(found, key=lambda kept: kept.when) if found else None


def kept_files(folder: str, base: str = r'[\w.]+') -> List[str]:
    """The files of all nodes, or of those of which a pattern matches the beginning of the name."""
    pattern = re.compile(base + r'-[0-9a-f]{16}\.json', re.ASCII)
    try:
        return sorted(os.path.join(folder, name) for name in os.listdir(folder) if pattern.fullmatch(name))
    except FileNotFoundError:
        return []


def read_kept(path: str) -> Kept:
    """Read a file.

    Raises:
        BadFile: it cannot be read, or does not hold what was learned of a node.
    """
    try:
        if os.path.getsize(path) > LARGEST:
            raise _Wrong(f'it has more than {LARGEST} bytes')
        found = json.loads(files.read_bytes(path).decode('utf-8'), parse_constant=_refuse)
        if not isinstance(found, dict) or 'layout' not in found:
            raise _Wrong('it has no layout')
        if type(found['layout']) is not int or found['layout'] != LAYOUT:
            raise _Wrong(f'its layout is {reprlib.repr(found["layout"])}, and {LAYOUT} is read')
        del found['layout']
        kept: Kept = _KEPT(found, 'it')
    except OSError as error:
        raise BadFile(f'{path} cannot be read: {error.strerror}') from None
    except files.FileError as error:
        raise BadFile(str(error)) from None
    except RecursionError:
        raise BadFile(_about(path, 'it is nested too deeply')) from None
    except (_Wrong, ValueError) as error:
        raise BadFile(_about(path, str(error))) from None
    return kept


def _about(path: str, wrong: str) -> str:
    return f'{path} is not what `rosslt learn` has written: {wrong}; remove it, and learn the node again'


def _refuse(text: str) -> NoReturn:
    raise _Wrong(f'{text} is no number of JSON')


def _as_json(kept: Kept) -> Dict[str, Any]:
    version = {**kept.version._asdict(), 'program': [file._asdict() for file in kept.version.program]}
    return {'layout': LAYOUT, 'version': version, 'when': kept.when, 'answers': [_answer(a) for a in kept.answers]}


def _answer(answer: Answer) -> Dict[str, Any]:
    numbers = {
        name: [{**one._asdict(), 'thing': _plain_thing(one.thing)} for one in getattr(answer, name)]
        for name in ('inputs', 'outputs')
    }
    learned = {name: _finite(value) for name, value in asdict(answer.learned).items()}
    return {**answer._asdict(), **numbers, 'at': _finite(answer.at), 'learned': learned}


def _finite(part: Any) -> Any:
    """A part with None in place of numbers that JSON does not have."""
    if isinstance(part, dict):
        return {name: _finite(one) for name, one in part.items()}
    if isinstance(part, (list, tuple)):
        return [_finite(one) for one in part]
    return None if isinstance(part, float) and not math.isfinite(part) else part


def _plain_thing(thing: Any) -> Any:
    if isinstance(thing, tuple):
        return [_plain_thing(one) for one in thing]
    return thing if isinstance(thing, (str, int)) or thing is None else repr(thing)


# Checks


def _need(is_right: bool, where: str, what: str, value: Any) -> None:
    if not is_right:
        raise _Wrong(f'{where} is not {what}, but {reprlib.repr(value)}')


def _text(value: Any, where: str) -> str:
    _need(type(value) is str, where, 'a text', value)
    return str(value)


def _printable(value: Any, where: str) -> str:
    _need(type(value) is str and value.isprintable(), where, 'a text that can be printed', value)
    return str(value)


def _name(value: Any, where: str) -> str:
    _need(_printable(value, where).startswith('/'), where, 'a full name', value)
    return str(value)


def _digest(value: Any, where: str) -> str:
    _need(re.fullmatch('[0-9a-f]{64}', _text(value, where)) is not None, where, 'a SHA-256', value)
    return str(value)


def _kind(value: Any, where: str) -> str:
    _need(value in KINDS, where, f'one of {", ".join(KINDS)}', value)
    return str(value)


def _truth(value: Any, where: str) -> bool:
    _need(type(value) is bool, where, 'true or false', value)
    return bool(value)


def _count(value: Any, where: str) -> int:
    _need(_whole(value, where) >= 0, where, 'a count', value)
    return int(value)


def _whole(value: Any, where: str) -> int:
    _need(type(value) is int and abs(value) < 2**63, where, 'a whole number', value)
    return int(value)


def _number(value: Any, where: str) -> float:
    is_number = type(value) in (int, float) and abs(value) < 2**1023
    _need(is_number, where, 'a finite number', value)
    return float(value)


def _positive(value: Any, where: str) -> float:
    _need(_number(value, where) >= 0, where, 'a number from 0 on', value)
    return float(value)


def _or_nan(check: _Check) -> _Check:
    return lambda value, where: math.nan if value is None else check(value, where)


def _thing(value: Any, where: str) -> Any:
    if isinstance(value, list):
        return tuple(_thing(one, where) for one in value)
    _need(value is None or isinstance(value, (str, int)), where, 'a text or a whole number', value)
    return value


def _many(check: _Check) -> _Check:
    def checked(value: Any, where: str) -> Tuple[Any, ...]:
        _need(isinstance(value, list), where, 'a list', value)
        return tuple(check(one, f'[{index}] of {where}') for index, one in enumerate(value))

    return checked


def _named(check: _Check) -> _Check:
    def checked(value: Any, where: str) -> Dict[str, Any]:
        _need(isinstance(value, dict), where, 'an object', value)
        return {name: check(one, f'{reprlib.repr(name)} of {where}') for name, one in value.items()}

    return checked


def _record(make: Callable[..., Any], **checks: _Check) -> _Check:
    def checked(value: Any, where: str) -> Any:
        names = sorted(value) if isinstance(value, dict) else value
        _need(names == sorted(checks), where, f'an object with {", ".join(sorted(checks))}', names)
        return make(**{name: check(value[name], f'{name} of {where}') for name, check in checks.items()})

    return checked


def _fitting(check: _Check) -> _Check:
    """Check an Answer as a whole, too."""

    def checked(value: Any, where: str) -> Answer:
        answer: Answer = check(value, where)
        learned, inputs, outputs = answer.learned, len(answer.inputs), len(answer.outputs)
        indices: Sequence[Tuple[str, int, Sequence[int]]] = (
            ('output', outputs, [one.output for one in learned.dependencies]),
            ('input', inputs, [one.input for one in learned.dependencies]),
            ('unrepeatable', outputs, learned.unrepeatable),
            ('unanswered', inputs, learned.unanswered),
            ('untried', inputs, learned.untried),
        )
        for name, count, found in indices:
            _need(max(found, default=-1) < count, f'{name} of {where}', f'below {count}', max(found, default=-1))
        _need(len(answer.at) == inputs, f'at of {where}', f'a list of {inputs}', answer.at)
        _need(len(learned.noise) == outputs, f'noise of {where}', f'a list of {outputs}', learned.noise)
        for one in learned.dependencies:
            has_slope = not math.isnan(one.slope)
            _need(has_slope == (one.kind in WITH_SLOPE), f'slope of {where}', f'one of {one.kind}', one.slope)
            _need(one.low <= 0 <= one.high, f'low or high of {where}', 'around 0', (one.low, one.high))
        return answer

    return checked


_NUMBERS = _many(_record(Number, topic=_name, thing=_thing, path=_printable))
_INDICES = _many(_count)
_DEPENDENCY = _record(
    Dependency,
    output=_count,
    input=_count,
    kind=_kind,
    slope=_or_nan(_number),
    uncertainty=_or_nan(_positive),
    left=_or_nan(_number),
    right=_or_nan(_number),
    low=_number,
    high=_number,
)
_LEARNED = _record(
    Learned,
    dependencies=_many(_DEPENDENCY),
    noise=_many(_or_nan(_positive)),
    unrepeatable=_INDICES,
    unanswered=_INDICES,
    untried=_INDICES,
    tolerance=_positive,
    trials=_count,
)
_ANSWER = _record(
    Answer,
    inputs=_NUMBERS,
    outputs=_NUMBERS,
    at=_many(_or_nan(_number)),
    late=_positive,
    settled=_positive,
    learned=_LEARNED,
    is_isolated=_truth,
    asked=_many(_text),
)
_VERSION = _record(
    Version,
    node=_name,
    program=_many(_record(File, path=_text, size=_count, mtime=_whole, digest=_digest)),
    arguments=_many(_text),
    parameters=_named(_text),
    asked=_named(_text),
    types=_named(_text),
)
_KEPT = _record(Kept, version=_VERSION, when=_positive, answers=_many(_fitting(_ANSWER)))
