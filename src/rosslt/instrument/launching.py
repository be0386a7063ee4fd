"""Starts a launch file with its Python nodes run by `rosslt run`, and its static transforms sent with provenance."""

import functools
import os
import re
import shutil
from typing import Any, Collection, List

import roslaunch
import roslaunch.config
import roslaunch.core
import roslaunch.parent
import roslaunch.rlutil
import rospkg

from rosslt.files import ORIGINS
from rosslt.instrument.launched_parameters import LaunchedParameters
from rosslt.instrument.launched_robots import with_publishers
from rosslt.instrument.parameter_origins import NotingLoader, with_earlier
from rosslt.instrument.runner import NoNode, find_node, is_python_node
from rosslt.instrument.static_transforms import keep_provenance

MARKERS, RVIZ = 'slt_visualization', 'slt_rviz'

#: The delay before slt_visualization is restarted, in seconds.
RESPAWN_DELAY = 1.0


class NotLaunched(Exception):
    """A launch file cannot be started; the text says why."""


def launch(
    arguments: List[str],
    markers: bool = True,
    only: Collection[str] = (),
    others: Collection[str] = (),
    screen: bool = False,
    rviz: bool = False,
    restarts: bool = True,
) -> None:
    """Start a launch file, and wait until it ends.

    Args:
        arguments: package and file, or the file; then `arg:=value`.
        markers: whether to start slt_visualization beside it.
        only: names of the nodes to track, all if there is none.
        others: names of nodes to run as they are.
        screen: show the output of all nodes.
        rviz: whether to open RViz as well.
        restarts: whether a node that runs as it is may be started again, after a parameter that it reads has changed.

    Raises:
        NotLaunched: the file is not there, or roslaunch does not take it.
    """
    files = [argument for argument in arguments if ':=' not in argument]
    given = [argument for argument in arguments if ':=' in argument]
    try:
        found = roslaunch.rlutil.resolve_launch_arguments(files)
        if len(found) != 1:
            raise NotLaunched(f'one launch file at a time, or a package and a file of it: {", ".join(files) or "none"}')
        (file,) = found
        uuid = roslaunch.rlutil.get_or_generate_uuid(None, False)
        roslaunch.configure_logging(uuid)
        parent = _Parent(uuid, file, given, markers, only, others, screen, rviz)
        parent.start()
        parameters = parent.own_parameters(restarts)
    except rospkg.ResourceNotFound as error:
        raise NotLaunched(f'package {error.args[0]} was not found; looked in {":".join(error.ros_paths)}') from None
    except (roslaunch.core.RLException, ValueError) as error:
        raise NotLaunched(str(error)) from None
    try:
        parent.spin()
    finally:
        parameters.end()


class _Parent(roslaunch.parent.ROSLaunchParent):
    """roslaunch, with other prefixes."""

    def __init__(
        self,
        uuid: str,
        file: str,
        given: List[str],
        markers: bool,
        only: Collection[str],
        others: Collection[str],
        screen: bool,
        rviz: bool,
    ) -> None:
        super().__init__(uuid, [(file, given)], force_screen=screen)
        self._markers, self._only, self._others, self._rviz = markers, only, others, rviz
        self._loader = NotingLoader()
        self._here: List[Any] = []
        self._as_they_are: List[Any] = []

    def _load_config(self) -> None:
        loader, load = self._loader, roslaunch.config.load_config_default
        # roslaunch hands on no loader of ours.
        roslaunch.config.load_config_default = functools.partial(load, loader=loader)
        try:
            super()._load_config()
        finally:
            roslaunch.config.load_config_default = load
        command = shutil.which('rosslt') or 'rosslt'
        for one in filter(self._is_wanted, self.config.nodes):
            keep_provenance(one, self.config, loader)
            if _is_trackable(one):
                one.launch_prefix = prefix_of(one.launch_prefix, command)
        self._here = [one for one in self.config.nodes if _is_here(one)]
        self._as_they_are = [one for one in self._here if _is_as_it_is(one)]
        origins = with_publishers(loader.origins, self._here, self.config.params)
        if origins:
            self.config.add_param(roslaunch.core.Param(ORIGINS, with_earlier(origins)), verbose=False)
        if self._markers:
            self._add(MARKERS, respawn=True, respawn_delay=RESPAWN_DELAY)
        if self._rviz:
            self._add(RVIZ)

    def own_parameters(self, restarts: bool) -> LaunchedParameters:
        """Own robots, and the parameters of nodes that run as they are, once all are started; `restarts` as in
        `launch`."""
        origins = self._loader.origins
        return LaunchedParameters(self._here, self._as_they_are, self.config.params, origins, self.pm, restarts)

    def _add(self, node_type: str, **options: object) -> None:
        """Add a node of this package, unless the launch file has it."""
        if not any(one.type == node_type for one in self.config.nodes):
            beside = roslaunch.core.Node('rosslt', node_type, name=node_type, **options)
            beside.machine = self.config.machines['']  # this one: the others have theirs already
            self.config.add_node(beside, verbose=False)

    def _is_wanted(self, one: Any) -> bool:
        names = {one.name, one.namespace + one.name, one.type}
        return (not self._only or not names.isdisjoint(self._only)) and names.isdisjoint(self._others)


def prefix_of(present: Any, command: str) -> str:
    """The launch-prefix that runs a node tracked, behind the one that it has, such as `xterm -e`."""
    kept = re.sub(r'(^|\s)(\S*/)?(env\s+)?python[\d.]*\s*$', ' ', present or '').strip()
    return f'{kept} {command} run'.strip()


def _is_here(one: Any) -> bool:
    """Return whether a launched node runs on this machine."""
    return one.machine is None or bool(roslaunch.core.is_machine_local(one.machine))


def _is_as_it_is(one: Any) -> bool:
    """Return whether a launched node runs without provenance."""
    return one.package != 'rosslt' and not (one.launch_prefix or '').endswith('rosslt run')


def _is_trackable(one: Any) -> bool:
    """Return whether a launched node can be tracked: a Python file on this machine, not one of rosslt's."""
    if one.package == 'rosslt' or (one.launch_prefix or '').endswith('rosslt run'):
        return False
    try:
        return is_python_node(os.path.abspath(find_node(one.package, one.type)))
    except (NoNode, OSError):
        return False
