"""Runs rospy nodes that were not written for rosslt with provenance.

It may import the rooms `node`, `messages`, `files` and `values`, and rospy. From the bottom up: `lifetimes`, `states`
and `location_rules` judge which number literals of a program are locations, by its text alone; `literals` finds them;
`tree_rewriting` replaces them by reads of cells, and `loader` loads the rewritten code, mostly from a cache; `cells`
holds their values and registers those that a person would change or that reach a message; `routing` replaces what the
node imports by counterparts that keep provenance;
`reloading` applies edits of the source file; `budget` limits what recording costs, and `losses` says where provenance
is lost; `runner` runs the node as Python would.
"""

from typing import Any

from rosslt.instrument.location_rules import RULES
from rosslt.instrument.runner import NoNode, find_node, run_file

__all__ = ['RULES', 'NoNode', 'NotLaunched', 'find_node', 'launch', 'run_file']


def __getattr__(name: str) -> Any:
    # roslaunch takes long to import, and the nodes that are run do without.
    if name in ('NotLaunched', 'launch'):
        from rosslt.instrument import launching

        return getattr(launching, name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
