"""The row of a list that a thing comes from, and rows that are appended to it, one at each press."""

from typing import Any, Collection, Dict, List, Mapping, Sequence

from rosslt import files, node, values
from rosslt.teach.devices import NotTaught
from rosslt.teach.presses import Answer

#: How long the owner of the numbers may take to answer, in seconds.
TIMEOUT = 2.0


def checked_place(tracked: Sequence[Any], shared: Sequence[Collection[values.Source]] = ()) -> node.Place:
    """Return the place of a number that a thing comes from in a row to which others can be added.

    Args:
        tracked: the tracked numbers of the thing.
        shared: as of `Directory.held`.

    Raises:
        ChangeRejected: that row, its list or its node is locked.
        NotTaught: none of its numbers is in a row of alike ones, or that is not as its node has read it.
    """
    directory = node.directory()
    sources = values.sources(tracked)
    directory.learn(sources, TIMEOUT)
    refusals: List[str] = []
    held = directory.held(tracked, shared)
    for source in sources:
        place = directory.of(source)
        if place is None or place.is_fixed or source in held:
            continue
        try:
            node.row_additions([place], [], TIMEOUT)
            return place
        except (files.FileError, node.SourceUnreachable) as error:
            refusals.append(f'{place.name}: {error}')
    raise NotTaught('no row can be added: ' + (refusals[0] if refusals else 'it has no numbers that can change'))


def places_of(sources: Sequence[values.Source]) -> List[node.Place]:
    """Return where numbers of one node stand now.

    Raises:
        NotTaught: that is not known, or they are of several nodes.
    """
    directory = node.directory()
    directory.forget(sources)  # of a live script, they stand elsewhere after each edit
    directory.learn(sources, TIMEOUT)
    places = [directory.of(source) for source in sources]
    known = [place for place in places if place is not None]
    if len(known) < len(places):
        raise NotTaught('it is not known where its numbers stand')
    nodes = {place.node for place in known}
    if len(nodes) > 1:
        raise NotTaught(f'its numbers are those of several nodes: {", ".join(sorted(nodes))}')
    return known


class Appended:
    """Rows that are appended below the one that a thing comes from, each behind the one before."""

    def __init__(self) -> None:
        self._rows: List[Dict[values.Source, Any]] = []

    def append(self, tracked: Sequence[Any], found: Mapping[values.Source, Any]) -> Answer:
        """Append a row.

        Args:
            tracked: the tracked numbers of the thing.
            found: {Source: its value in the row}, of those that are not as in the row of the thing.
        """
        present = values.source_values(list(tracked))
        row = {**present, **found}
        rows = [*self._rows, row]
        changed = [source for source, value in present.items() if any(one.get(source, value) != value for one in rows)]
        try:
            if not changed:
                raise NotTaught('the row that it comes from has these numbers already')
            places = places_of(changed)
            *behind, added = [[one.get(source, present[source]) for source in changed] for one in rows]
            made = node.row_additions(places, [added], TIMEOUT, behind)
            untaken = made.write(TIMEOUT)
        except (values.Error, files.FileError, node.SourceUnreachable) as error:
            return Answer(False, f'nothing is written: {error}')
        self._rows.append(row)
        return Answer(
            True,
            f'a row with this is below {made.record.place}',
            [(place.name, present[place.source], row[place.source]) for place in places],
            [f'the row is written, but {untaken}'] if untaken else (),
        )
