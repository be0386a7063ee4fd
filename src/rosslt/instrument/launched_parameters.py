"""Parameters of nodes of a launch file that run as they are: `rosslt launch` owns their locations, and starts such a
node again when a parameter has changed that it reads at its start."""

import contextlib
import math
import threading
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple

import rospy
from rosgraph.names import ns_join

from rosslt import files, msg, node
from rosslt.instrument.launched_nodes import LaunchedNode, say
from rosslt.instrument.launched_robots import LaunchedRobot, RobotText, is_reader, robots_in, sites_of

_Origins = Dict[str, Dict[str, Any]]


class LaunchedParameters:
    """The parameters of nodes that run as they are, and robots.

    Args:
        nodes: all nodes on this machine, of roslaunch.
        as_they_are: those that run as they are.
        parameters: {full name: roslaunch's Param} of all parameters of the launch file.
        origins: where it gives scalars and texts of files, by their full names.
        monitor: roslaunch's, once it has started the nodes.
        restarts: whether nodes may be started again.
    """

    def __init__(
        self,
        nodes: List[Any],
        as_they_are: List[Any],
        parameters: Mapping[str, Any],
        origins: _Origins,
        monitor: Any,
        restarts: bool,
    ) -> None:
        self._monitor, self._restarts = monitor, restarts
        self._nodes: Dict[str, LaunchedNode] = {}
        self._given: List[Tuple[LaunchedNode, str]] = []
        self._told = told = {name: origin for name, origin in origins.items() if _is_told(origin['said'])}
        for one in as_they_are:
            name = ns_join(one.namespace, one.name)
            own = [
                key for key in parameters if key.startswith(name + '/') and any(_is_in(key, scalar) for scalar in told)
            ]
            process = self._node(one) if own else None
            if process is not None:
                self._given += [(process, key) for key in own]
        self._robots: List[Tuple[LaunchedRobot, RobotText]] = []
        for robot in robots_in(parameters, origins):
            readers = [(self._node(one), one.type) for one in nodes if is_reader(one, robot.name, parameters)]
            running = [(reader, kind) for reader, kind in readers if reader is not None]
            self._robots.append((LaunchedRobot(robot.name, running, restarts), robot))
        if self._given or self._robots:
            # In a thread of its own, as rospy waits for the master, which ends if somebody ends the launch.
            threading.Thread(target=self._own, name='rosslt launch', daemon=True).start()

    def _node(self, one: Any) -> Optional[LaunchedNode]:
        """A node of roslaunch; None if it does not run here."""
        name = ns_join(one.namespace, one.name)
        process = self._monitor.get_process(one.process_name) if one.process_name else None
        if name not in self._nodes and process is not None:
            self._nodes[name] = LaunchedNode(name, process, self._monitor, self._restarts)
        return self._nodes.get(name)

    def _own(self) -> None:
        keys = [key for _, key in self._given]
        try:
            rospy.init_node(node.LAUNCH, anonymous=True, disable_rosout=True, disable_signals=True, argv=[])
            node.start()
            site = _sites({name: one for name, one in self._told.items() if any(_is_in(key, name) for key in keys)})
            for reader, key in self._given:
                node.own_parameter_of(reader, key, site)
            for robot, text in self._robots:
                node.own_parameter_of(robot, text.name, sites_of(text), is_robot=True)
        except (*node.NO_MASTER, rospy.ROSException) as error:
            if not self._monitor.is_shutdown:
                say(f'the parameters of nodes that run as they are cannot be changed: {error}')

    def end(self) -> None:
        """Wait until no node is being started."""
        for one in self._nodes.values():
            one.end()


def _is_told(said: Any) -> bool:
    """Return whether a scalar can be a location; None stands for the text of a file, such as a robot's description."""
    return said is not None and not (isinstance(said, float) and not math.isfinite(said))


def _is_in(key: str, name: str) -> bool:
    """Return whether a scalar is a parameter or in it."""
    return name == key or name.startswith(key + '/')


def _sites(origins: _Origins) -> Callable[[str], node.CallSite]:
    """A function that says of the full name of a parameter, or of a scalar in one, where the launch file or a YAML
    file gives it."""
    found: Dict[str, node.CallSite] = {}
    for file in {origin['file'] for origin in origins.values()}:
        given = [
            (node.Place('', msg.Location(id=number, name=name, value=node.to_json(origin['said']))), origin)
            for number, (name, origin) in enumerate(origins.items())
            if origin['file'] == file
        ]
        content, standing = b'', {}
        with contextlib.suppress(files.FileError):  # it has gone since
            content = files.read_bytes(file)
            standing = node.parameter_places(file, content, given)
        for place, _ in given:
            start = standing[place.source].start if place.source in standing else 0
            line = content.count(b'\n', 0, start) + 1
            column = start - (content.rfind(b'\n', 0, start) + 1) + 1
            found[place.location.name] = node.CallSite(file, line, column, '')

    def site(name: str) -> node.CallSite:
        while True:
            there = next((site for one, site in found.items() if _is_in(name, one)), None)
            if there is not None:
                return there
            name = name.rpartition('/')[0]  # somebody else has set it, as a further element of a list

    return site
