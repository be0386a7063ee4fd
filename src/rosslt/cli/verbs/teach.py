"""`rosslt teach`: a device does what the mouse does, or what is commanded becomes what is measured."""

import argparse
import contextlib
import functools
import shutil
import signal
import sys
import time
from typing import Any, Callable, Dict, FrozenSet, Sequence, Tuple

import rosgraph
import rospy

from rosslt import node, values
from rosslt.cli.failure import Failure, Misused
from rosslt.cli.master import find_master, full_field, full_name
from rosslt.cli.output import few, is_terminal, shortened, write_row
from rosslt.cli.verb import CHANGE, Argument

GROUP = CHANGE
SUMMARY = 'have a joystick, a tracker or a knob drag a thing or turn a number'
DESCRIPTION = """Have a device do what the mouse does in RViz: drag a thing, by the numbers behind it. DEVICE is a
topic. With a sensor_msgs/Joy, the hand holds as long as button --deadman is pressed, and a stick moves it. With a
geometry_msgs/Twist, it holds as long as that is not zero. With a geometry_msgs/PoseStamped, it holds as long as
messages come, and moves as the pose does, without the trembling of a hand; so does tf:FRAME, a frame of tf. A number
of any topic, as /knob/data or /panel/values[2], moves the number TARGET by as much as it changes itself: a field, a
location (NODE/LOCATION), or a joint (TOPIC:JOINT). A Joy turns it by the first of its --axes instead. The joints
of a sensor_msgs/JointState move the joints of the same names in TARGET; both hold as a PoseStamped does. A device that
is silent for 0.2 s has let go. What is not finite, leaps, goes back in time or is repeated moves nothing. From taking
hold to letting go, it is one change, which `rosslt undo` takes back. Ctrl-C lets go and ends.

With --record, the whole way from taking hold to letting go becomes rows in the file, below the row that the thing comes
from: the fewest whose straight ways stay within --tolerance of it. Then the thing goes back to where it was.

With --match, at each press what is commanded becomes what is measured then: an arm was led by hand, and the numbers
behind its waypoint shall be where it is. WANTED is a field of a topic with provenance, or a location; MEASURED is a
field of any topic: numbers go to those of the same name, joints to those of the same name. Either may be one joint of
a sensor_msgs/JointState, TOPIC:JOINT. A press is button --button of the Joy --press that goes down, a call of the
service ~match of the node slt_teach (std_srvs/Trigger), or Enter. All WANTED fields are one change, which `rosslt undo`
takes back, or nothing changes. Ctrl-C ends.

With --append, each press appends one row to the list that the thing, or WANTED, comes from: below its row, and behind
those that were appended before. With --by, the hand leads a ghost, and the row has the numbers of where that is; with
--match, the row has what is measured. The thing stays. `rosslt undo` takes one row out at a time. The service is
~append."""
EXAMPLE = """\
examples:
  rosslt teach /markers:ball:0 --by /joy
  rosslt teach /goal --by /joy --axes 0,1,4 --deadman 5 --speed 0.2
  rosslt teach /goal --by /joy --turn 3,4,2 --only x,y,yaw --expo 0.5
  rosslt teach /goal --by /cmd_vel
  rosslt teach /arm:tip:0 --by /tracker/pose --clutch /joy
  rosslt teach /goal --by tf:hand --in world --clutch /joy
  rosslt teach /gains/data[1] --by /panel/values[2] --scale 0.1
  rosslt teach /pid/goal_x --by /joy --axes 1 --scale 0.5
  rosslt teach /arm/command:elbow --by /joy
  rosslt teach /arm/command --by /leader/joint_states --clutch /joy
  rosslt teach /goal --by tf:hand --clutch /joy --record --tolerance 0.01
  rosslt teach /goal --by /joy --append --press /joy --button 2
  rosslt teach --match /arm/command=/joint_states --press /joy --button 2
  rosslt teach --match /arm/command=/joint_states --append
  rosslt teach --match /arm/command:elbow=/leader:elbow
  rosslt teach --match /pid/goal_x=/odom/pose/pose/position/x
  rosslt teach --match /goal/pose/position=/tracker/pose/position --match /grip/data=/gripper/width
  rosservice call /slt_teach/match

In a pipe it is a line of columns between tabs for each event: holds, lets go, or says; the name of the thing; then the
DEVICE, x, y and z or the numbers, or the text that it says. With --record also: records, the thing, the number of
poses, the number of rows, and file:line of the row above them, as the node has read it. With --match: matches or
refused; who has pressed; then NODE/LOCATION, the value before and the value after, for each number that has changed, or
the reason. What else there is to know of it are lines that begin with says, and who has pressed. With --append: appends
or refused; the same, with the value in the row of the thing and the one in the new row.
"""
ARGUMENTS = [
    Argument(
        'target',
        nargs='?',
        default='',
        metavar='TARGET',
        completer='targets',
        help='with --by: what is dragged, TOPIC:NAMESPACE:ID, or TOPIC if it shows one thing; TOPIC/FIELD of a number '
        'or of joints, TOPIC:JOINT, or NODE/LOCATION',
    ),
    Argument(
        '--by',
        metavar='DEVICE',
        default='',
        exclusive=True,
        completer='devices',
        help='the topic of the device, tf:FRAME, or TOPIC/FIELD of a number',
    ),
    Argument(
        '--in',
        dest='reference',
        default='',
        metavar='FRAME',
        help='with --by tf:FRAME: the frame that its pose is in; by default that of the thing',
    ),
    Argument(
        '--match',
        action='append',
        metavar='WANTED=MEASURED',
        exclusive=True,
        completer='matches',
        help='at each press, the field WANTED becomes what the field MEASURED is, as /goal/pose=/tracker/pose; may be '
        'given several times',
    ),
    Argument(
        '--append', action='store_true', help='at each press, one row is added: where the hand is, or what is measured'
    ),
    Argument(
        '--press',
        metavar='JOY',
        default='',
        completer='topics',
        help='with --match or --append: a Joy whose button presses',
    ),
    Argument(
        '--button',
        type=int,
        default=0,
        metavar='N',
        help='with --match or --append: the button of the Joy (default: 0)',
    ),
    Argument(
        '--axes',
        default='0,1,2',
        metavar='N,N,N',
        help='axes of a Joy that are x, y and z; the first one turns a number (default: 0,1,2)',
    ),
    Argument('--speed', type=float, default=0.5, metavar='V', help='m/s of a stick at its stop (default: 0.5)'),
    Argument('--deadman', type=int, default=0, metavar='N', help='button of a Joy that holds (default: 0)'),
    Argument(
        '--expo', type=float, default=0.0, metavar='E', help='0 to 1: finer near the middle of a Joy (default: 0)'
    ),
    Argument('--turn', metavar='N,N,N', help='axes of a Joy that are roll, pitch and yaw'),
    Argument('--turn-speed', type=float, default=0.5, metavar='W', help='rad/s of a stick at its stop (default: 0.5)'),
    Argument('--clutch', default='', completer='topics', metavar='JOY', help='a Joy whose button holds instead'),
    Argument(
        '--max-step',
        type=float,
        default=0.1,
        metavar='D',
        help='m or rad between two messages (default: 0.1)',
    ),
    Argument(
        '--smooth',
        type=float,
        default=15.0,
        metavar='S',
        help='seconds that poses of a hand that trembles are smoothed over at rest; 0: not at all (default: 15)',
    ),
    Argument(
        '--only',
        default='x,y,z,roll,pitch,yaw',
        metavar='WAYS',
        help='what the device may move, in the frame of the thing, as x,y,yaw (default: x,y,z,roll,pitch,yaw)',
    ),
    Argument(
        '--joints', default='', metavar='NAMES', help='the joints that a JointState may move, as a,b (default: all)'
    ),
    Argument(
        '--scale',
        type=float,
        default=1.0,
        metavar='F',
        help='m that the thing moves per m, or a number per 1 of a knob (default: 1)',
    ),
    Argument('--snap', type=float, default=0.0, metavar='D', help='coordinates or numbers become multiples of it'),
    Argument('--dry-run', action='store_true', help='with --by: a ghost moves, and it is said what would change'),
    Argument(
        '--record', action='store_true', help='with --by: a path of the hand becomes rows below the row of the thing'
    ),
    Argument(
        '--tolerance', type=float, metavar='D', help='with --record: m that a path may be off its rows (default: 0.005)'
    ),
    Argument('--lever', type=float, metavar='L', help='with --record: m that 1 rad counts as (default: 0.1)'),
    Argument('--wait', type=float, default=5.0, metavar='S', help='seconds to wait for all that it needs (default: 5)'),
]

#: How far a path may be off its rows, and what an angle of 1 rad counts as, in metres.
TOLERANCE, LEVER = 0.005, 0.1

#: The name of the node.
NODE = 'slt_teach'

#: The services of the node that press.
MATCH_SERVICE, APPEND_SERVICE = '~match', '~append'

#: Takes the live line of a terminal away.
CLEAR = '\r\x1b[K'

#: The period of the live line on a terminal, in seconds.
PERIOD = 0.1


def run(options: argparse.Namespace) -> None:
    if not (options.by or options.match):
        raise Misused('give --by DEVICE, or --match WANTED=MEASURED')
    if options.match:
        _match(options)
    else:
        _drag(options)


def _drag(options: argparse.Namespace) -> None:
    from rosslt import teach  # with all of the markers, which the help of other verbs does without
    from rosslt.cli import targets

    for names, least, most, range_ in (
        (('speed', 'max_step', 'turn_speed', 'scale'), sys.float_info.min, sys.float_info.max, 'above 0'),
        (('smooth', 'snap'), 0.0, sys.float_info.max, 'of at least 0'),
        (('expo',), 0.0, 1.0, 'from 0 to 1'),
    ):
        for name in names:
            if not least <= getattr(options, name) <= most:
                raise Misused(f'--{name.replace("_", "-")} must be a number {range_}, found {getattr(options, name)}')
    axes = _axes('axes', options.axes, may_be_one=True)
    chosen = teach.Options(
        axes,
        options.speed,
        options.deadman,
        options.max_step,
        () if options.turn is None else _axes('turn', options.turn),
        options.turn_speed,
        options.expo,
        options.smooth,
        _ways(options.only, teach.WAYS),
        options.scale,
        options.snap,
        options.reference,
        frozenset(filter(None, options.joints.split(','))),
    )
    if not options.target:
        raise Misused('--by needs a TARGET: what the device is to drag')
    if options.press and not options.append:
        raise Misused('--press is for --match or --append; with --by, the device or --clutch says when the hand holds')
    if options.append and (options.record or options.dry_run):
        other = '--record writes a path' if options.record else '--dry-run changes nothing'
        raise Misused(f'--append writes a row at each press, and {other}: give one of them')
    for name, length in (('tolerance', options.tolerance), ('lever', options.lever)):
        if length is not None and not options.record:
            raise Misused(f'--{name} is for --record')
        if length is not None and not sys.float_info.min <= length <= sys.float_info.max:
            raise Misused(f'--{name} must be a number above 0, found {length}')
    if options.dry_run and options.record:
        raise Misused('--dry-run changes nothing, and --record writes a file: give one of them')
    _check_button(options)
    if options.deadman < 0:
        raise Misused(f'--deadman must not be negative, found {options.deadman}')
    is_frame = options.by.startswith(teach.TF)
    if options.by == teach.TF:
        raise Misused(f'--by {teach.TF} needs the name of a frame, as {teach.TF}hand; found {options.by}')
    if options.reference and not is_frame:
        raise Misused(f'--in is for a frame of tf, as --by {teach.TF}hand; found --by {options.by}')
    by = options.by if is_frame else full_field(options.by)
    clutch = full_name(options.clutch) if options.clutch else ''
    if options.press and options.button == options.deadman and full_name(options.press) in (by, clutch):
        raise Misused(f'--button {options.button} of {options.press} holds: choose another one to press')
    master, end = find_master(), time.monotonic() + options.wait
    device, topic, device_class = teach.device(by, chosen, options.wait)
    meant = targets.wait_for(master, options.target, device, bool(chosen.turn), end)
    if isinstance(meant.what, teach.Field) and isinstance(device, teach.Joystick):
        device = teach.Stick(chosen)
    is_of_numbers = isinstance(device, teach.Numbers)
    if isinstance(meant.what, teach.Field) and not is_of_numbers:
        instead = f': name a number of it, as {by}/FIELD' * (not is_frame)
        raise Failure(f'{meant.what.name} is no thing that can be dragged, and {by} moves no number{instead}')
    if not is_of_numbers and len(axes) != 3:
        raise Misused(f'--axes must be three numbers of axes, as 0,1,2, for a thing; found {options.axes}')
    if (options.record or options.append) and is_of_numbers:
        option = '--record' if options.record else '--append'
        raise Misused(f'{option} is for a thing that has a pose; {by} moves numbers')
    if chosen.joints and not isinstance(device, teach.Joints):
        raise Misused(f'--joints is for a sensor_msgs/JointState; {by} is none')
    if options.append:
        joy = _joystick(options)
        _start()
    else:
        node.init_node(NODE, anonymous=True, disable_signals=True, log_level=rospy.ERROR)  # the screen says the rest
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    screen = Screen(by)
    teacher = teach.Teacher(screen.say, device)
    if options.record:
        teacher.record(options.tolerance or TOLERANCE, options.lever or LEVER, screen.records)
    if options.dry_run:
        teacher.lead_ghost()
    if options.append:
        teacher.append()
    try:
        screen.name = teacher.find(meant.what, topic, max(end - time.monotonic(), 1.0))
    except teach.NotTaught as error:
        raise Failure(f'{error}; nor is it a location: {meant.missing}' if meant.missing else str(error)) from None
    if meant.also:
        screen.say(meant.also)
    screen.begin()
    presses = _presses(APPEND_SERVICE, joy, options.button, screen.answers, screen.say) if options.append else None
    teacher.teach(screen.name, by, topic, device_class, chosen, clutch, screen.show, presses)
    screen.end()


def _match(options: argparse.Namespace) -> None:
    from rosslt import teach  # with all of the markers, which the help of other verbs does without
    from rosslt.cli import targets

    misplaced = options.target or '--clutch' * bool(options.clutch)
    misplaced = misplaced or '--record' * options.record or '--dry-run' * options.dry_run
    if misplaced:
        raise Misused(f'{misplaced} is for --by; --match says what is changed, and --press when')
    _check_button(options)
    texts = [text.partition('=') for text in options.match]
    if not all(wanted and measured for wanted, _, measured in texts):
        raise Misused('--match takes WANTED=MEASURED, as /goal/pose=/tracker/pose; found ' + ' '.join(options.match))
    end = time.monotonic() + options.wait
    master, directory = find_master(), node.Directory()
    with contextlib.suppress(KeyboardInterrupt):
        joy = _joystick(options)
        fields = [
            (
                targets.wait_for_field(master, wanted, end),
                targets.wait_for_field(master, measured, end, is_measured=True),
            )
            for wanted, _, measured in texts
        ]
        _start()
        values.describe_sources_with(directory.describe)
        matcher = teach.Matcher(fields, directory)
        matcher.wait(max(end - time.monotonic(), 1.0))
        if options.append:
            matcher.check_row()
        service, verb = (APPEND_SERVICE, 'appends') if options.append else (MATCH_SERVICE, 'matches')
        presses = _presses(
            service, joy, options.button, functools.partial(_show, verb=verb), functools.partial(_say, joy)
        )
        _end_with(presses.end)
        presses.answer_all(matcher.append if options.append else matcher.match)


def _check_button(options: argparse.Namespace) -> None:
    if options.button < 0:
        raise Misused(f'--button must not be negative, found {options.button}')


def _joystick(options: argparse.Namespace) -> str:
    """The full name of the Joy that presses, '' for none."""
    from rosslt import teach

    joy = full_name(options.press) if options.press else ''
    if joy and not isinstance(teach.device(joy, teach.Options(), options.wait)[0], teach.Joystick):
        raise Failure(f'{joy} is no sensor_msgs/Joy, and has no button to press')
    return joy


def _presses(service: str, joy: str, button: int, show: Callable[[str, Any], None], say: Callable[[str], None]) -> Any:
    """The presses from now on; a terminal shows where they come from."""
    from rosslt import teach

    presses = teach.Presses(service, joy, button, show, say)
    if is_terminal():
        ways = [f'button {button} of {joy}'] * bool(joy) + ['Enter'] * sys.stdin.isatty()
        ways.append(f'rosservice call {rospy.resolve_name(service)}')
        print(f'a press is {" or ".join(ways)}; Ctrl-C ends it', flush=True)
    return presses


def _start() -> None:
    """Begin as the node of a name that is known, as others call its service."""
    name = rosgraph.names.load_mappings(sys.argv).get('__name', NODE)
    full = full_name(name)
    where = node.where_it_runs(full)
    if where is not None:
        raise Failure(f'{full} runs already, in {where}: end it, or give this one another name, __name:=NAME')
    node.init_node(NODE, disable_signals=True, log_level=rospy.ERROR)  # the screen says the rest


def _end_with(end: Callable[[], None]) -> None:
    """Have the first signal end it when the press that is being answered is done, and the second one at once."""

    def take(*_: object) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.default_int_handler)
        end()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, take)


def _told(by: str, answer: Any) -> str:
    """Say on a terminal what came of a press."""
    return f'{by}: {"" if answer.is_done else "refused: "}{answer}'


def _show(by: str, answer: Any, verb: str = 'matches') -> None:
    """Print what came of a press."""
    if is_terminal():
        print(_told(by, answer), flush=True)
        return
    if answer.is_done:
        write_row(verb, by, *[cell for change in answer.changes for cell in change])
        for text in (answer.text, *answer.notes):
            write_row('says', by, text)
    else:
        write_row('refused', by, str(answer))
    sys.stdout.flush()


def _say(by: str, text: str) -> None:
    if is_terminal():
        print(text, flush=True)
    else:
        write_row('says', by, text)
        sys.stdout.flush()


def _axes(name: str, text: str, may_be_one: bool = False) -> Tuple[int, ...]:
    try:
        axes: Tuple[int, ...] = tuple(map(int, text.split(',')))
    except ValueError:
        axes = ()
    if len(axes) not in ((1, 3) if may_be_one else (3,)) or min(axes) < 0:
        one = ', or one for a number, as 1' * may_be_one
        raise Misused(f'--{name} must be three numbers of axes, as 0,1,2{one}; found {text}')
    return axes


def _ways(text: str, all_ways: Sequence[str]) -> FrozenSet[str]:
    ways = text.split(',')
    if not set(ways) <= set(all_ways):
        raise Misused(f'--only takes some of {",".join(all_ways)}; found {text}')
    return frozenset(ways)


class Screen:
    """The screen of a terminal: it shows who holds which thing, its numbers as they change, and messages.

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

    def records(self, written: Any) -> None:
        """Say which rows a path has become."""
        if is_terminal():
            self.say(f'{written.rows} rows of {written.poses} poses are below {written.where}')
        else:
            write_row('records', self.name, written.poses, written.rows, written.where)
            sys.stdout.flush()

    def answers(self, by: str, answer: Any) -> None:
        """Say what came of a press that appends a row."""
        if is_terminal():
            self.say(_told(by, answer))
        else:
            _show(by, answer, 'appends')

    def show(self, is_held: bool, place: Sequence[float], numbers: Dict[str, Any]) -> None:
        """Show who holds the thing, where it is, and the numbers behind it."""
        has_changed = is_held != self._is_held
        try:
            if has_changed and not is_terminal():
                write_row('holds' if is_held else 'lets go', self.name, self._by, *place)
                sys.stdout.flush()
        finally:  # Ctrl-C may come just after it was said
            self._is_held = is_held
        if is_terminal() and (has_changed or time.monotonic() >= self._due):
            self._due = time.monotonic() + PERIOD
            shown = {name: value for name, value in numbers.items() if not isinstance(value, str)}
            texts = [f'{name} = {value:{"" if isinstance(value, int) else ".4g"}}' for name, value in shown.items()]
            where = ' '.join(f'{one:{"" if isinstance(one, int) else ".3f"}}' for one in place)
            line = f'{self._by if is_held else "nobody"} holds {self.name} at {where}: {few(texts)}'
            self._line = shortened(line, shutil.get_terminal_size().columns - 1)
            print(CLEAR + self._line, end='', flush=True)
