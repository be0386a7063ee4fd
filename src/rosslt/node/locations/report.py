"""Locations as messages."""

import os
from typing import Dict, Optional, Sequence, Tuple

from rosslt import msg
from rosslt.messages import Scalar
from rosslt.node.json_scalars import Refused, to_json
from rosslt.node.locations.location import Location, ParameterLocation
from rosslt.node.memory.plain_copies import PLAIN_COPIES
from rosslt.node.memory.remembered import MEMORY


def why_at_next_start(locations: Sequence[Location]) -> Dict[Location, str]:
    """Why a change does nothing before the node starts again, as a sentence without its subject, of those locations
    of which that holds."""
    read_once = [location for location in locations if not location.is_read_again()]
    kept = MEMORY.kept([location.source for location in read_once]) if read_once else ()
    return {one: _why(one) for one in read_once if one.source not in kept}


def _why(location: Location) -> str:
    takers = PLAIN_COPIES.takers_of(location.source)
    rest = f', but for {" and ".join(takers)}' if takers else ''
    when = f'at the next start, or when {location.place} runs again'
    return f'takes effect {when}: nothing that the node keeps came of it{rest}'


def described(location: Location, lock: str = '', at_next_start: str = '') -> msg.Location:
    """A location as a message; one that is locked counts as read-only, so that other sources are changed instead.

    Args:
        lock: by whom it is locked, and why; '' if it is not.
        at_next_start: as `why_at_next_start` says.
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
        plain_copies=_plain_copies(location),
        remembered=location.remembered,
        weight=location.weight or 0.0,
        rank=location.rank,
        row=location.row,
    )


def _plain_copies(location: Location) -> str:
    """What takes a change at the next start only, as a sentence; '' if nothing, or if the node looks for changes."""
    is_polled = isinstance(location, ParameterLocation) and location.is_polled
    takers = [] if location.changed or is_polled else PLAIN_COPIES.takers_of(location.source)
    told = []
    if takers:
        takes, runs = ('take', 'those lines run') if takers[1:] else ('takes', 'that line runs')
        told.append(f'{" and ".join(takers)} {takes} it at the next start, or when {runs} again')
    if location.source in MEMORY.held_back and not any(taker.startswith('numpy.') for taker in takers):
        told.append('an array whose length would change takes it at the next start, or when its length is as before')
    return '; '.join(told)


def _value_or_fault(location: Location) -> Tuple[str, str]:
    """The value of a location, and the reason if it has none; one of both is ''."""
    try:
        return to_json(location.value), ''
    except Refused as refused:
        return '', str(refused)
