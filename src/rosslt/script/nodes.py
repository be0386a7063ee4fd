"""The nodes of this room: their parameters, their log, and their main loops."""

import os
import shutil
from typing import Any, Callable, Dict, Sequence

import rospy
from std_srvs.srv import Trigger, TriggerResponse

from rosslt import files, node
from rosslt.msg import PoseStampedTracked
from rosslt.script import parameters
from rosslt.script.execution import Step
from rosslt.script.live import DEFAULT_SETTINGS, LiveScript, ScriptError, Settings
from rosslt.script.player import make_player

#: The rate of checking whether a step is done, in Hz.
RATE = 20.0


def run() -> None:
    """Keep a script in force until this node is shut down. Private parameters are the settings.

    Raises:
        ScriptError: there is no script.
        ValueError: a parameter is not what it has to be.
    """
    path = os.path.abspath(os.path.expanduser(_text('~file')))
    _copy_example(path)
    settings = Settings(
        _positive('~precision', DEFAULT_SETTINGS.precision), int(_positive('~step_limit', DEFAULT_SETTINGS.step_limit))
    )
    player, memory = make_player(PoseStampedTracked), _Memory()
    is_refused = False

    def take(steps: Sequence[Step], is_same_but_for_numbers: bool) -> None:
        nonlocal is_refused
        if is_refused:
            is_refused = False
            rospy.loginfo('%s is corrected, and in force again', path)
        rospy.logdebug('%s runs: %d steps', path, len(steps))
        player.play(steps, is_same_but_for_numbers)

    def report(error: ScriptError) -> None:
        nonlocal is_refused
        is_refused = True
        rospy.logerr('%s (the last script that ran stays in force)', error)

    script = LiveScript(
        path,
        node.add_location,
        node.remove_location,
        take,
        report,
        settings,
        memory.recall,
        memory.keep,
        node.numbers_of_rows,
    )
    files.FileWatch(path, script.reload)
    script.reload()  # what was saved before the watch began
    rospy.loginfo('%s is in force', path)

    def tick() -> None:
        player.tick()
        memory.write()

    _loop(tick)


def run_parameters() -> None:
    """Publish the waypoints of ROS parameters until this node is shut down."""
    player = make_player(PoseStampedTracked)
    waypoints = parameters.Waypoints('~waypoints', '~pause', player.play)

    def save(_request: Any) -> TriggerResponse:
        try:
            return TriggerResponse(True, waypoints.save(_text('~file')))
        except (ScriptError, ValueError) as error:
            return TriggerResponse(False, str(error))

    rospy.Service('~save', Trigger, save)

    def tick() -> None:
        waypoints.update()
        player.tick()

    _loop(tick)


def _loop(tick: Callable[[], None]) -> None:
    rate = rospy.Rate(RATE, reset=True)  # simulated time may begin anew
    while not rospy.is_shutdown():
        tick()
        rate.sleep()


def _copy_example(path: str) -> None:
    """Begin with an example if there is no script yet."""
    example = rospy.get_param('~example', '')
    if example and not os.path.exists(path):
        os.makedirs(os.path.dirname(path), exist_ok=True)
        shutil.copyfile(example, path)


def _text(name: str) -> str:
    value = rospy.get_param(name, '')
    if not isinstance(value, str) or not value:
        raise ValueError('the parameter {} has to name a file'.format(rospy.resolve_name(name)))
    return value


def _positive(name: str, default: float) -> float:
    value = rospy.get_param(name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0:
        raise ValueError('the parameter {} is {!r} instead of a number above 0'.format(rospy.resolve_name(name), value))
    return value


class _Memory:
    """The names of the locations of a script, kept in a parameter: they outlive this node, and so do the ids."""

    PARAMETER = '~' + node.SCRIPT_TEXT

    def __init__(self) -> None:
        self._latest: Dict[str, Any] = {}
        self._is_written = True
        node.MASTER_WATCH.renewals.append(self._write_again)

    def recall(self, digest: str) -> Sequence[str]:
        """The names that belong to this very text; none if they are not known."""
        kept = rospy.get_param(self.PARAMETER, {})
        is_known = isinstance(kept, dict) and kept.get('text') == digest
        return kept.get('names', []) if is_known else []

    def keep(self, digest: str, names: Sequence[str]) -> None:
        """Remember them, from the next `write` on: a change of the script waits for no master."""
        self._latest, self._is_written = {'text': digest, 'names': names}, False

    def write(self) -> None:
        """Write them if they have changed."""
        if self._is_written or not self._latest:
            return
        self._is_written = True
        try:
            rospy.set_param(self.PARAMETER, self._latest)
        except node.NO_MASTER as error:
            rospy.logwarn('the master does not answer; the ids of numbers may change with the next start: %s', error)

    def _write_again(self) -> None:
        self._is_written = False
