"""Choices: the sources that a drag of a handle changes, and those that a person may choose instead."""

from typing import Any, List, NamedTuple, Optional, Tuple

from rosslt import values
from rosslt.markers.drags import changes

#: Slopes below this are treated as 0.
NO_EFFECT = 1e-6


class Choice(NamedTuple):
    """An entry of the menu that selects what a drag changes.

    Attributes:
        source: what is chosen, None for the default.
        changed: the sources that a drag changes then.
    """

    source: Optional[values.Source]
    changed: List[values.Source]


def choices_of(tracked: List[Any], read_only: Tuple[values.Source, ...]) -> List[Choice]:
    """The choices where a drag changes tracked values, the default first."""
    can = [
        source
        for source, slopes in values.slopes(tracked).items()
        if source not in read_only and max(map(abs, slopes)) > NO_EFFECT
    ]
    default = changes.default_sources(tracked, read_only) or can
    # Choosing a source makes a difference only where a value has several.
    others = [
        source
        for source in can
        if [source] != default and any(len(both) > 1 and source in both for both in map(values.sources, tracked))
    ]
    return [Choice(None, default)] + [Choice(source, [source]) for source in others]
