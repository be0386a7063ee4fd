"""Parameters of nodes of a launch file that run as they are: `rosslt launch` owns their locations, and starts such a
node again when a parameter has changed that it reads at its start."""

import contextlib
import math
import threading
import time
from typing import Any, Callable, Dict, List, Tuple

import roslaunch.core
import rospy
from rosgraph.names import ns_join

from rosslt import files, msg, node
from rosslt.messages import Scalar

#: The time to wait for the master before it is seen whether this process ends, in seconds.
WAIT = 1.0

_Origins = Dict[str, Dict[str, Any]]


class LaunchedParameters:
    """The parameters of nodes that run as they are.

    Args:
        nodes: these nodes, of roslaunch.
        parameters: the full names of all parameters of the launch file.
        origins: where it gives scalars, by their full names.
        monitor: roslaunch's, once it has started the nodes.
        restarts: whether nodes may be started again.
    """

    def __init__(
        self, nodes: List[Any], parameters: List[str], origins: _Origins, monitor: Any, restarts: bool
    ) -> None:
        self._monitor = monitor
        self._nodes: List[_LaunchedNode] = []
        self._given: List[Tuple[_LaunchedNode, str]] = []
        self._told = told = {name: origin for name, origin in origins.items() if _is_told(origin['said'])}
        for one in nodes:
            name = ns_join(one.namespace, one.name)
            own = [
                key for key in parameters if key.startswith(name + '/') and any(_is_in(key, scalar) for scalar in told)
            ]
            process = monitor.get_process(one.process_name) if own and one.process_name else None
            if process is not None:
                self._nodes.append(_LaunchedNode(name, process, monitor, restarts))
                self._given += [(self._nodes[-1], key) for key in own]
        if self._given:
            # In a thread of its own, as rospy waits for the master, which ends if somebody ends the launch.
            threading.Thread(target=self._own, name='rosslt launch', daemon=True).start()

    def _own(self) -> None:
        keys = [key for _, key in self._given]
        try:
            rospy.init_node(node.LAUNCH, anonymous=True, disable_rosout=True, disable_signals=True, argv=[])
            node.start()
            site = _sites({name: one for name, one in self._told.items() if any(_is_in(key, name) for key in keys)})
            for reader, key in self._given:
                node.own_parameter_of(reader, key, site)
        except (*node.NO_MASTER, rospy.ROSException) as error:
            if not self._monitor.is_shutdown:
                _say(f'the parameters of nodes that run as they are cannot be changed: {error}')

    def end(self) -> None:
        """Wait until no node is being started."""
        for one in self._nodes:
            one.end()


class _LaunchedNode:
    """A node that runs as it is, with the process that roslaunch has started for it.

    roslaunch's monitor asks each process in turn whether it is alive. While one is being started again, it waits for
    the answer: it sees neither that the node has ended nor that nothing runs.
    """

    def __init__(self, name: str, process: Any, monitor: Any, restarts: bool) -> None:
        self.name = name
        self._process, self._monitor, self._restarts = process, monitor, restarts
        self._taken: Dict[node.Location, Scalar] = {}  # not told to the node yet
        self._is_reconfigured: Dict[str, bool] = {}  # by the full name of a parameter
        self._said, self._started = '', 0.0  # what had changed when it was last started again, and when that was
        self._waits = False  # it has ended at its start, until another change
        self._lock = threading.RLock()
        self._was_alive, self._start = process.is_alive, process.start
        process.is_alive, process.start = self._is_alive, self._started_by_monitor

    def effect(self, name: str) -> str:
        if self._is_reconfigured.get(name):
            return ''
        if not self._restarts:
            return f'is refused unless {self.name} has it in dynamic_reconfigure: {self._why_not()}'
        if self._has_ended() and not self._process.respawn:
            return f'has no effect now: {self.name} has ended, and is not started again'
        by_itself = '' if name in self._is_reconfigured else ', unless that has it in dynamic_reconfigure'
        return f'takes effect as `rosslt launch` starts {self.name} again{by_itself}'

    def _has_ended(self) -> bool:
        """Return whether it is left to roslaunch, which has seen that it has ended."""
        return self._process.time_of_death is not None and not self._waits

    def _why_not(self) -> str:
        return f'{self.name} reads it at its start, and `rosslt launch --no-restart` does not start it again'

    def take(self, location: node.Location, value: Scalar) -> None:
        parameter = location.name[len(self.name) + 1 :]
        is_done = self._is_reconfigured[location.name] = node.reconfigure_parameter(self.name, parameter, value)
        if is_done:
            return
        if not self._restarts:
            raise ValueError(self._why_not())
        self._taken[location] = value

    def changed(self) -> None:
        with node.CHANGE_LOCK:
            # What was refused elsewhere in the same change has its former value again.
            taken = [location for location, value in self._taken.items() if location.value == value]
            said = ', '.join(f'{one.name[len(self.name) + 1 :]} is {one.value!r}' for one in taken)
            self._taken.clear()
        if not taken:
            return  # by others, perhaps by the node itself
        while not node.is_set(*taken, timeout=WAIT):
            if rospy.is_shutdown():
                return
        with self._lock:
            if self._has_ended():
                again = 'it is started again' if self._process.respawn else 'it is not started again'
                _say(f'{self.name} has ended, {again}: {said}')
            elif not self._monitor.is_shutdown:
                self._start_again(said)

    def _start_again(self, said: str) -> None:
        _say(f'{self.name} is started again: {said}')
        self._process.stop([])
        if self._monitor.is_shutdown:  # somebody has ended the launch meanwhile
            return
        self._said, self._waits, self._started = said, False, time.monotonic()
        try:
            self._start()
        except roslaunch.core.RLException as error:
            _say(str(error))
        if self._monitor.is_shutdown:  # which may have stopped it before it was started
            self._process.stop([])

    def _is_alive(self) -> bool:
        """Return whether the monitor is to leave the process alone."""
        with self._lock:
            if self._waits or self._was_alive():
                return True
            said, self._said = self._said, ''
            if said and time.monotonic() - self._started < node.SUSPECT and not self._monitor.is_shutdown:
                self._waits = not self._process.respawn
                then = '; the next change of its parameters starts it again' if self._waits else ''
                _say(f'{self.name} has ended with exit code {self._process.exit_code} since {said}{then}')
            return self._waits

    def _started_by_monitor(self) -> bool:
        with self._lock:
            return bool(self._start())

    def end(self) -> None:
        """Wait until it is not being started."""
        with self._lock:
            pass


def _say(text: str) -> None:
    roslaunch.core.printlog_bold(text)


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
