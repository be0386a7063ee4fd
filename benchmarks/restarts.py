"""Every part of a demo is killed and started again, in every order, and then dragged: what does not work afterwards?

The demo of markers, in which a mouse drags in a real RViz on a screen of its own (talker, slt_visualization, RViz,
master). One part, any two, and all are killed in an order and started again in that order, while the others run.
Afterwards each drag has to work, with the same handles and parameters as before. It ends with status 1 where something
was found.
"""

import argparse
import contextlib
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Optional

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from support.processes import Master
from support.restarts import Demo, ShownDemo, orders


class Restarts:
    """A demo that is restarted again and again, anew after each time that something was wrong."""

    def __init__(self) -> None:
        self._running: Optional[contextlib.ExitStack] = None
        self._demo: Any = None

    @property
    def demo(self) -> Demo:
        """The demo, which is started where it does not run."""
        if self._running is None:
            with contextlib.ExitStack() as stack:
                folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix='rosslt_restarts_')))
                master = Master()
                stack.callback(master.kill)
                os.environ.update(ROS_MASTER_URI=master.uri, ROS_HOSTNAME='localhost', ROS_LOG_DIR=str(folder))
                self._demo = stack.enter_context(contextlib.closing(ShownDemo(master, folder)))
                self._running = stack.pop_all()
        return self._demo

    def close(self) -> None:
        """End the demo."""
        if self._running is not None:
            self._running.close()
            self._running = None


def found(count: int, first: int) -> int:
    """Restart the demo in orders; returns how often something was wrong.

    Args:
        count: how many orders at most.
        first: the number of the first one, from 1.
    """
    wrong, longest = 0, 0.0
    with contextlib.closing(Restarts()) as restarts:
        parts = restarts.demo.parts
        every = list(orders(parts, 1, 2, len(parts)))
        chosen = list(enumerate(every, 1))[first - 1 : first - 1 + count]
        for number, order in chosen:
            demo = restarts.demo
            print(f'{number} of {len(every)}: {", ".join(order)}', end=' ', flush=True)
            began = time.monotonic()
            try:
                demo.restart(order)
            except AssertionError as error:
                wrong += 1
                print(f'WRONG after {time.monotonic() - began:.0f} s: {error}', flush=True)
                restarts.close()
            else:
                took = time.monotonic() - began
                longest = max(longest, took)
                print(f'({took:.1f} s)', flush=True)
    print(f'{len(chosen)} orders, {longest:.0f} s at most, {wrong} of them wrong')
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--count', type=int, default=sys.maxsize, help='how many orders (default: all)')
    parser.add_argument('--first', type=int, default=1, help='the number of the first one (default: 1)')
    options = parser.parse_args()
    return 1 if found(options.count, options.first) else 0


if __name__ == '__main__':
    sys.exit(main())
