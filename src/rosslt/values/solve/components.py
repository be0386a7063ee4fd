"""Connected components: results that share no source which may change are solved apart."""

from typing import Dict, List

from ..graph import Graph
from .equations import Goal
from .freedom import Freedom


def connected(graph: Graph, goals: List[Goal], freedom: Freedom) -> List[List[Goal]]:
    """The goals in groups that share no source which may change: nodes that are connected belong together."""
    depends = graph.depending([source for source in graph.occurrences if freedom.allows(source)])
    parents = list(range(len(graph.nodes)))

    def group_of(place: int) -> int:
        while parents[place] != place:
            parents[place] = place = parents[parents[place]]
        return place

    for places in graph.occurrences.values():
        for place in places[1:] if depends[places[0]] else ():
            parents[group_of(place)] = group_of(places[0])
    for place, forward, first, second, _ in graph.steps(depends):
        for operand in first if forward is None else (first,) if second is None else (first, second):
            if depends[operand]:
                parents[group_of(place)] = group_of(operand)
    groups: Dict[int, List[Goal]] = {}
    for goal in goals:
        groups.setdefault(group_of(graph.index[id(goal[1])]), []).append(goal)
    return list(groups.values())
