#!/usr/bin/env python3
"""How long it takes until a command has answered, and what `rosslt run` adds to the start of a node.

The commands ask a master and one node that publishes at 50 Hz. Runs of all of them alternate, so that other work on the
machine disturbs all alike. CPU time is that of the command's own process.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from typing import Dict, List, Tuple

RUNS = 15

#: A node that starts, publishes once and ends.
PLAIN = """
import rospy
from geometry_msgs.msg import Point

rospy.init_node('started', anonymous=True)
publisher = rospy.Publisher('started', Point, queue_size=1)
publisher.publish(Point(1.5, 2.5, 3.5))
"""

TALKER = """
import rospy, rosslt
from geometry_msgs.msg import Point

rosslt.init_node('talker')
publisher = rosslt.Publisher('target', Point, queue_size=1)
rate = rospy.Rate(50)
while not rospy.is_shutdown():
    publisher.publish(x=rosslt.location(2.0, name='radius'))
    rate.sleep()
"""


def measured(command: List[str]) -> Tuple[float, float]:
    """(wall, CPU) seconds of a command, which must work."""
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    wall = time.monotonic() - start
    process.returncode = status
    if status != 0:
        sys.exit(f'{" ".join(command)} failed')
    return wall, used.ru_utime + used.ru_stime


def main() -> None:
    # as users have it: modules are compiled once
    os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
    with tempfile.TemporaryDirectory(prefix='rosslt_start_') as folder:
        files = {}
        for name, text in (('plain', PLAIN), ('talker', TALKER)):
            files[name] = os.path.join(folder, name + '.py')
            with open(files[name], 'w', encoding='utf-8') as file:
                file.write(text)
        talker = subprocess.Popen([sys.executable, files['talker']])
        try:
            wait_for_talker(talker)
            show(files['plain'])
        finally:
            talker.terminate()
            talker.wait()


def wait_for_talker(talker: 'subprocess.Popen[bytes]') -> None:
    """Wait until the node has its location."""
    while talker.poll() is None:
        found = subprocess.run(['rosslt', 'list', '/talker'], capture_output=True, text=True, check=False).stdout
        if '/talker/radius' in found:
            return
    sys.exit('the node that is asked has ended')


def show(plain: str) -> None:
    """Measure and print."""
    python = sys.executable
    commands: Dict[str, List[str]] = {
        'import rospy': [python, '-c', 'import rospy'],
        'rosslt list': ['rosslt', 'list'],
        'rosslt set': ['rosslt', 'set', '/talker/radius', '2.5'],
        'rosslt force': ['rosslt', 'force', '/target/x', '1.5'],
        'a node': [python, plain],
        'rosslt run': ['rosslt', 'run', plain],
    }
    times: Dict[str, List[Tuple[float, float]]] = {name: [] for name in commands}
    for turn in range(RUNS + 1):
        for name, command in commands.items():
            taken = measured(command)
            if turn:  # the first one compiles modules
                times[name].append(taken)
    print(f'median and range of {RUNS} runs, in seconds')
    print(f'{"":14}{"wall":^22}{"CPU":^22}')
    for name, taken in times.items():
        print(f'{name:14}' + ''.join(f'{spread(list(column)):22}' for column in zip(*taken)))
    added = [run[1] - node[1] for run, node in zip(times['rosslt run'], times['a node'])]
    print(f'rosslt run adds {spread(added)} of CPU time')


def spread(values: List[float]) -> str:
    return f'{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})'


if __name__ == '__main__':
    main()
