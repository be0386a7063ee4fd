"""Waypoints in ROS parameters, set by a launch file: their numbers are sources as well, and can be saved."""

from typing import Any, Callable, List, Optional, Tuple

import rospy
import yaml

from rosslt import files, node, values
from rosslt.script.execution import Goto, Step, Wait


class Waypoints:
    """The waypoints in a parameter.

    Args:
        name: of the parameter that holds a list of [x, y, z].
        pause: of the parameter that holds for how many seconds to stay at each.
        take: called with (steps, whether there are as many as before) when something has changed.
    """

    def __init__(self, name: str, pause: str, take: Callable[[List[Step], bool], None]) -> None:
        self._name, self._pause, self._take = name, pause, take
        self._present: Optional[Tuple[Any, Any]] = None
        self._refused: Optional[Tuple[Any, Any]] = None  # what is named in the log already

    def update(self) -> None:
        """Take in the present parameters, without a network call. If they say no waypoints any more, the
        ones before stay, and the log says so.

        Raises:
            KeyError: there are no waypoints from the start.
        """
        pause = node.get_param(self._pause, 1.0)
        try:
            waypoints = node.get_param(self._name)
        except KeyError:
            if self._present is None:
                raise
            waypoints = None
        present = values.untracked(waypoints), values.untracked(pause)
        if present == self._present:
            self._refused = None
        if present in (self._present, self._refused):
            return
        self._refused = present
        try:
            seconds = float(pause)
        except (TypeError, ValueError):
            _complain(self._pause, present[1], 'a number of seconds')
            return
        try:
            steps: List[Step] = [
                step for waypoint in waypoints for step in (Goto(*map(values.to_float, waypoint)), Wait(seconds))
            ]
        except (TypeError, ValueError):
            _complain(self._name, present[0], 'a list of [x, y, z]')
            return
        has_same_count = self._present is not None and len(self._present[0]) == len(waypoints)
        self._present, self._refused = present, None
        self._take(steps, has_same_count)

    def save(self, path: str) -> str:
        """Write the numbers into the YAML file that they came from, and leave all else in it as it is.

        Returns:
            What has been done, for people.

        Raises:
            files.FileError: the file cannot be read or written, or holds something else.
        """
        key = self._name.lstrip('~')
        content, waypoints = files.read_bytes(path), values.untracked(node.get_param(self._name))
        changes = [
            files.YamlChange([key, number, axis], [], value, f'{key}[{number}][{axis}]')
            for number, waypoint in enumerate(waypoints)
            for axis, value in enumerate(waypoint)
        ]
        edits, left = files.yaml_edits(path, content, changes)
        if left:
            reasons = '; '.join(f'{what} cannot be saved: {reason}' for what, reason in left)
            raise files.FileError(path, None, None, reasons)
        if yaml.safe_load(files.replaced(content, edits))[key] != waypoints:
            raise files.FileError(path, None, None, f'it has more in {key} than the {len(waypoints)} waypoints to save')
        files.write(edits)
        return f'saved in {path}' if edits else f'{path} holds these values already'


def _complain(name: str, said: Any, wanted: str) -> None:
    rospy.logerr('%s is %s instead of %s', rospy.resolve_name(name), said, wanted)
