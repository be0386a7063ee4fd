"""The nodes of this room: their parameters, their log, and their main loops."""

import hashlib
import os
import shutil
import threading
from typing import Any, Callable, Dict, List, Optional, Sequence

import rospy
from std_srvs.srv import Trigger, TriggerResponse

from rosslt import files, node
from rosslt.msg import PoseStampedTracked
from rosslt.script import parameters
from rosslt.script.errors import ScriptError
from rosslt.script.live import DEFAULT_SETTINGS, LiveScript, Settings
from rosslt.script.player import make_player
from rosslt.script.running import Step

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
        path, node.add_location, node.remove_location, take, report, settings, memory.recall, memory.keep
    )
    files.FileWatch(path, script.reload)
    script.reload()  # what was saved before the watch began
    rospy.loginfo('%s is in force', path)
    _loop(player.tick)


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
    """Begin with an example where there is no script yet."""
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
    """The names of the locations of a script, kept in a parameter: they outlive this node, and so do the ids.

    A thread of its own writes them: a change of the script waits for no master. A new master is told them again.
    """

    PARAMETER = '~rosslt_script'

    def __init__(self) -> None:
        self._latest: Optional[Dict[str, Any]] = None
        self._is_new = False
        self._wake = threading.Condition()
        node.on_new_master(self._tell)
        threading.Thread(target=self._work, name='memory', daemon=True).start()

    def recall(self, text: str) -> List[str]:
        """The names that belong to this very text; none where they are not known."""
        kept = rospy.get_param(self.PARAMETER, {})
        is_known = isinstance(kept, dict) and kept.get('text') == _digest(text)
        return kept.get('names', []) if is_known else []

    def keep(self, text: str, names: Sequence[str]) -> None:
        """Remember them."""
        self._latest = {'text': _digest(text), 'names': names}
        self._tell()

    def _tell(self) -> None:
        with self._wake:
            self._is_new = True
            self._wake.notify()

    def _work(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._is_new and self._latest)
                latest, self._is_new = self._latest, False
            try:
                rospy.set_param(self.PARAMETER, latest)
            except node.NO_MASTER as error:
                rospy.logwarn(
                    'the master does not answer; the ids of numbers may change with the next start: %s', error
                )


def _digest(text: str) -> str:
    return hashlib.blake2b(text.encode('utf-8'), digest_size=16).hexdigest()
