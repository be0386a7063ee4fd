"""Makes joystick.bag, which devices.launch plays: nobody has held that joystick, its hand is computed here.

Three axes and four buttons are sent at 20 Hz for 20 s, as `joy_node` does with `autorepeat_rate`. Button 0 holds, the
sticks are pushed twice, and button 2 is pressed after each push.

    python3 make_joystick_bag.py [FILE]
"""

import random
import sys
from pathlib import Path
from typing import Iterator, List

import rosbag
import rospy
from sensor_msgs.msg import Joy

FILE = Path(__file__).resolve().with_name('joystick.bag')
TOPIC = '/joy'
BEGIN = 1_700_000_000.0  # s
DURATION, PERIOD = 20.0, 0.05  # s
HELD = (2.0, 16.0)  # s: from and until when button 0 is down
#: From and until when the sticks are pushed, in s, and how far.
PUSHES = [(3.0, 5.8, (-0.45, -0.75, 0.4)), (9.0, 11.6, (-0.75, -0.35, -0.3))]
PRESSES = [(7.0, 7.25), (13.5, 13.8)]  # s
RAMP = 0.4  # s until a stick is where it is held
TREMOR = 0.02  # of a hand on a stick
STEPS = 32767  # of an axis, on either side


def hand() -> Iterator[Joy]:
    """Yield what the joystick sends."""
    chance = random.Random(3)
    for number in range(round(DURATION / PERIOD)):
        now = number * PERIOD + chance.uniform(0.0, 0.1 * PERIOD)
        message = Joy(axes=deflections(now, chance), buttons=[int(HELD[0] <= now < HELD[1]), 0, 0, 0])
        message.buttons[2] = int(any(begin <= now < end for begin, end in PRESSES))
        message.header.seq, message.header.stamp = number, rospy.Time.from_sec(BEGIN + now)
        yield message


def deflections(now: float, chance: random.Random) -> List[float]:
    """Return how far each stick is pushed, with the tremor of the hand, in the steps of an axis."""
    axes = [chance.gauss(0.0, TREMOR) for _ in range(3)]
    for begin, end, far in PUSHES:
        part = min(max(min(now - begin, end - now) / RAMP, 0.0), 1.0)
        axes = [one + part * part * (3.0 - 2.0 * part) * by for one, by in zip(axes, far)]
    return [round(one * STEPS) / STEPS for one in axes]


def main() -> None:
    with rosbag.Bag(sys.argv[1] if len(sys.argv) > 1 else str(FILE), 'w', compression=rosbag.Compression.BZ2) as bag:
        for message in hand():
            bag.write(TOPIC, message, message.header.stamp)


if __name__ == '__main__':
    main()
