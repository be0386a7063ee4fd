"""Locations as messages, and what is to be written to the files of their values."""

import os
from typing import Any, Callable, List, Mapping, Optional, Sequence, Tuple

from rosslt import files, msg, srv, values
from rosslt.messages import Scalar
from rosslt.node.json_scalars import Refused, to_json
from rosslt.node.locations.location import Location, ParameterLocation
from rosslt.node.locations.others_parameter import OthersParameter
from rosslt.node.memory.plain_copies import PLAIN_COPIES
from rosslt.node.memory.remembered import MEMORY


def all_described(
    locations: Sequence[Location], lock_of: Callable[[str], str], set_for: Callable[[values.Source], str]
) -> List[msg.Location]:
    """Locations as messages, with what does not follow a change of them.

    Args:
        locations: of this node.
        lock_of: says who has locked the location of a name, and why; '' if it is not locked.
        set_for: names a parameter that is set and whose default comes from a source; '' if there is none.
    """
    holders = MEMORY.holders_of([location.source for location in locations])
    read_once = [location for location in locations if not location.is_read_again()]
    kept = MEMORY.kept([location.source for location in read_once]) if read_once else ()
    late = {
        one: _why(one, holders.get(one.source, []), set_for(one.source)) for one in read_once if one.source not in kept
    }
    return [described(one, lock_of(one.name), late.get(one, ''), holders.get(one.source, [])) for one in locations]


def _why(location: Location, holders: List[str], parameter: str) -> str:
    if isinstance(location, OthersParameter):
        return location.effect
    if parameter:
        return f'has no effect while the parameter {parameter} is set, whose default it is'
    takers = PLAIN_COPIES.takers_of(location.source) + holders
    rest = f', but for {" and ".join(takers)}' if takers else ''
    when = f'at the next start, or when {location.place} runs again'
    return f'takes effect {when}: nothing that the node keeps came of it{rest}'


def described(location: Location, lock: str = '', at_next_start: str = '', holders: Sequence[str] = ()) -> msg.Location:
    """A location as a message; one that is locked counts as read-only, so that other sources are changed instead.

    Args:
        lock: by whom it is locked, and why; '' if it is not.
        at_next_start: why a change does nothing before the node starts again; '' if it does something.
        holders: what holds results of it that follow no change.
    """

    def text(value: Optional[Scalar]) -> str:
        return '' if value is None else to_json(value)

    value, fault = _value_or_fault(location)
    minimum, maximum = location.bounds
    return msg.Location(
        id=location.id,
        name=location.name,
        is_named=location.is_named,
        file=os.fsencode(os.path.realpath(location.site.file)).decode('utf-8', 'replace'),
        line=location.site.line,
        column=location.site.column,
        type=location.type.__name__,
        value=value,
        fault=fault,
        literal=text(location.literal),
        minimum=text(minimum),
        maximum=text(maximum),
        read_only=location.read_only or bool(lock),
        locked=lock,
        at_next_start=at_next_start,
        plain_copies=_plain_copies(location, holders),
        remembered=location.remembered and not files.equal(location.value, location.value_in_code),
        weight=location.weight or 0.0,
        rank=location.rank,
        row=location.row,
        row_holds_none=location.row_holds_none,
    )


def edits_described(
    edits: Sequence[Tuple[Location, files.Edit]],
    left: Sequence[Tuple[Location, str]],
    read: Mapping[Location, Tuple[int, int, Any]],
    stale: Optional[List[str]],
) -> srv.ListEditsResponse:
    """Describe, as a message, the edits that would write changed values to source files, and the values that stand
    there.

    Args:
        edits, left: as of `SourceFiles.edits`.
        read: as of `SourceFiles.places`.
        stale: of each source file what else is another in it; None if the node does not follow them.
    """
    changed = {location for location, _ in [*edits, *left]}
    untaken = {
        location: said
        for location, (line, _, said) in read.items()
        if line and location not in changed and not _has_taken(location, said)
    }
    return srv.ListEditsResponse(
        [
            msg.FileEdit(
                location.id, edit.file, edit.digest, edit.start, edit.end, edit.old.decode(), edit.new.decode()
            )
            for location, edit in edits
        ],
        [location.id for location, _ in left],
        [reason for _, reason in left],
        [location.id for location in read],
        [line for line, _, _ in read.values()],
        [column for _, column, _ in read.values()],
        [location.id for location in untaken],
        [to_json(said) for said in untaken.values()],
        stale is not None,
        stale or [],
    )


def _has_taken(location: Location, said: Scalar) -> bool:
    """Return whether a location knows what stands in its file now."""
    return location.is_shared or any(files.equal(said, one) for one in (location.value_in_code, location.value))


def _plain_copies(location: Location, holders: Sequence[str]) -> str:
    """Say what takes a change at the next start only; '' if nothing, or if the node looks for changes."""
    is_polled = isinstance(location, ParameterLocation) and location.is_polled
    takers = [] if location.changed or is_polled else PLAIN_COPIES.takers_of(location.source)
    told = []
    if takers:
        takes, runs = ('take', 'those lines run') if takers[1:] else ('takes', 'that line runs')
        told.append(f'{" and ".join(takers)} {takes} it at the next start, or when {runs} again')
    if holders:
        told.append(f'{" and ".join(holders)} {"hold" if holders[1:] else "holds"} values of it that follow no change')
    if location.source in MEMORY.held_back and not any(taker.startswith('numpy.') for taker in takers):
        told.append('an array whose length would change takes it at the next start, or when its length is as before')
    return '; '.join(told)


def _value_or_fault(location: Location) -> Tuple[str, str]:
    """The value of a location, and the reason if it has none; one of both is ''."""
    try:
        return to_json(location.value), ''
    except Refused as refused:
        return '', str(refused)
