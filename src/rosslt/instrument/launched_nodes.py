"""A node of a launch file that `rosslt launch` starts again when what it reads at its start has changed."""

import threading
import time
from typing import Any, Dict, List

import roslaunch.core
import rospy

from rosslt import node
from rosslt.messages import Scalar

#: The time to wait for the master before it is seen whether this process ends, in seconds.
WAIT = 1.0


class Taken:
    """Values that were taken, and that are not told to a node yet."""

    def __init__(self) -> None:
        self._values: Dict[node.Location, Scalar] = {}

    def add(self, location: node.Location, value: Scalar) -> None:
        """Note a value that is taken."""
        self._values[location] = value

    def in_force(self) -> List[node.Location]:
        """Forget them; the locations that have theirs, once the master has them, none if this process ends."""
        with node.CHANGE_LOCK:
            # What was refused elsewhere in the same change has its former value again.
            taken = [location for location, value in self._values.items() if location.value == value]
            self._values.clear()
        while taken and not node.is_set(*taken, timeout=WAIT):
            if rospy.is_shutdown():
                return []
        return taken


class LaunchedNode:
    """A node, with the process that roslaunch has started for it.

    roslaunch's monitor asks each process in turn whether it is alive. While one is being started again, it waits for
    the answer: it sees neither that the node has ended nor that nothing runs.
    """

    def __init__(self, name: str, process: Any, monitor: Any, restarts: bool) -> None:
        self.name = name
        self._process, self._monitor, self._restarts = process, monitor, restarts
        self._taken = Taken()
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
            return f'is refused unless {self.name} has it in dynamic_reconfigure: {self.why_not()}'
        by_itself = '' if name in self._is_reconfigured else ', unless that has it in dynamic_reconfigure'
        return self.effect_of_start() or f'takes effect as `rosslt launch` starts {self.name} again{by_itself}'

    def effect_of_start(self) -> str:
        """Why it is not started again, as `has no effect ...`; '' if it is."""
        if self._has_ended() and not self._process.respawn:
            return f'has no effect now: {self.name} has ended, and is not started again'
        return ''

    def _has_ended(self) -> bool:
        """Return whether it is left to roslaunch, which has seen that it has ended."""
        return self._process.time_of_death is not None and not self._waits

    def why_not(self) -> str:
        """Why a change is refused, unless it may be started again."""
        return f'{self.name} reads it at its start, and `rosslt launch --no-restart` does not start it again'

    def take(self, location: node.Location, value: Scalar) -> None:
        parameter = location.name[len(self.name) + 1 :]
        is_done = self._is_reconfigured[location.name] = node.reconfigure_parameter(self.name, parameter, value)
        if is_done:
            return
        if not self._restarts:
            raise ValueError(self.why_not())
        self._taken.add(location, value)

    def changed(self) -> None:
        taken = self._taken.in_force()
        if taken:  # else by others, perhaps by the node itself
            self.start_for(', '.join(f'{one.name[len(self.name) + 1 :]} is {one.value!r}' for one in taken))

    def start_for(self, said: str) -> None:
        """Start it again, unless it has ended, or the launch does.

        Args:
            said: what has changed.
        """
        with self._lock:
            if self._has_ended():
                again = 'it is started again' if self._process.respawn else 'it is not started again'
                say(f'{self.name} has ended, {again}: {said}')
            elif not self._monitor.is_shutdown:
                self._start_again(said)

    def _start_again(self, said: str) -> None:
        say(f'{self.name} is started again: {said}')
        self._process.stop([])
        if self._monitor.is_shutdown:  # somebody has ended the launch meanwhile
            return
        self._said, self._waits, self._started = said, False, time.monotonic()
        try:
            self._start()
        except roslaunch.core.RLException as error:
            say(str(error))
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
                say(f'{self.name} has ended with exit code {self._process.exit_code} since {said}{then}')
            return self._waits

    def _started_by_monitor(self) -> bool:
        with self._lock:
            return bool(self._start())

    def end(self) -> None:
        """Wait until it is not being started."""
        with self._lock:
            pass


def say(text: str) -> None:
    """Print a line as roslaunch does."""
    roslaunch.core.printlog_bold(text)
