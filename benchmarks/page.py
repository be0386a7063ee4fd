"""What the page costs with 500 tracked markers at 10 Hz, and how soon others see a change.

`told` measures what the server has of the time until others see a change: it looks at what is sent to browsers, without
one.

The browsers are headless Chromium, which draws with the processor, and shares it with all else that runs: so the load
of the machine stands beside each figure (the mean number of processes that ran or waited to run in the last minute),
and what a frame takes of the processor, which depends less on it. RViz is `slt_visualization` with what RViz would be
sent. Needs a master.
"""

import argparse
import os
import random
import statistics
import subprocess
import sys
import threading
import time
from importlib import metadata
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple

import rospy
from visualization_msgs.msg import InteractiveMarkerUpdate

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from selenium.webdriver.common.keys import Keys

from rosslt import msg, node
from support.browser import LIBRARIES, Browser, Server
from support.hand import Hand
from support.processes import Node, wait_until
from support.scenery import marker_node

COUNT, RATE = 500, 10.0
SECONDS = 10.0
TRIALS = 100
CPU_LIMIT, LEAST_FRAMES, LATENCY_LIMIT = 1.0, 20.0, 0.2

BOX = marker_node(
    'box', 'CUBE', 0.8, 'g', "marker.pose.position.x = rosslt.location(0.0, name='along', minimum=-4.0, maximum=4.0)"
)
BOX_NAME = '/box::0'

#: Who is told of a change, by the page's server or by `slt_visualization`; and who tells of it first.
TOLD, OWNER = ('the field', 'the thing', 'RViz'), 'the owner'

#: How many frames have been drawn.
DRAWN = 'return window.__viserTestpoints.rendererInfo.render.frame'

#: So many frames are drawn before any is counted.
FIRST_FRAMES = 20

#: Notes when a key was pressed last, in ms since 1970.
WATCH_KEYS = "window.addEventListener('keydown', () => { window.pressed = Date.now(); }, true)"

#: Notes when what stands in a field changes, in ms since 1970.
WATCH_FIELD = """
const field = arguments[0];
let last = field.value;
window.seen = [];
(function look() {
  if (field.value !== last) { last = field.value; window.seen.push(Date.now()); }
  requestAnimationFrame(look);
})();
"""


def cpu_seconds(pid: int) -> float:
    """What a process has taken so far."""
    fields = Path('/proc/{}/stat'.format(pid)).read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def family(pid: int) -> List[int]:
    """A process, those that it has started, those that they have started, and so on."""
    children: Dict[int, List[int]] = {}
    for stat in Path('/proc').glob('[0-9]*/stat'):
        try:
            parent = int(stat.read_text().rpartition(')')[2].split()[1])
        except OSError:  # it has ended meanwhile
            continue
        children.setdefault(parent, []).append(int(stat.parent.name))
    found = [pid]
    for one in found:
        found += children.get(one, [])
    return found


class Load(NamedTuple):
    """What is taken by the page.

    Attributes:
        server: the share of a core that its server takes.
        frames: how many frames a browser draws, in Hz.
        browser: the share of a core that the browser takes.
        machine: the load of the machine.
    """

    server: float
    frames: float
    browser: float
    machine: float

    @property
    def each(self) -> float:
        """What a frame takes of the processor, in ms."""
        return 1000 * self.browser / max(self.frames, 0.1)


def load(moving: int) -> Load:
    """What is taken while `moving` of the markers move."""
    publisher = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name('markers.py')), 'publish', str(moving)], stdout=subprocess.DEVNULL
    )
    server = Server()
    browser = Browser(server.view)
    try:
        browser.see((0.3, 0.3, 0.0))
        if moving:
            wanted = drawn(browser) + FIRST_FRAMES
            wait_until(lambda: drawn(browser) > wanted, 'frames are drawn')
        processes = family(browser.driver.service.process.pid)
        first, begun, used = drawn(browser), time.monotonic(), cpu_seconds(server.process.pid)
        cost = sum(map(cpu_seconds, processes))
        time.sleep(SECONDS)
        last, took = drawn(browser), time.monotonic() - begun
        cost = sum(map(cpu_seconds, processes)) - cost
        return Load(
            (cpu_seconds(server.process.pid) - used) / took, (last - first) / took, cost / took, os.getloadavg()[0]
        )
    finally:
        browser.close()
        server.stop()
        publisher.terminate()
        publisher.wait()


def drawn(browser: Any) -> int:
    """How many frames a browser has drawn."""
    return int(browser.driver.execute_script(DRAWN))


class Views:
    """Two browsers and RViz, which look at one box."""

    def __init__(self, url: str) -> None:
        self.browsers = [Browser(url), Browser(url)]
        self.hand = Hand()
        self.hand.marker(BOX_NAME)
        self._rviz: List[float] = []
        rospy.Subscriber('/slt_visualization/update', InteractiveMarkerUpdate, self._see)
        for browser in self.browsers:
            browser.driver.execute_script(WATCH_FIELD, browser.field('along'))
            browser.driver.execute_script(WATCH_KEYS)

    def _see(self, update: Any) -> None:
        if any(pose.name == BOX_NAME for pose in update.poses):
            self._rviz.append(time.time())

    def forget(self) -> None:
        """Whatever has been seen until now."""
        del self._rviz[:]
        for browser in self.browsers:
            browser.driver.execute_script('window.seen = []')

    def seen(self) -> Dict[str, float]:
        """{view: when it first saw a change}, in seconds since 1970."""
        found = {}
        for name, browser in zip(('first browser', 'second browser'), self.browsers):
            times = browser.driver.execute_script('return window.seen')
            if times:
                found[name] = times[0] / 1000.0
        if self._rviz:
            found['RViz'] = self._rviz[0]
        return found

    def close(self) -> None:
        for browser in self.browsers:
            browser.close()


def drag_in_rviz(views: Views, trial: int) -> float:
    """A hand in RViz moves the box at once; when that was, in seconds since 1970."""
    begun = time.time()
    views.hand.drag(BOX_NAME, dx=0.5 if trial % 2 else -0.5, steps=1)
    return begun


def move_slider(views: Views, trial: int) -> float:
    """A hand moves the slider in the first browser by a step; when the browser had the key, in seconds since 1970."""
    first = views.browsers[0]
    thumb = first.row('along').find_element('css selector', '[role=slider]')
    thumb.send_keys(Keys.ARROW_RIGHT if trial % 2 else Keys.ARROW_LEFT)
    return float(first.driver.execute_script('return window.pressed')) / 1000.0


def latency(
    views: Views, change: Callable[[Views, int], float], others: List[str], trials: int
) -> Dict[str, List[float]]:
    """{view: seconds until it shows a change, for each trial}, from when a hand made it."""
    found: Dict[str, List[float]] = {name: [] for name in others}
    for trial in range(trials):
        views.forget()
        begun = change(views, trial)
        times = wait_until(
            lambda: (lambda seen: seen if all(name in seen for name in others) else None)(views.seen()), 'all see it'
        )
        for name in others:
            found[name].append(times[name] - begun)
        time.sleep(0.5)  # what the change was is over, so that the next one is another
    return found


def show_latency(title: str, found: Dict[str, List[float]]) -> None:
    for name, times in found.items():
        late = sum(one > LATENCY_LIMIT for one in times)
        note = '{} of {} over the limit of {:g} s'.format(late, len(times), LATENCY_LIMIT) if late else ''
        print(
            '{:<30} {:<16} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.1f}   {}'.format(
                title, name, min(times), statistics.median(times), max(times), os.getloadavg()[0], note
            ),
            flush=True,
        )


class Listener:
    """What the page's server sends to browsers, and the others that are told of the box.

    Args:
        port: of the server.
    """

    def __init__(self, port: int) -> None:
        # what the page needs is not among the system's packages
        sys.path.append(LIBRARIES)
        import msgspec
        import websockets.sync.client
        import zstandard

        self._seen: Dict[str, List[Tuple[float, float]]] = {name: [] for name in (*TOLD, OWNER)}
        self._decode = msgspec.msgpack.decode
        self._unpack = zstandard.ZstdDecompressor().decompress
        self._socket = websockets.sync.client.connect(
            'ws://127.0.0.1:{}/'.format(port), subprotocols=['viser-v' + metadata.version('viser')], max_size=None
        )
        threading.Thread(target=self._listen, daemon=True).start()
        rospy.Subscriber('/slt_visualization/update', InteractiveMarkerUpdate, self._see_rviz)
        rospy.Subscriber('/box/rosslt/changes', msg.AppliedChange, self._see_owner)

    def wait(self, name: str, value: float, begun: float) -> float:
        """Wait until somebody is told of a value; gives when it was."""

        def told() -> Optional[float]:
            return next((when for when, said in self._seen[name] if when > begun and abs(said - value) < 1e-6), None)

        return float(wait_until(told, '{} is told'.format(name)))

    def close(self) -> None:
        self._socket.close()

    def _see(self, name: str, value: float) -> None:
        self._seen[name].append((time.time(), value))

    def _see_rviz(self, update: Any) -> None:
        for pose in update.poses:
            self._see('RViz', pose.pose.position.x)

    def _see_owner(self, change: Any) -> None:
        self._see(OWNER, float(change.new_value))

    def _listen(self) -> None:
        for packet in self._socket:
            # the sizes of the message, unpacked and packed, and the message
            size, packed = (int.from_bytes(packet[at : at + 8], 'little') for at in (0, 8))
            for one in self._decode(self._unpack(packet[16 : 16 + packed], max_output_size=size))['messages']:
                if one['type'] == 'GuiUpdateMessage' and isinstance(one['updates'].get('value'), float):
                    self._see('the field', one['updates']['value'])
                elif one['type'] == 'SetPositionMessage':
                    self._see('the thing', one['position'][0])


def measure_told(trials: int) -> None:
    print('{} changes; from when the owner tells of a change until others are told'.format(trials))
    heads = '{:<16} {:>8} {:>8} {:>8} {:>8}'
    print(heads.format('seconds', 'least', 'median', 'longest', 'load'))
    server, rviz = Server(), subprocess.Popen(['rosrun', 'rosslt', 'slt_visualization'], stdout=subprocess.DEVNULL)
    with Node('box', BOX):
        Hand().marker(BOX_NAME)
        listener = Listener(server.port)
        try:
            place = wait_until(lambda: node.directory().ask(['/box'], 5.0)[0].get('/box'), 'the box has locations')[0]
            found: Dict[str, List[float]] = {name: [] for name in TOLD}
            for trial in range(trials):
                value, begun = 0.01 * (trial % 300 + 1), time.time()
                asker = node.Requester('/page_benchmark', node.directory())
                node.request_values({place.source: value}, 5.0, asker=asker)
                told = listener.wait(OWNER, value, begun)
                for name, times in found.items():
                    times.append(listener.wait(name, value, begun) - told)
                time.sleep(random.uniform(0.1, 0.2))  # not in step with what is done from time to time
            for name, times in found.items():
                shown = map('{:.3f}'.format, (min(times), statistics.median(times), max(times)))
                print(heads.format(name, *shown, '{:.1f}'.format(os.getloadavg()[0])), flush=True)
        finally:
            listener.close()
            server.stop()
            rviz.terminate()
            rviz.wait()


HEADS = ('server, of a core', 'browser, of a core', 'frames/s', 'CPU ms/frame', 'load')
TABLE = '{:<34} {:>18} {:>18} {:>9} {:>13} {:>5}   {}'


def show_load(title: str, found: Load, *notes: str) -> None:
    print(
        TABLE.format(
            title,
            '{:.0%}'.format(found.server),
            '{:.0%}'.format(found.browser),
            '{:.1f}'.format(found.frames),
            '{:.0f}'.format(found.each),
            '{:.1f}'.format(found.machine),
            ', '.join(notes),
        ),
        flush=True,
    )


def measure_load(trials: int) -> None:
    print('{} tracked markers in one array at {:g} Hz'.format(COUNT, RATE))
    print(TABLE.format('', *HEADS, ''))
    for moving in (0, COUNT // 10, COUNT):
        found = load(moving)
        notes = ['over the limit of {:.0%}'.format(CPU_LIMIT)] if found.server > CPU_LIMIT else []
        notes += ['below {:g} frames/s'.format(LEAST_FRAMES)] if moving and found.frames < LEAST_FRAMES else []
        show_load('{} of them move'.format(moving), found, *notes)


def measure_latency(trials: int) -> None:
    print('{} changes each'.format(trials))
    heads = '{:<30} {:<16} {:>8} {:>8} {:>8} {:>8}'
    print(heads.format('seconds until it is seen', 'by', 'least', 'median', 'longest', 'load'))
    server, rviz = Server(), subprocess.Popen(['rosrun', 'rosslt', 'slt_visualization'], stdout=subprocess.DEVNULL)
    with Node('box', BOX):
        views = Views(server.view)
        try:
            show_latency('a drag in RViz', latency(views, drag_in_rviz, ['first browser', 'second browser'], trials))
            show_latency(
                'a slider in the first browser', latency(views, move_slider, ['second browser', 'RViz'], trials)
            )
        finally:
            views.close()
            server.stop()
            rviz.terminate()
            rviz.wait()


PARTS = {'load': measure_load, 'told': measure_told, 'latency': measure_latency}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--part', choices=list(PARTS), action='append', help='all if left out')
    parser.add_argument('--trials', type=int, default=TRIALS, help='changes of each kind (default: %(default)s)')
    options = parser.parse_args()
    rospy.init_node('page_benchmark')
    for part in options.part or PARTS:
        PARTS[part](options.trials)


if __name__ == '__main__':
    main()
