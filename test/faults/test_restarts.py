"""Every part of a demo, the master too, is killed and started again while the others run, in every order.

Afterwards a drag works, the handles are those that were there before, and so are the parameters.
"""

import contextlib
import itertools
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import rosgraph

from support.processes import node_pid, wait_until
from support.screen import Screen

pytestmark = [pytest.mark.rostest, pytest.mark.slow]

NODES = ['visualization_talker', 'visualization_listener', 'slt_visualization']
MASTER = 'master'
RVIZ = 'rviz'
CONFIG = Path(__file__).resolve().parents[2] / 'config' / 'visualization_talker_listener.rviz'

#: The colour of the sphere where light falls on it, (red, green, blue), and by how many pixels it is dragged.
SPHERE, BY = (235, 148, 25), 50

HANDLES = ['/markers:linked:0', '/markers:linked:1']

#: How long a part of the demo may take until it works again, in seconds, on a busy machine.
TIME_LIMIT = 120

HAND = """
import sys
sys.path.insert(0, {tests!r})
import rospy
from support.hand import Hand, wait_until

rospy.init_node('hand', anonymous=True)
hand = Hand()
wait_until(lambda: hand.names() == set({handles}), lambda: 'the handles, there are: %s' % hand.names())
for name in {handles}:
    for by in (0.5, -0.5):
        wanted = hand.position(name)[0] + by
        hand.drag(name, dx=by)
        wait_until(lambda: abs(hand.position(name)[0] - wanted) < 1e-4, name + ' to follow')
print('dragged')
"""


class Demo:
    """The nodes of visualization_talker_listener.launch, each a process that can be killed and started again."""

    def __init__(self, master, folder):
        self._master, self._folder = master, folder
        self._processes = {}
        for name in NODES:
            self.start(name)

    def start(self, name):
        if name == MASTER:
            self._master.start()
            return
        with open(self._folder / (name + '.log'), 'a', encoding='utf-8') as log:
            self._processes[name] = subprocess.Popen(
                ['rosrun', 'rosslt', name], stdin=subprocess.DEVNULL, stdout=log, stderr=log
            )

    def kill(self, name):
        if name == MASTER:
            self._master.kill()
        else:
            self._processes[name].send_signal(signal.SIGKILL)
            self._processes[name].wait()

    def _is_there(self, name):
        """Whether the master knows the services of the process that runs now."""
        master = rosgraph.Master('/test')
        try:
            # the last one that a tracked node offers
            master.lookupService('/%s/rosslt/lock_locations' % name)
            return node_pid(master.lookupNode('/' + name)) == self._processes[name].pid
        except rosgraph.MasterError:
            return False

    def log(self):
        return '\n'.join(path.name + ':\n' + path.read_text()[-2000:] for path in sorted(self._folder.glob('*.log')))

    def check(self):
        """Once all are there again, a drag of each handle works, and there are no others."""
        wait_until(lambda: all(map(self._is_there, NODES)), 'all nodes to be there', TIME_LIMIT)
        code = HAND.format(tests=str(Path(__file__).resolve().parents[1]), handles=HANDLES)
        hand = subprocess.run(
            [sys.executable, '-c', code], capture_output=True, text=True, timeout=TIME_LIMIT, check=False
        )
        said = hand.stdout + hand.stderr
        assert hand.stdout.splitlines()[-1:] == ['dragged'], said + self.log()


class ShownDemo(Demo):
    """The same with RViz, in which a mouse drags the sphere."""

    def __init__(self, master, folder):
        super().__init__(master, folder)
        self._screen = Screen(str(CONFIG))
        self._by = BY

    def start(self, name):
        if name == RVIZ:
            self._screen.start_rviz()
        else:
            super().start(name)

    def kill(self, name):
        if name == RVIZ:
            self._screen.kill_rviz()
        else:
            super().kill(name)

    def check(self):
        super().check()
        self._screen.await_rviz()
        before = values()
        # RViz takes hold of nothing until it has drawn it, which is seen from outside by trying only
        wait_until(lambda: self._has_dragged(before), 'the mouse to drag the sphere', TIME_LIMIT)
        self._by = -self._by

    def _has_dragged(self, before):
        middle = self._screen.middle(SPHERE)
        if middle is None:
            return False
        self._screen.move([(middle[0] + 2, middle[1]), middle], step_time=0.3)
        self._screen.press()
        self._screen.move([(middle[0] + self._by * step // 10, middle[1]) for step in range(1, 11)])
        self._screen.release()
        with contextlib.suppress(AssertionError):
            return wait_until(lambda: values() != before, 'the talker to have followed', 2.0)
        return False

    def close(self, picture):
        self._screen.screenshot(picture)
        self._screen.close()


def values():
    """What the talker's locations are."""
    return rosgraph.Master('/test').getParam('/visualization_talker/rosslt')


def parameters():
    """The names of all parameters but those of roscore."""
    return {
        name
        for name in rosgraph.Master('/test').getParamNames()
        if not name.startswith('/ros') and name != '/run_id' and '/hand_' not in name
    }


@pytest.fixture
def demo(master, tmp_path):
    made = Demo(master, tmp_path)
    made.check()
    yield made
    for name in NODES:
        made.kill(name)


def test_after_any_two_were_killed_and_started_again_in_any_order_all_is_as_before(demo):
    before = wait_until(lambda: len(parameters()) >= 6 and parameters(), 'the parameters of three locations')
    for first, second in itertools.permutations([*NODES, MASTER], 2):
        demo.kill(first)
        demo.kill(second)
        demo.start(first)
        demo.start(second)
        demo.check()
        wait_until(lambda: parameters() == before, 'the parameters are as before')


def test_after_all_were_killed_and_started_again_all_is_as_before(demo):
    before = wait_until(lambda: len(parameters()) >= 6 and parameters(), 'the parameters of three locations')
    for turn in range(4):
        order = [*NODES, MASTER][turn:] + [*NODES, MASTER][:turn]
        for name in order:
            demo.kill(name)
        for name in order:
            demo.start(name)
        demo.check()
        wait_until(lambda: parameters() == before, 'the parameters are as before')


@pytest.fixture
def shown_demo(master, tmp_path, request):
    made = ShownDemo(master, tmp_path)
    made.check()
    yield made
    made.close(request.node.name)
    for name in NODES:
        made.kill(name)


def test_after_rviz_and_what_it_shows_were_killed_and_started_again_a_mouse_drags(shown_demo):
    """In 8 of the 24 orders: each part is at each place in two of them."""
    before = wait_until(lambda: len(parameters()) >= 6 and parameters(), 'the parameters of three locations')
    parts = ['visualization_talker', 'slt_visualization', RVIZ, MASTER]
    orders = [row[turn:] + row[:turn] for row in (parts, parts[::-1]) for turn in range(4)]
    for order in orders:
        for name in order:
            shown_demo.kill(name)
        for name in order:
            shown_demo.start(name)
        shown_demo.check()
        wait_until(lambda: parameters() == before, 'the parameters are as before')
