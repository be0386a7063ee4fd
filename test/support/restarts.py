"""The demo of markers, whose parts, nodes, RViz and the master, are killed and started again."""

import contextlib
import itertools
import signal
import subprocess
import time
from pathlib import Path
from typing import Any, Dict, Iterator, List, Sequence, Set, Tuple

import rosgraph

from support import fork_server
from support.hand import wait_until
from support.processes import Master, node_pid
from support.screen import Screen

MASTER, RVIZ = 'master', 'rviz'

#: The nodes of the demo, its handles, and the parameters of rosslt.
NODES = ('visualization_talker', 'visualization_listener', 'slt_visualization')
HANDLES = {'/markers:linked:0', '/markers:linked:1'}
PARAMETERS = {
    '/visualization_talker/%s/%s' % (namespace, name)
    for namespace in ('rosslt', 'rosslt_records')
    for name in ('x', 'y', 'z')
}

PARAMETERS.add('/visualization_talker/rosslt_records/_last_request')

_HAND = Path(__file__).with_name('restart_hand.py')
_CONFIG = Path(__file__).resolve().parents[2] / 'config' / 'visualization_talker_listener.rviz'

#: The colour of the sphere where light falls on it, (red, green, blue), and by how many pixels it is dragged.
_SPHERE, _BY = (235, 148, 25), 50

#: How long a part of a demo may take until it works again, in seconds, on a busy machine.
_TIME_LIMIT = 120

#: For how long what is dragged does not move once RViz has let go of it, in seconds: longer than a hand keeps others
#: off.
_REST = 1.5


class Demo:
    """The nodes of the demo, each a process that can be killed and started again. They work when this is made.

    Args:
        master: the one that this process reaches.
        folder: where logs, and what is changed, are put.

    Attributes:
        parts: what can be killed and started again.
    """

    def __init__(self, master: Master, folder: Path) -> None:
        self.parts = [*NODES, MASTER]
        self._master, self._folder = master, folder
        self._processes: Dict[str, Any] = {}
        with contextlib.ExitStack() as stack:
            stack.callback(self._kill_nodes)
            for node in NODES:
                self._start(node)
            self._check()
            self._ends = stack.pop_all()

    def restart(self, order: Sequence[str]) -> None:
        """Kill parts in that order, start them in that order, and look whether all is as before.

        Raises:
            AssertionError: a drag does not work, or there are other handles or parameters.
        """
        for name in order:
            self._kill(name)
        for name in order:
            self._start(name)
        self._check()

    def close(self) -> None:
        """Kill what this has started."""
        self._ends.close()

    def _check(self) -> None:
        wait_until(lambda: all(map(self._is_there, NODES)), lambda: 'all nodes\n' + self._log(), _TIME_LIMIT)
        # in a process that has not seen anything before
        hand = fork_server.call(str(_HAND), [], _TIME_LIMIT)
        assert hand.returncode == 0, hand.stdout + hand.stderr + self._log()
        wait_until(
            lambda: parameters() == PARAMETERS,
            lambda: 'the parameters to be as before, not %s' % sorted(parameters() ^ PARAMETERS),
        )

    def _kill_nodes(self) -> None:
        for name in self._processes:
            self._kill(name)

    def _start(self, name: str) -> None:
        if name == MASTER:
            self._master.start()
            return
        with open(self._folder / (name + '.said'), 'a', encoding='utf-8') as log:
            self._processes[name] = subprocess.Popen(
                ['rosrun', 'rosslt', name],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )

    def _kill(self, name: str) -> None:
        if name == MASTER:
            self._master.kill()
        else:
            self._processes[name].send_signal(signal.SIGKILL)
            self._processes[name].wait()

    def _is_there(self, name: str) -> bool:
        """Whether the master knows the process that runs now, and its services."""
        master = rosgraph.Master('/test')
        try:
            master.lookupService('/%s/rosslt/lock_locations' % name)  # the last one that a tracked node offers
            return node_pid(master.lookupNode('/' + name)) == self._processes[name].pid
        except rosgraph.MasterError:
            return False

    def _log(self) -> str:
        """The end of what each node has said."""
        return '\n'.join(
            path.name + ':\n' + path.read_text(encoding='utf-8')[-2000:] for path in sorted(self._folder.glob('*.said'))
        )


class ShownDemo(Demo):
    """The demo with RViz, in which a mouse drags the sphere; arguments as of Demo."""

    def __init__(self, master: Master, folder: Path) -> None:
        super().__init__(master, folder)
        self.parts = ['visualization_talker', 'slt_visualization', RVIZ, MASTER]
        self._by = _BY
        with self._ends:
            self._screen = Screen(str(_CONFIG))
            self._ends.callback(self._screen.close)
            self._drag_by_mouse()
            self._ends = self._ends.pop_all()

    def restart(self, order: Sequence[str]) -> None:
        super().restart(order)
        self._drag_by_mouse()

    def screenshot(self, name: str) -> None:
        """Keep a picture of the screen."""
        self._screen.screenshot(name)

    def _start(self, name: str) -> None:
        if name == RVIZ:
            self._screen.start_rviz()
        else:
            super()._start(name)

    def _kill(self, name: str) -> None:
        if name == RVIZ:
            self._screen.kill_rviz()
        else:
            super()._kill(name)

    def _drag_by_mouse(self) -> None:
        self._screen.await_rviz()
        before = values()
        # RViz takes hold of nothing until it has drawn it, which is seen from outside by trying only
        wait_until(lambda: self._has_dragged(before), 'the mouse to drag the sphere', _TIME_LIMIT)
        self._await_rest()

    def _await_rest(self) -> None:
        """RViz may be behind the mouse, and who comes before it has let go finds the sphere held."""

        def is_at_rest() -> bool:
            before = values()
            time.sleep(_REST)
            return values() == before

        wait_until(is_at_rest, 'the sphere to be at rest', _TIME_LIMIT)

    def _has_dragged(self, before: Any) -> bool:
        middle = self._screen.middle(_SPHERE)
        if middle is None:
            return False
        self._screen.move([(middle[0] + 2, middle[1]), middle], step_time=0.3)
        self._screen.press()
        self._screen.move([(middle[0] + self._by * step // 10, middle[1]) for step in range(1, 11)])
        self._screen.release()
        self._by = -self._by  # so that it stays on the screen, whether the owner follows or not
        with contextlib.suppress(AssertionError):
            wait_until(lambda: values() != before, 'the talker to have followed', 2.0)
            return True
        return False


def values() -> Any:
    """What the talker's locations are."""
    return rosgraph.Master('/test').getParam('/visualization_talker/rosslt')


def parameters() -> Set[str]:
    """The names of all parameters that rosslt has set."""
    return {name for name in rosgraph.Master('/test').getParamNames() if '/rosslt' in name and '/hand_' not in name}


def orders(parts: Sequence[str], *sizes: int) -> Iterator[Tuple[str, ...]]:
    """Each order in which some of the parts can be killed and started again, those of fewer parts first.

    RViz does not register at a new master: where that is started again, so is RViz.

    Args:
        parts: of the demo.
        sizes: how many of them.
    """
    for size in sizes:
        for order in itertools.permutations(parts, size):
            if not (MASTER in order and RVIZ in parts and RVIZ not in order):
                yield order


def turned(parts: List[str]) -> Iterator[List[str]]:
    """Orders of all parts in which each is at each place: as many as there are parts."""
    for turn in range(len(parts)):
        yield parts[turn:] + parts[:turn]
