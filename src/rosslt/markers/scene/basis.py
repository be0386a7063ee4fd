"""What a handle on a message of a node that nobody tracks has its provenance from: what was learned of the node."""

import time
from typing import TYPE_CHECKING, Any, Mapping, NamedTuple

from rosslt import node, values

if TYPE_CHECKING:
    from rosslt.models import Following, Moment  # which nobody needs of whose nodes nothing was learned


class Basis(NamedTuple):
    """A message of such a node, and how its numbers follow the inputs of the node.

    Attributes:
        following: its numbers as functions of the inputs.
        moment: the message, and the inputs that it was made of.
        publisher: the node.
        learned_at: when that was learned, in seconds since 1970.
    """

    following: 'Following'
    moment: 'Moment'
    publisher: str
    learned_at: float

    @property
    def text(self) -> str:
        """What it is, as a part of a sentence."""
        return f'learned of {self.publisher}, {node.age_text(max(0.0, time.time() - self.learned_at))} ago'

    @property
    def is_settled(self) -> bool:
        """Whether the message follows no inputs but the present ones."""
        return self.moment.is_settled

    def begin(self) -> None:
        """A hand takes hold: the slopes are those that were learned."""
        self.following.begin()

    def correct(self) -> None:
        """Correct the slopes, of later messages, by this one.

        Raises:
            values.NotInvertible: the node does not do what was learned.
        """
        self.following.correct(self.moment)

    def check(self, after: Mapping[values.Source, Any]) -> None:
        """Check the inputs that new values of sources would make.

        Raises:
            values.NotInvertible: one would be beyond what its field holds, or where it was learned.
        """
        try:
            self.following.check(self.moment, after, node.check_number)
        except ValueError as error:
            raise values.NotInvertible(str(error)) from None
