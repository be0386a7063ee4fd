"""Names of sources, and their files and lines, as people read them; and whether a drag may change them."""

import os
from typing import Any, Collection, List, Optional, Sequence, Tuple

from rosslt import node, values

#: The age of an answer at which a node is asked again, in seconds: its files may have been edited, and it started anew.
STALE_AFTER = 30.0


class Descriptions:
    """Descriptions of sources, from what this node knows of them. No method waits for an answer."""

    def __init__(self) -> None:
        self._directory = node.directory()

    @property
    def version(self) -> int:
        """A number that grows whenever something new becomes known."""
        return self._directory.version

    def look_up(self, sources: Collection[values.Source]) -> None:
        """Ask owners for unknown or outdated facts about sources, in the background."""
        self._directory.look_up(sources, STALE_AFTER)

    def name(self, source: values.Source) -> str:
        """The name of a source, else its file and line."""
        place = self._directory.of(source)
        if place is None:
            return '{} of {}'.format(source.location_id, source.node)
        return place.local_name if place.location.is_named else place.short_file

    def one(self, source: values.Source, present: Optional[Any] = None) -> str:
        """`shoulder (arm.py:48)`, and the node if more than one has such a location.

        Args:
            source: what to describe.
            present: its value, to be named, too: `shoulder = 0.4 (arm.py:48)`.
        """
        place = self._directory.of(source)
        name = '' if place is not None and not place.location.is_named else self.name(source)
        value = '' if present is None else '%.4g' % present if isinstance(present, float) else repr(present)
        text = ' = '.join(filter(None, [name, value]))
        if place is None:
            return text
        where = '{}:{}'.format(os.path.basename(place.location.file), place.location.line)
        if not place.location.is_named:
            where += ':{}'.format(place.location.column)
        if self._directory.has_twin(place):
            where += ' of ' + source.node
        return '{} ({})'.format(text, where) if text else where

    def in_full(self, source: values.Source) -> str:
        """The file of a source, with the whole path, and its name: `/home/me/arm.py:48:24, shoulder of /arm`."""
        place = self._directory.of(source)
        if place is None:
            return self.name(source)
        return '{}, {} of {}'.format(place.file, place.local_name, source.node)

    def fixed(self, sources: Collection[values.Source]) -> Tuple[values.Source, ...]:
        """Return the sources that no change moves, as far as known."""
        return tuple([source for source in sources if self.why_fixed(source)])

    def why_fixed(self, source: values.Source) -> str:
        """Say why no change moves a source, as far as known: 'takes no change' for one that refuses all, or that a
        change takes effect at the next start; '' for others."""
        place = self._directory.of(source)
        if place is None or not place.is_fixed:
            return ''
        return 'takes no change' if place.read_only else place.location.at_next_start

    def rank(self, source: values.Source) -> int:
        """Return the rank of a source: among several that could change, the lowest rank changes first. 0 if nothing is
        known of it."""
        place = self._directory.of(source)
        return 0 if place is None else place.location.rank

    def held(self, thing: Sequence[Any], shared: Sequence[Collection[values.Source]]) -> List[values.Source]:
        """The sources that stay if a thing changes, as of `Directory.held`."""
        return self._directory.held(thing, shared)

    def own_first(self, sources: Collection[values.Source]) -> List[values.Source]:
        """The sources of a thing, first those that are its own, as of `Directory.own_first`."""
        return self._directory.own_first(sources)

    def rows(self, sources: Collection[values.Source]) -> List[values.Source]:
        """A source in each row of a table that sources are in, as of `Directory.rows_of`."""
        return [place.source for place in self._directory.rows_of(sources)]

    def can_change(self, value: Any) -> bool:
        """True if a value has a source that takes changes, as far as known."""
        sources = values.sources(value)
        self.look_up(sources)
        return len(self.fixed(sources)) < len(sources)
