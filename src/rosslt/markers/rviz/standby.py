"""Keeps a second `slt_visualization` waiting until the first has ended, then lets it take over."""

import os
import sys
import time
from typing import Sequence

import rosgraph

from rosslt import node

#: The period in which the first one is asked whether it still runs, in seconds.
PERIOD = 0.5


def wait_for_turn(name: str, arguments: Sequence[str] = tuple(sys.argv)) -> None:
    """Wait until no node of a name runs: rospy ends a node when a second one of its name starts.

    Args:
        name: the node's name, unless the arguments remap it.
        arguments: the command line.

    Raises:
        KeyboardInterrupt: somebody has ended this process meanwhile.
    """
    name = rosgraph.names.load_mappings(arguments).get('__name', name)
    name = rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(os.environ, list(arguments)), name)
    is_told = False
    while _runs(name):
        if not is_told:
            where = node.where_it_runs(name) or 'a process that does not answer any more'
            print(
                f'{name} runs already, in {where}: this one takes over when it ends, with its own settings. '
                f'`rosnode kill {name}` ends it',
                file=sys.stderr,
                flush=True,
            )
            is_told = True
        time.sleep(PERIOD)


def _runs(name: str) -> bool:
    """Ask a node of a name whether it runs; the master also knows those that were killed."""
    # A different process may have taken the port.
    return any(topic.startswith(name + '/') for topic in node.published_types([name])[name])
