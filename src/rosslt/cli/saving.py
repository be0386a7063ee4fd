"""Changed values of a node, and where in files they stand."""

from typing import Any, List, NamedTuple, Tuple

import rosgraph

from rosslt import files, srv
from rosslt.cli.directory import Directory, Place, call, locations_of


class Unsaved(NamedTuple):
    """A changed value that cannot be written back: what it is called, and why."""

    name: str
    reason: str


def changes_to_save(master: rosgraph.Master, node: str) -> Tuple[List[files.Edit], List[Unsaved]]:
    """What would write the changed values of a node back to where they were read.

    Raises:
        Failure: the node does not answer.
    """
    places = locations_of(master, Directory(), node)
    return _in_sources(master, node, places)


def _in_sources(master: rosgraph.Master, node: str, places: List[Place]) -> Tuple[List[files.Edit], List[Unsaved]]:
    """What the node itself says: it knows what it has read of its code."""
    by_id = {place.location.id: place for place in places}

    def name(location_id: int) -> str:
        return by_id[location_id].local_name if location_id in by_id else str(location_id)

    answer: Any = call(master, node, 'list_edits', srv.ListEdits, srv.ListEditsRequest())
    edits = [
        files.Edit(
            edit.file, edit.digest, edit.start, edit.end, edit.old.encode(), edit.new.encode(), name(edit.location_id)
        )
        for edit in answer.edits
    ]
    return edits, [Unsaved(name(one), reason) for one, reason in zip(answer.left_ids, answer.reasons)]
