"""`rosslt teach`: a device does what the mouse does."""

import argparse
import math
import shutil
import signal
import sys
import time
from typing import Any, Dict, Sequence, Tuple

import rospy

from rosslt import node
from rosslt.cli.failure import Misused
from rosslt.cli.master import find_master, full_name
from rosslt.cli.output import few, is_terminal, shortened, write_row
from rosslt.cli.verb import CHANGE, Argument

GROUP = CHANGE
SUMMARY = 'have a joystick, a velocity command or a tracker drag a thing'
DESCRIPTION = """Have a device do what the mouse does in RViz: drag a thing, by the numbers behind it. DEVICE is a
topic. With a sensor_msgs/Joy, the hand holds as long as button --deadman is pressed, and a stick moves it. With a
geometry_msgs/Twist, it holds as long as that is not zero. With a geometry_msgs/PoseStamped, it holds as long as
messages come, and moves as the pose does. A device that is silent for 0.2 s has let go. What is not finite, leaps,
goes back in time or is repeated moves nothing. From taking hold to letting go, it is one change, which `rosslt undo`
takes back. Ctrl-C lets go and ends."""
EXAMPLE = """\
examples:
  rosslt teach /markers:ball:0 --by /joy
  rosslt teach /goal --by /joy --axes 0,1,4 --deadman 5 --speed 0.2
  rosslt teach /goal --by /cmd_vel
  rosslt teach /arm:tip:0 --by /tracker/pose --clutch /joy

In a pipe it is a line of columns between tabs for each event: holds, lets go, or says; the name of the thing; then the
DEVICE, x, y and z, or the text that it says.
"""
ARGUMENTS = [
    Argument('target', metavar='TARGET', help='what is dragged: TOPIC:NAMESPACE:ID, or TOPIC if it shows one thing'),
    Argument('--by', metavar='DEVICE', required=True, completer='topics', help='the topic of the device'),
    Argument('--axes', default='0,1,2', metavar='N,N,N', help='axes of a Joy that are x, y and z (default: 0,1,2)'),
    Argument('--speed', type=float, default=0.5, metavar='V', help='m/s of a stick at its stop (default: 0.5)'),
    Argument('--deadman', type=int, default=0, metavar='N', help='button of a Joy that holds (default: 0)'),
    Argument('--clutch', default='', completer='topics', metavar='JOY', help='a Joy whose button holds instead'),
    Argument('--max-step', type=float, default=0.1, metavar='D', help='m or rad between two messages (default: 0.1)'),
    Argument('--wait', type=float, default=5.0, metavar='S', help='seconds to wait for both (default: 5)'),
]

#: The name of the node.
NODE = 'slt_teach'

#: Takes the live line of a terminal away.
CLEAR = '\r\x1b[K'

#: The period of the live line on a terminal, in seconds.
PERIOD = 0.1


def run(options: argparse.Namespace) -> None:
    from rosslt import teach  # with all of the markers, which the help of other verbs does without

    chosen = teach.Options(_axes(options.axes), options.speed, options.deadman, options.max_step)
    for name, given in (('--speed', options.speed), ('--max-step', options.max_step)):
        if not (math.isfinite(given) and given > 0.0):
            raise Misused(f'{name} must be a number above 0, found {given}')
    if options.deadman < 0:
        raise Misused(f'--deadman must not be negative, found {options.deadman}')
    find_master()
    by, clutch = full_name(options.by), full_name(options.clutch) if options.clutch else ''
    device, device_class = teach.device(by, chosen, options.wait)
    node.init_node(NODE, anonymous=True, disable_signals=True, log_level=rospy.ERROR)  # the screen says the rest
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    screen = Screen(by)
    teacher = teach.Teacher(screen.say)
    screen.name = teacher.find(full_name(options.target), options.wait, device)
    screen.begin()
    teacher.teach(screen.name, by, device, device_class, chosen, clutch, screen.show)
    screen.end()


def _axes(text: str) -> Tuple[int, int, int]:
    try:
        x, y, z = map(int, text.split(','))
    except ValueError:
        x = y = z = -1
    if min(x, y, z) < 0:
        raise Misused(f'--axes must be three numbers of axes, as 0,1,2; found {text}')
    return x, y, z


class Screen:
    """What a person sees: who holds what, its numbers as they change, and what is said.

    Args:
        by: the topic of the device.

    Attributes:
        name: of the thing.
    """

    def __init__(self, by: str) -> None:
        self._by, self.name = by, ''
        self._is_held = False
        self._line, self._due = '', 0.0

    def begin(self) -> None:
        """Say that it can begin."""
        if is_terminal():
            print(f'{self.name} follows {self._by}; Ctrl-C ends it')

    def end(self) -> None:
        """Leave the cursor on a line of its own."""
        if is_terminal():
            print()

    def say(self, text: str) -> None:
        """Say what is wrong, or refused."""
        if is_terminal():
            print(f'{CLEAR}{text}\n{self._line}', end='', flush=True)
        else:
            write_row('says', self.name, text)
            sys.stdout.flush()

    def show(self, is_held: bool, place: Sequence[float], numbers: Dict[str, Any]) -> None:
        """Show who holds the thing, where it is, and the numbers behind it."""
        has_changed, self._is_held = is_held != self._is_held, is_held
        if has_changed and not is_terminal():
            write_row('holds' if is_held else 'lets go', self.name, self._by, *place)
            sys.stdout.flush()
        elif is_terminal() and (has_changed or time.monotonic() >= self._due):
            self._due = time.monotonic() + PERIOD
            texts = [f'{name} = {value:.4g}' for name, value in numbers.items() if not isinstance(value, str)]
            where = ' '.join(f'{one:.3f}' for one in place)
            line = f'{self._by if is_held else "nobody"} holds {self.name} at {where}: {few(texts)}'
            self._line = shortened(line, shutil.get_terminal_size().columns - 1)
            print(CLEAR + self._line, end='', flush=True)
