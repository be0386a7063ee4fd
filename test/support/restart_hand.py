"""A hand that drags each handle of the demo there and back, in a process of its own.

It ends with status 0 where each drag has worked, and no other handles are there. It is a plain node, which does not
register at a new master, so there is one for each look at the demo.
"""

import sys
from pathlib import Path

import rospy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from support.hand import Hand, wait_until
from support.restarts import HANDLES

#: By how much it drags along x, and how far from there the thing may be, in metres.
STEPS, CLOSE = (0.5, -0.5), 1e-4


def await_handles(hand: Hand) -> None:
    wait_until(lambda: hand.names() == HANDLES, lambda: 'the handles; there are: %s' % sorted(hand.names()))


def drag(hand: Hand, name: str, by: float) -> None:
    """Drag a marker, and wait until it has followed: the talker's x moves it."""
    x = hand.position(name)[0]
    hand.drag(name, dx=by)
    wait_until(
        lambda: abs(hand.position(name)[0] - x - by) < CLOSE,
        lambda: '%s to come from %s to %s' % (name, hand.position(name), x + by),
    )


def main() -> None:
    rospy.init_node('hand', anonymous=True)
    hand = Hand()
    await_handles(hand)
    for name in sorted(HANDLES):
        for by in STEPS:
            drag(hand, name, by)
    await_handles(hand)


if __name__ == '__main__':
    main()
