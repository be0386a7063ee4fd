"""The numbers of robots (URDF) that a launch file loads from a file into a parameter: they are locations, and the nodes
that read the text at their start are started again when it has changed."""

from typing import Any, Callable, Dict, Iterable, Iterator, List, Mapping, NamedTuple, Sequence, Tuple

from rosgraph.names import namespace, ns_join

from rosslt import files, node
from rosslt.instrument.launched_nodes import LaunchedNode, Taken, say
from rosslt.messages import Scalar

#: {type of a node that reads a robot at its start: what of its joints it reads}.
_READERS = {
    'robot_state_publisher': ('xyz', 'rpy'),
    'state_publisher': ('xyz', 'rpy'),
    'joint_state_publisher': ('limit',),
    'joint_state_publisher_gui': ('limit',),
}

#: Those of them that look for it below their own name first.
_PRIVATE_FIRST = ('joint_state_publisher', 'joint_state_publisher_gui')


class RobotText(NamedTuple):
    """A parameter that a robot's file gives.

    Attributes:
        name: its full name.
        file: the URDF.
        content: of the file.
    """

    name: str
    file: str
    content: bytes


def robots_in(parameters: Mapping[str, Any], origins: Mapping[str, Mapping[str, Any]]) -> Iterator[RobotText]:
    """The parameters of a launch file that are robots, and whose numbers are those of a file; of others, it is said why
    not.

    Args:
        parameters: {full name: roslaunch's Param}.
        origins: where the launch file gives them.
    """
    for name, origin in origins.items():
        text = parameters[name].value if name in parameters and 'text_of' in origin else None
        if not isinstance(text, str) or '<robot' not in text:
            continue
        file = origin['text_of']
        try:
            if not file:
                raise ValueError('its command is no `cat FILE` or `xacro FILE`')
            content = files.read_bytes(file)
            given = _numbers_in(text.encode('utf-8'))
            if _numbers_in(content) != given:
                raise ValueError(f'{file} does not say the same numbers')
        except (files.FileError, ValueError) as error:
            say(f'the numbers of {name} cannot be changed: {error}')
        else:
            yield RobotText(name, file, content)


def _numbers_in(content: bytes) -> Dict[str, float]:
    return {one.name: one.value for one in files.urdf_numbers(content)}


def is_reader(one: Any, name: str, parameters: Mapping[str, Any]) -> bool:
    """Return whether a node reads a robot at its start.

    Args:
        one: roslaunch's.
        name: the full name of the parameter.
        parameters: those of the launch file, by their full names.
    """
    if one.type not in _READERS:
        return False
    remapped = (to for before, to in one.remap_args if before.rpartition('/')[2] == node.ROBOT_DESCRIPTION)
    asked = next(remapped, node.ROBOT_DESCRIPTION)
    if asked.startswith('/'):
        return asked == name
    within = ns_join(one.namespace, one.name) + '/' if one.type in _PRIVATE_FIRST else one.namespace
    while ns_join(within, asked) not in parameters and within != '/':
        within = namespace(within)
    return ns_join(within, asked) == name


def with_publishers(
    origins: Mapping[str, Dict[str, Any]], nodes: Sequence[Any], parameters: Mapping[str, Any]
) -> Dict[str, Dict[str, Any]]:
    """Where a launch file gives parameters; of those that are texts of files also who sends the frames of a robot in
    them.

    Args:
        origins: where they are given, by their full names.
        nodes: those that run here, of roslaunch.
        parameters: those of the launch file, by their full names.
    """
    found = dict(origins)
    for name, origin in origins.items():
        if 'text_of' in origin:
            readers = [one for one in nodes if 'xyz' in _READERS.get(one.type, ()) and is_reader(one, name, parameters)]
            found[name] = {**origin, 'publishers': [ns_join(one.namespace, one.name) for one in readers]}
    return found


class LaunchedRobot:
    """A robot in a parameter, as the nodes of a launch file read it.

    Args:
        name: the full name of the parameter.
        readers: those that read it at their start, each with its type.
        restarts: whether they may be started again.
    """

    def __init__(self, name: str, readers: Sequence[Tuple[LaunchedNode, str]], restarts: bool) -> None:
        self.name, self._readers, self._restarts = name, readers, restarts
        self._taken = Taken()

    def _readers_of(self, numbers: Iterable[str]) -> List[LaunchedNode]:
        """Those that read one of some numbers."""
        parts = {self._within(name).split('/')[1] for name in numbers}
        return [reader for reader, kind in self._readers if parts.intersection(_READERS[kind])]

    def _within(self, name: str) -> str:
        return name[len(self.name) + 1 :]

    def effect(self, name: str) -> str:
        readers = self._readers_of([name])
        if not readers:
            return f'takes effect as nodes, or RViz, read {self.name} again'
        if not self._restarts:
            return f'is refused: {readers[0].why_not()}'
        told = ' and '.join(one.name for one in readers)
        ended = next(filter(None, (one.effect_of_start() for one in readers)), '')
        return ended or f'takes effect as `rosslt launch` starts {told} again'

    def take(self, location: node.Location, value: Scalar) -> None:
        readers = self._readers_of([location.name])
        if readers and not self._restarts:
            raise ValueError(readers[0].why_not())
        self._taken.add(location, value)

    def changed(self) -> None:
        taken = self._taken.in_force()
        said = ', '.join(f'{self._within(one.name)} is {one.value!r}' for one in taken)
        for reader in self._readers_of(one.name for one in taken):
            reader.start_for(said)


def sites_of(robot: RobotText) -> Callable[[str], node.CallSite]:
    """A function that says of the full name of a number where the file says it."""
    found: Dict[str, node.CallSite] = {}
    line = begin = last = 0
    for one in files.urdf_numbers(robot.content):
        line += robot.content.count(b'\n', last, one.start)
        begin = max(begin, robot.content.rfind(b'\n', last, one.start) + 1)
        last = one.start
        found[f'{robot.name}/{one.name}'] = node.CallSite(robot.file, line + 1, one.start - begin + 1, '')
    top = node.CallSite(robot.file, 1, 1, '')  # of numbers that somebody else has set
    return lambda name: found.get(name, top)
