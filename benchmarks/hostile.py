"""Requests that no client sends, 100 times as many as in the tests: see `test/support/hostile_requests.py`."""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from support.hostile_requests import play


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--rounds', type=int, default=500, help='of 1000 requests each (default: 500)')
    options = parser.parse_args()
    began, answered, refused = time.process_time(), 0, 0
    for seed in range(options.rounds):
        some, others = play(1000 + seed, 1000)
        answered, refused = answered + some, refused + others
    took = time.process_time() - began
    print(
        f'{answered + refused} requests: {answered} answered, {refused} refused as a whole, no other exception, no '
        f'value that a location may not have; {1e6 * took / (answered + refused):.0f} us of processor time each'
    )


if __name__ == '__main__':
    main()
