"""Waypoints in ROS parameters, set by a launch file: their numbers are sources as well, and can be saved."""

from typing import Any, Callable, List, Optional, Tuple

import rospy

from rosslt import files, node, values
from rosslt.script.running import Goto, Step, Wait


class Waypoints:
    """The waypoints in a parameter.

    Args:
        name: of the parameter that holds a list of [x, y, z].
        pause: of the parameter that holds for how many seconds to stay at each.
        take: called with (steps, whether there are as many as before) when something has changed.
    """

    def __init__(self, name: str, pause: str, take: Callable[[List[Step], bool], None]) -> None:
        self._name, self._pause, self._take = name, pause, take
        self._present: Optional[Tuple[Any, float]] = None

    def update(self) -> None:
        """Take in what the parameters say now, which makes no network call."""
        pause = float(node.get_param(self._pause, 1.0))
        waypoints = node.get_param(self._name)
        present = (values.untracked(waypoints), pause)
        if present == self._present:
            return
        try:
            steps: List[Step] = [
                step for waypoint in waypoints for step in (Goto(*map(values.to_float, waypoint)), Wait(pause))
            ]
        except TypeError:
            rospy.logerr_throttle(
                10, '%s is %s instead of a list of [x, y, z]', rospy.resolve_name(self._name), present[0]
            )
            return
        has_same_count = self._present is not None and len(self._present[0]) == len(waypoints)
        self._present = present
        self._take(steps, has_same_count)

    def save(self, path: str) -> str:
        """Write the numbers into the YAML file that they came from, and leave all else in it as it is.

        Returns:
            What has been done, for people.

        Raises:
            ScriptError: the file cannot be read or written, or holds something else.
        """
        key = self._name.lstrip('~')
        text = files.read(path)
        new = files.yaml_with_values(text, {key: values.untracked(node.get_param(self._name))}, path)
        if new == text:
            return '{} holds these values already'.format(path)
        if not files.replace(path, text, new):
            return self.save(path)
        return 'saved in {}'.format(path)
