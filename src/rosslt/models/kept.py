"""What was learned of a node, and whether it is still true of the node that runs now."""

import hashlib
import json
import os
from typing import Any, Dict, Iterable, Iterator, Mapping, NamedTuple, Tuple

import roslib.message

from rosslt.models.learning import Answer
from rosslt.models.processes import LiveProcess, NotCopied
from rosslt.models.replays import inputs_and_outputs


class File(NamedTuple):
    """A file of a node's program.

    Attributes:
        path: where it is.
        size: in bytes.
        mtime: the time of its last change, in nanoseconds since 1970.
        digest: the SHA-256 of its content.
    """

    path: str
    size: int
    mtime: int
    digest: str


class Version(NamedTuple):
    """What a node computes by, as far as it can be seen.

    Attributes:
        node: its full name.
        program: its executable, and each file among its arguments, as the script of an interpreter is.
        arguments: those without private parameters, and without what only ROS reads.
        parameters: {full name: value as JSON} of its private parameters.
        asked: the same of others that it asks for, '' of one that is not set.
        types: {topic: type and MD5 sum} of what it hears and sends.
    """

    node: str
    program: Tuple[File, ...]
    arguments: Tuple[str, ...]
    parameters: Mapping[str, str]
    asked: Mapping[str, str]
    types: Mapping[str, str]


class Kept(NamedTuple):
    """What was learned of a node.

    Attributes:
        version: the node, as it was learned.
        when: the seconds since 1970.
        answers: what `learn_node` gave.
    """

    version: Version
    when: float
    answers: Tuple[Answer, ...]

    def why_stale(self, now: Version, tree: Mapping[str, Any]) -> str:
        """Say why it need not be true of a node.

        Args:
            now: the node that runs.
            tree: all parameters, as the master's `getParam('/')` gives them.

        Returns:
            a part of a sentence; '' if nothing speaks against it.
        """
        old, found = self.version, []
        if [file.digest for file in now.program] != [file.digest for file in old.program]:
            paths = [' '.join(repr(file.path) for file in version.program) for version in (old, now)]
            changed = [repr(new.path) for new, one in zip(now.program, old.program) if new.digest != one.digest]
            is_same = paths[0] == paths[1]
            found += (
                [f'{path} has changed since' for path in changed]
                if is_same
                else [f'it runs {paths[1]} in place of {paths[0]}']
            )
        elif now.arguments != old.arguments:
            found.append('it was started with other arguments')
        for what, before, after in (
            ('another value of the parameter', old.parameters, now.parameters),
            ('another value of the parameter', old.asked, _values_of(old.asked, tree)),
            ('another type of messages on', old.types, now.types),
        ):
            names = sorted(name for name in {*before, *after} if before.get(name) != after.get(name))
            found += [f'it has {what} {name if name.isprintable() else repr(name)}' for name in names]
        return '; '.join(found)


def version_of(process: LiveProcess, tree: Mapping[str, Any], asked: Iterable[str] = ()) -> Version:
    """Look at the node that runs now.

    Args:
        process: the node's.
        tree: all parameters, as the master's `getParam('/')` gives them.
        asked: the full names of the parameters that its twin has asked for; private ones are looked at in any case.

    Raises:
        NotCopied: it has ended, or does not let its program be read.
    """
    try:
        program = [_file(process.executable, f'/proc/{process.pid}/exe')]
        for argument in process.arguments[1:]:
            path = os.path.join(process.directory, argument)
            if os.path.isfile(path):
                program.append(_file(path, path))
    except OSError as error:
        raise NotCopied(f'the program of {process.node} cannot be read: {error}') from None
    topics = {name: type_ for part in inputs_and_outputs(process) for name, type_ in part.items()}
    return Version(
        process.node,
        tuple(program),
        tuple(one for one in process.arguments[1:] if not (one.startswith('_') and ':=' in one)),
        dict(_private(process.node, tree)),
        _values_of((name for name in asked if not f'{name}/'.startswith(f'{process.node}/')), tree),
        {name: f'{type_} {_md5sum(type_)}'.rstrip() for name, type_ in topics.items()},
    )


def _file(path: str, content: str) -> File:
    digest = hashlib.sha256()
    with open(content, 'rb') as file:
        about = os.fstat(file.fileno())
        for part in iter(lambda: file.read(2**20), b''):
            digest.update(part)
    return File(path, about.st_size, about.st_mtime_ns, digest.hexdigest())


def _private(node: str, tree: Any) -> Iterator[Tuple[str, str]]:
    private = _part(tree, node)
    left = [(node, private)] if isinstance(private, dict) else []
    while left:
        path, part = left.pop()
        if isinstance(part, dict):
            left += [(f'{path}/{name}', one) for name, one in part.items()]
        else:
            yield path, _as_text(part)


def _values_of(names: Iterable[str], tree: Any) -> Dict[str, str]:
    return {name: _as_text(_part(tree, name)) for name in names}


def _part(tree: Any, name: str) -> Any:
    """A parameter, or the dict of those below a name; None if there is none."""
    part = tree
    for step in filter(None, name.split('/')):
        part = part.get(step) if isinstance(part, dict) else None
    return part


def _as_text(value: Any) -> str:
    """A parameter as JSON; '' if it is not set."""
    return '' if value is None else json.dumps(value, sort_keys=True, default=str)


def _md5sum(type_: str) -> str:
    known = roslib.message.get_message_class(type_)
    return known._md5sum if known else ''
