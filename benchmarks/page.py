"""What the page costs with 500 tracked markers at 10 Hz, what smooth edges do, and how soon others see a change.

The browsers are headless Chromium, which draws with the processor: frames are what they take from what else runs. RViz
is `slt_visualization` with what RViz would be sent. Needs a master.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

import rospy
from visualization_msgs.msg import InteractiveMarkerUpdate

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from selenium.webdriver.common.keys import Keys

from support.browser import Browser, Server
from support.hand import Hand
from support.processes import Node, wait_until
from support.scenery import marker_node

COUNT, RATE = 500, 10.0
SECONDS = 10.0
TRIALS = 12
EDGES_TRIALS = 3
CPU_LIMIT, LEAST_FRAMES, LATENCY_LIMIT = 1.0, 20.0, 0.2

BOX = marker_node(
    'box',
    'CUBE',
    0.8,
    'g',
    "marker.pose.position.x = rosslt.location(0.0, name='along', minimum=-4.0, maximum=4.0)",
)
BOX_NAME = '/box::0'

#: Counts frames from now on.
COUNT_FRAMES = """
window.frames = 0;
(function count() { window.frames += 1; requestAnimationFrame(count); })();
"""

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


def load(moving: int, has_smooth_edges: bool = False) -> Tuple[float, float, float]:
    """What is taken while `moving` of the markers move.

    Args:
        has_smooth_edges: whether the browser draws them, as one with a graphics card does.

    Returns:
        (share of a core of the server, frames a second in the browser, seconds of a core of the browser for each).
    """
    publisher = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name('markers.py')), 'publish', str(moving)], stdout=subprocess.DEVNULL
    )
    server = Server()
    browser = Browser(server.url, says_card=has_smooth_edges)
    try:
        browser.see((0.3, 0.3, 0.0))
        browser.driver.execute_script(COUNT_FRAMES)
        drawing = family(browser.driver.service.process.pid)
        first, begun, used = frames(browser), time.monotonic(), cpu_seconds(server.process.pid)
        drawn = sum(map(cpu_seconds, drawing))
        time.sleep(SECONDS)
        count, took = frames(browser) - first, time.monotonic() - begun
        drawn = sum(map(cpu_seconds, drawing)) - drawn
        return (cpu_seconds(server.process.pid) - used) / took, count / took, drawn / max(count, 1)
    finally:
        browser.close()
        server.stop()
        publisher.terminate()
        publisher.wait()


def frames(browser: Any) -> int:
    return int(browser.driver.execute_script('return window.frames'))


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


def drag_in_rviz(views: Views, trial: int) -> None:
    """A hand in RViz moves the box at once."""
    views.hand.drag(BOX_NAME, dx=0.5 if trial % 2 else -0.5, steps=1)


def move_slider(views: Views, trial: int) -> None:
    """A hand moves the slider in the first browser by a step."""
    thumb = views.browsers[0].row('along').find_element('css selector', '[role=slider]')
    thumb.send_keys(Keys.ARROW_RIGHT if trial % 2 else Keys.ARROW_LEFT)


def latency(views: Views, change: Callable[[Views, int], None], others: List[str]) -> Dict[str, List[float]]:
    """{view: seconds until it shows a change, for each trial}, from when the change was asked for."""
    found: Dict[str, List[float]] = {name: [] for name in others}
    for trial in range(TRIALS):
        views.forget()
        begun = time.time()
        change(views, trial)
        times = wait_until(
            lambda: (lambda seen: seen if all(name in seen for name in others) else None)(views.seen()), 'all see it'
        )
        for name in others:
            found[name].append(times[name] - begun)
        time.sleep(0.5)  # what the change was is over, so that the next one is another
    return found


def show_latency(title: str, found: Dict[str, List[float]]) -> None:
    for name, times in found.items():
        median, longest = statistics.median(times), max(times)
        note = '' if longest <= LATENCY_LIMIT else '   over the limit of {:g} s'.format(LATENCY_LIMIT)
        print('{:<34} {:<16} {:>8.3f} {:>9.3f}{}'.format(title, name, median, longest, note), flush=True)


def measure_load() -> None:
    print('{} tracked markers in one array at {:g} Hz'.format(COUNT, RATE))
    print('{:<20} {:>18} {:>18} {:>22}'.format('', 'server, of a core', 'browser, frames/s', 'browser, CPU ms/frame'))
    for moving in (0, COUNT // 10, COUNT):
        cpu, per_second, each = load(moving)
        notes = ['over the limit of {:.0%}'.format(CPU_LIMIT)] if cpu > CPU_LIMIT else []
        notes += ['below {:g} frames/s'.format(LEAST_FRAMES)] if per_second < LEAST_FRAMES else []
        title = '{} of them move'.format(moving)
        print(
            '{:<20} {:>18.0%} {:>18.1f} {:>22.0f}   {}'.format(title, cpu, per_second, 1000 * each, ', '.join(notes)),
            flush=True,
        )


def measure_edges() -> None:
    print('{} tracked markers that all move, {} times each'.format(COUNT, EDGES_TRIALS))
    print('{:<20} {:>22} {:>22}'.format('edges', 'browser, frames/s', 'browser, CPU ms/frame'))
    found: Dict[bool, List[Tuple[float, float]]] = {True: [], False: []}
    for _ in range(EDGES_TRIALS):
        for is_smooth, measured in found.items():
            _, per_second, each = load(COUNT, is_smooth)
            measured.append((per_second, 1000 * each))
    for is_smooth, measured in found.items():
        per_second, each = (statistics.median(column) for column in zip(*measured))
        print('{:<20} {:>22.1f} {:>22.0f}'.format('smooth' if is_smooth else 'plain', per_second, each), flush=True)


def measure_latency() -> None:
    print('{:<34} {:<16} {:>8} {:>9}'.format('seconds until it is seen', 'by', 'median', 'longest'))
    server, rviz = Server(), subprocess.Popen(['rosrun', 'rosslt', 'slt_visualization'], stdout=subprocess.DEVNULL)
    with Node('box', BOX):
        views = Views(server.url)
        try:
            show_latency('a drag in RViz', latency(views, drag_in_rviz, ['first browser', 'second browser']))
            show_latency('a slider in the first browser', latency(views, move_slider, ['second browser', 'RViz']))
        finally:
            views.close()
            server.stop()
            rviz.terminate()
            rviz.wait()


PARTS = {'load': measure_load, 'edges': measure_edges, 'latency': measure_latency}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--part', choices=list(PARTS), action='append', help='all if left out')
    options = parser.parse_args()
    rospy.init_node('page_benchmark')
    for part in options.part or PARTS:
        PARTS[part]()


if __name__ == '__main__':
    main()
