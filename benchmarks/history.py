"""Changes and readings of 20 clients at 5 owners, while owners, clients and the master are killed, stopped and started.

What the clients have logged is checked (`test/support/history_checker.py`), for locations of rosslt and, in the same
harness, for parameters that are set with `rosparam set`. `./run bench history --kind KIND` takes one of them.
"""

import argparse
import sys
import time
from pathlib import Path
from typing import Dict

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from support import history_harness

CLIENTS, OWNERS = 20, 5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--count', type=int, default=10000, help='operations (default: 10000)')
    parser.add_argument('--kind', choices=list(history_harness.OWNERS), action='append', help='all if left out')
    options = parser.parse_args()
    for kind in options.kind or history_harness.OWNERS:
        began = time.monotonic()
        result = history_harness.run(kind, CLIENTS, OWNERS, options.count, pause=2.0, seed=1)
        found: Dict[str, int] = {}
        for fault in result.faults:
            found[fault.kind] = found.get(fault.kind, 0) + 1
        print(f'{kind}: {sum(result.operations.values())} operations in {time.monotonic() - began:.0f} s')
        print('  outcomes:', ', '.join(f'{number} {what}' for what, number in sorted(result.operations.items())))
        print('  failures made:', ', '.join(f'{number} {what}' for what, number in sorted(result.injected.items())))
        print('  faults found:', ', '.join(f'{number} {what}' for what, number in sorted(found.items())) or 'none')
        for fault in result.faults[:5]:
            print('   ', fault)
        for text in result.twins[:5]:
            print('    twins:', text)


if __name__ == '__main__':
    main()
