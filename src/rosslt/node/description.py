"""What a node reports about one of its locations."""

import os
from typing import Any

from rosslt import msg
from rosslt.node.json_scalars import to_json
from rosslt.node.locations import Location


def described(location: Location, is_locked: bool = False) -> msg.Location:
    """A location as a message; one that is locked counts as read-only, so that other sources are changed instead."""

    def text(value: Any) -> str:
        return '' if value is None else to_json(value)

    return msg.Location(
        id=location.id,
        name=location.name,
        is_named=location.is_named,
        file=os.path.realpath(location.site.file),
        line=location.site.line,
        column=location.site.column,
        type=location.type.__name__,
        value=to_json(location.value),
        literal=text(location.literal),
        minimum=text(location.minimum),
        maximum=text(location.maximum),
        read_only=location.read_only or is_locked,
        remembered=location.remembered,
        weight=location.weight or 0.0,
        rank=location.rank,
    )
