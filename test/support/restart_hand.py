"""A hand that drags each handle of a demo there and back, in a process of its own: `restart_hand.py DEMO [SCRIPT]`.

It ends with status 0 where each drag has worked, and no other handles are there. It is a plain node, which does not
register at a new master, so there is one for each look at a demo.
"""

import sys
from pathlib import Path
from typing import Callable, Collection, Tuple

import rospy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from support.hand import Hand, wait_until
from support.restarts import HANDLES, MARKERS, QUADCOPTER

#: How far from where it was dropped a thing may be, in metres: numbers in a script are rounded to a thousandth.
CLOSE = {MARKERS: 1e-4, QUADCOPTER: 0.6e-3}

#: By how much it drags along x, in metres.
STEPS = (0.5, -0.5)


def await_handles(hand: Hand, names: Collection[str]) -> None:
    wait_until(lambda: hand.names() == set(names), lambda: 'the handles; there are: %s' % sorted(hand.names()))


def drag_markers(hand: Hand) -> None:
    """Drag both markers, which the talker's x moves."""
    for name in HANDLES[MARKERS]:
        for by in STEPS:
            drag(hand, name, by, lambda name=name: hand.position(name), CLOSE[MARKERS])


def drag_quadcopter(hand: Hand, script: Path) -> None:
    """Drag the end of the curve, and the quadcopter where it rests there: both move the waypoint in the script."""
    quadcopter, end = '/quadcopter:quadcopter:0', '/trajectory_markers:end:0'
    for name in (end, quadcopter):
        for by in STEPS:
            wait_until(
                lambda: distance(hand.position(quadcopter), hand.position(end)) < CLOSE[QUADCOPTER],
                lambda: 'the quadcopter at %s to come to %s' % (hand.position(quadcopter), hand.position(end)),
            )
            drag(hand, name, by, lambda: waypoint(script), CLOSE[QUADCOPTER])
            wait_until(
                lambda: distance(hand.position(end), waypoint(script)) < CLOSE[QUADCOPTER],
                lambda: 'the end at %s to come to %s' % (hand.position(end), waypoint(script)),
            )


def drag(hand: Hand, name: str, by: float, moved: Callable[[], Tuple[float, ...]], close: float) -> None:
    """Drag a handle, and wait until what it moves has followed."""
    x, y, z = hand.position(name)
    hand.drag(name, dx=by)
    wait_until(
        lambda: distance(moved(), (x + by, y, z)) < close,
        lambda: 'what %s moves to come from %s to %s' % (name, moved(), (x + by, y, z)),
    )


def waypoint(script: Path) -> Tuple[float, ...]:
    """The numbers of a script with a single waypoint."""
    return tuple(map(float, script.read_text(encoding='utf-8').partition('(')[2].partition(')')[0].split(',')))


def distance(first: Tuple[float, ...], second: Tuple[float, ...]) -> float:
    """The largest difference along an axis."""
    return max(abs(a - b) for a, b in zip(first, second))


def main() -> None:
    demo = sys.argv[1]
    rospy.init_node('hand', anonymous=True)
    hand = Hand()
    await_handles(hand, HANDLES[demo])
    if demo == MARKERS:
        drag_markers(hand)
    else:
        drag_quadcopter(hand, Path(sys.argv[2]))
    await_handles(hand, HANDLES[demo])


if __name__ == '__main__':
    main()
