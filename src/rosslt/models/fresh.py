"""What was learned of a running node, if it is still true of it."""

import time
from typing import NamedTuple, Optional

import rosgraph

from rosslt.models.kept import Kept, version_of
from rosslt.models.kept_files import kept_of
from rosslt.models.processes import NotCopied, live_process


class Fresh(NamedTuple):
    """What was learned of a node, if it is still true.

    Attributes:
        kept: all of it; None if it is stale.
        age: the seconds since then.
        why_stale: why it need not be true, as a part of a sentence.
    """

    kept: Optional[Kept]
    age: float
    why_stale: str


def fresh_of(master: rosgraph.Master, folder: str, publisher: str) -> Optional[Fresh]:
    """What was learned of a node; None if nothing was.

    Args:
        master: the ROS master.
        folder: where files are kept.
        publisher: the full name of the node.

    Raises:
        BadFile: a file of the node is damaged.
        OSError: the master does not answer.
    """
    now, problem, tree = None, '', master.getParam('/')
    try:
        now = version_of(live_process(master, publisher), tree)
    except NotCopied as error:
        problem = f'it cannot be compared with the node that runs: {error}'
    kept = kept_of(folder, publisher, now)
    if kept is None:
        return None
    age = max(0.0, time.time() - kept.when)
    stale = kept.why_stale(now, tree) if now else problem
    if stale:
        return Fresh(None, age, f'stale: {stale}; `rosslt learn {publisher}` learns it anew')
    return Fresh(kept, age, '')
