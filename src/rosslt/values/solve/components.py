"""Connected components: results that share no source which may change are solved apart."""

import bisect
from typing import Dict, List

from ..graph import Graph
from .equations import Goal
from .freedom import Freedom

LAST_STEPS = 8
"""The number of last operations of each result that are read first; mostly they show that all are connected."""


def connected(graph: Graph, goals: List[Goal], freedom: Freedom) -> List[List[Goal]]:
    """The goals in groups that share no source which may change: nodes that are connected belong together."""
    depends = graph.depending([source for source in graph.occurrences if freedom.allows(source)])
    # Each node counts as the root that brought it in.
    root_of: List[int] = []
    for root, begin in graph.begins.items():
        root_of += [root] * (root + 1 - begin)
    parents = {root: root for root in graph.begins}

    def group_of(place: int) -> int:
        root = root_of[place]
        while parents[root] != root:
            parents[root] = root = parents[parents[root]]
        return root

    for places in graph.occurrences.values():
        for place in places[1:] if depends[places[0]] else ():
            parents[group_of(place)] = group_of(places[0])

    def join(step: tuple) -> None:
        place, forward, first, second, _ = step
        begin = graph.begins[root_of[place]]
        for operand in first if forward is None else (first,) if second is None else (first, second):
            if operand < begin and depends[operand]:
                parents[group_of(place)] = group_of(operand)

    steps = graph.steps(depends)
    for root in graph.begins:
        end = bisect.bisect_left(steps, (root + 1,))
        for step in steps[max(0, end - LAST_STEPS) : end]:
            join(step)
    if len({group_of(root) for root in graph.begins}) > 1:
        for step in steps:
            join(step)
    index = graph.index
    groups: Dict[int, List[Goal]] = {}
    for goal in goals:
        place = index[id(goal[1])]
        groups.setdefault(group_of(place) if depends[place] else -1 - place, []).append(goal)
    return list(groups.values())
