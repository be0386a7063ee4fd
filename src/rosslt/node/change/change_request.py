"""A change of sources, from its first request to its end: requested, in force, shown by messages, or taken back.

A drag and a force ask for a source again and again until all is as wanted; that is one change, which is taken back as
one. It holds the changes made so far, and is the one judge of whether a message shows them.
"""

import enum
import math
import time
from typing import Any, Dict, Mapping, Optional, Sequence, Set

import rospy

from rosslt import messages, values
from rosslt.node.change.client import (
    Asker,
    Change,
    outdated_after,
    raised_after,
    reevaluate,
    request_values,
    undo_request,
)
from rosslt.node.change.history import new_request_id
from rosslt.values import Source


class Shown(enum.Enum):
    """The state of a change that a message shows."""

    NOTHING = 'it lacks one of the changed sources'
    OLD = 'it comes from a value that a source had before'
    NEW = 'it comes from the new values'
    OTHER = 'it comes from a value that somebody else gave a source'


class ChangeRequest:
    """A request, with all that it has changed in all nodes so far.

    Args:
        timeout: how long to wait for the answers of owners, in seconds.
        asker: the requester; by default this node.

    Attributes:
        id: goes with all its steps, which are one change in the histories of the owners.
        began, requested: when the first and the latest step were requested, times of `time.monotonic`; infinite before.
        before: {Source: its value before the first step that changed it}.
        after: {Source: its value after the latest one}.
    """

    def __init__(self, timeout: float, asker: Optional[Asker] = None) -> None:
        self.id, self._timeout, self._asker = new_request_id(), timeout, asker
        self.began = self.requested = math.inf
        self.before: Dict[Source, messages.Scalar] = {}
        self.after: Dict[Source, messages.Scalar] = {}
        self._former: Dict[Source, Set[Any]] = {}  # all values before the latest one
        self._unanswered: Set[str] = set()  # nodes whose answer an interrupt has cut off: they may have changed

    def step(self, wanted: Mapping[Source, messages.Scalar]) -> Dict[Source, Change]:
        """Have owners give sources new values, all or none.

        Returns:
            {Source: Change(old, new)} of this step.

        Raises:
            ChangeRejected, SourceUnreachable: as in `request_values`. Changes that nodes have kept nevertheless belong
                to the request.
        """
        self.requested = time.monotonic()
        self.began = min(self.began, self.requested)
        self._unanswered = {source.node for source in wanted}
        try:
            changed = request_values(wanted, self._timeout, self.id, self._asker)
        except values.Error as error:
            self._unanswered = set()
            self.note(getattr(error, 'changed', {}))
            raise
        self._unanswered = set()
        self.note(changed)
        return changed

    def note(self, changed: Mapping[Source, Change]) -> None:
        """Take in what a step has changed, {Source: Change}."""
        for source, change in changed.items():
            self.before.setdefault(source, change.old)
            self.after[source] = change.new
            self._former.setdefault(source, set()).add(change.old)

    @property
    def changes(self) -> Dict[Source, Change]:
        """{Source: Change}: from before the first step to after the latest one, of those that are not as before."""
        found = {source: Change(old, self.after[source]) for source, old in self.before.items()}
        return {source: change for source, change in found.items() if not is_equal(*change)}

    @property
    def nodes(self) -> Set[str]:
        """The names of the nodes that it has asked, and that have taken it."""
        return {source.node for source in self.before}

    def shown_by(self, readings: Mapping[Source, Sequence[messages.Scalar]]) -> Shown:
        """Return the state of the change that a message shows.

        Args:
            readings: {source: its values that the message was computed from}; a counter or an integral has several.
        """
        if not self.after or not all(map(readings.get, self.after)):
            return Shown.NOTHING
        seen = [self._of_source(source, readings[source]) for source in self.after]
        return next(found for found in (Shown.OLD, Shown.OTHER, Shown.NEW) if found in seen)

    def _of_source(self, source: Source, readings: Sequence[messages.Scalar]) -> Shown:
        if any(messages.is_sent_as(self.after[source], reading) for reading in readings):
            return Shown.NEW
        former = self._former[source]
        is_old = all(any(messages.is_sent_as(value, reading) for value in former) for reading in readings)
        return Shown.OLD if is_old else Shown.OTHER

    def lost(self) -> Dict[Source, messages.Scalar]:
        """{Source: its value} of those that no longer have the requested value: an owner, or somebody else, has changed
        them since.

        Raises:
            SourceUnreachable: an owner does not answer.
        """
        given = [values.track(value, source) for source, value in self.after.items()]
        present = values.untracked(reevaluate(given, self._timeout, self._asker))
        return {source: now for source, now in zip(self.after, present) if now != self.after[source]}

    def raised(self, logged: str) -> str:
        """The exception that an owner has raised with it, with what the owner knows of where it comes from.

        Args:
            logged: what the log says of it, as `NodeErrors` has it; returned if no owner has taken anything back.
        """
        told, _ = raised_after(self.id, self.nodes, self._timeout)
        return '; '.join(f'{node} raises {what}' for node, what in told.items()) or logged

    def outdated(self) -> str:
        """Say what in the owners' memory holds results of the former values after a round; '' if nothing."""
        raised_after(self.id, self.nodes, self._timeout)
        return outdated_after(self.id, self.nodes, self._timeout)

    def take_back(self) -> str:
        """Give all sources the values that they had before; the reason if that is not done, else ''."""
        requester = rospy.get_name() if self._asker is None else self._asker.name
        nodes = {source.node for source in self.changes} | self._unanswered
        undone = undo_request(self.id, nodes, requester, self._timeout)
        if undone.changes or not undone.reasons:
            self.before, self.after, self._former = {}, {}, {}
        whys = [f'{node}: {why}' for node, why in undone.reasons.items()]
        return '; '.join(whys)


def is_equal(one: object, other: object) -> bool:
    """Return whether two values of a source are the same, and of one type."""
    return type(one) is type(other) and bool(one == other)
