"""The room of nodes that know nothing of all this: a rospy node that was not written for rosslt runs with provenance.

It may import the rooms `node`, `messages`, `files` and `values`, and rospy. From the bottom up: `lifetimes`, `states`
and `verdicts` judge which number literals of a program are locations, by its text alone; `literals` finds them;
`rewriting` makes readings of them, and `loader` loads what it made, from a cache mostly; `cells` holds their values
and makes those known that reach a message; `routing` gives the node what keeps provenance in the place of what it
imports; `reloading` takes in what somebody edits; `runner` runs it as Python would.
"""

from typing import Any

from rosslt.instrument.literals import digest_of
from rosslt.instrument.runner import NoNode, find_node, run_file
from rosslt.instrument.verdicts import RULES

__all__ = ['RULES', 'NoNode', 'NotLaunched', 'digest_of', 'find_node', 'launch', 'run_file']


def __getattr__(name: str) -> Any:
    # roslaunch takes long to import, and the nodes that are run do without.
    if name in ('NotLaunched', 'launch'):
        from rosslt.instrument import launching

        return getattr(launching, name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
