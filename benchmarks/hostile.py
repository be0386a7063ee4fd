"""What no honest peer sends, many times as much as in the tests: requests, and provenance that was changed at random or
made to be slow. See `hostile_requests.py`, `header_fuzz.py` and `slow_provenance.py` in `test/support/`.
"""

import argparse
import logging
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from support.header_fuzz import fuzz, fuzz_stream
from support.hostile_requests import play
from support.slow_provenance import cases, cost

#: How often it is measured what receiving takes; how long that may be, in seconds, and how large, in megabytes.
RUNS, LATE, LARGE = 25, 0.05, 20


def requests(rounds: int) -> bool:
    """Send an owner requests; whether all went well. It raises where not."""
    began, answered, refused = time.process_time(), 0, 0
    for seed in range(rounds):
        some, others = play(1000 + seed, 1000)
        answered, refused = answered + some, refused + others
    took = time.process_time() - began
    print(
        f'{answered + refused} requests: {answered} answered, {refused} refused as a whole, no other exception, no '
        f'value that a location may not have; {1e6 * took / (answered + refused):.0f} us of processor time each'
    )
    return True


def changed_provenance(count: int) -> bool:
    """Receive provenance that was changed at random; whether all went well."""
    attached, faults, slowest = fuzz(count, seed=1)
    tracked, others = fuzz_stream(count // 5, seed=1)
    faults += others
    print(
        f'{count} changed provenances: {attached} right by chance, {count - attached} refused, '
        f'{1e3 * slowest:.0f} ms at most; {count // 5} changed messages: {tracked} with a provenance; '
        f'{sum(faults.values())} faults'
    )
    for fault, times in faults.most_common():
        print(f'{times:6d}  {fault}')
    return not faults


def slow_provenance() -> bool:
    """Measure what is made to be slow; whether all of it is received in time."""
    print(
        f'provenance at the limits of the format: ms of processor time (the least and the median of {RUNS}) and MB '
        'until received; ms and MB until all its sources are known'
    )
    late = []
    for name, message_class, elements, data in cases():
        runs = [cost(message_class, elements, data) for _ in range(RUNS)]
        taken, times = runs[0], sorted(run.seconds for run in runs)
        print(
            f'  {name:55} {len(data):7d} bytes {1e3 * times[0]:6.1f} {1e3 * times[RUNS // 2]:6.1f} ms '
            f'{taken.megabytes:5.1f} MB {1e3 * taken.seconds_with_sources:6.0f} ms '
            f'{taken.megabytes_with_sources:5.1f} MB  {taken.outcome:.80}'
        )
        if times[RUNS // 2] > LATE or taken.megabytes > LARGE:
            late.append(name)
    print(f'longer than {1e3 * LATE:.0f} ms or larger than {LARGE} MB:', ', '.join(late) or 'none')
    return not late


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--rounds', type=int, default=500, help='of 1000 requests each (default: 500)')
    parser.add_argument('--cases', type=int, default=1000000, help='of changed provenance (default: 1000000)')
    options = parser.parse_args()
    logging.getLogger('rosout').setLevel(logging.CRITICAL)  # which says of each fault what it is
    found = [slow_provenance(), changed_provenance(options.cases), requests(options.rounds)]
    return 0 if all(found) else 1


if __name__ == '__main__':
    sys.exit(main())
