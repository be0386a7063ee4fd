"""The interface of a handle, for views that show it and for drags."""

from typing import Any, Hashable, List, NamedTuple, Optional, Protocol, Sequence, Tuple

from rosslt import values
from rosslt.markers.geometry import PoseTuple, Vector

#: For x, y and z.
Axes = Tuple[bool, bool, bool]


class Settings(NamedTuple):
    """What a user chooses for all handles.

    Attributes:
        is_planar: whether things move in x and y and turn around z only (2D).
        ball_size: the diameter of the balls on what has no size of its own, in metres.
        draws_all: whether the view has to draw every marker itself, also those that RViz shows without its help.
    """

    is_planar: bool = False
    ball_size: float = 0.2
    draws_all: bool = False


class Motions(NamedTuple):
    """The ways in which a thing can be moved.

    Attributes:
        axes: along which of x, y and z.
        is_in_frame: whether these are axes of the frame, or of the thing itself, as it is turned.
        arrows: which of them have arrows beside the body.
        rings: (name, direction in the frame, of length 1) of each way to turn it.
    """

    axes: Axes
    is_in_frame: bool = False
    arrows: Axes = (False, False, False)
    rings: Sequence[Tuple[str, Vector]] = ()

    def of_body(self, is_free: bool) -> List[int]:
        """The axes that a grabbed body moves along: 0, 1 and 2 for x, y and z.

        A mouse moves a body that can go every way in the plane of x and y.

        Args:
            is_free: whether it moves in the plane of the screen instead: all three axes.
        """
        axes = [axis for axis in range(3) if self.axes[axis]]
        return axes if len(axes) < 3 or is_free else [0, 1]


class CanChange(Protocol):
    """Tells of a tracked value whether it has a source that takes changes."""

    def __call__(self, value: Any) -> bool: ...


class Handle(Protocol):
    """Something that can be dragged. It is made anew of every message, so that its values have their latest provenance.

    Attributes:
        name: unique, and the same for the same thing in the next message.
        frame: the frame that the pose is in.
        pose: where it stands.
        size: how large it is, in metres.
        draw_key: all that its drawing depends on: two handles of equal name and draw_key differ in their pose alone.
        rank: which one stays where several handles would stand on one thing: the one of the lowest rank.
    """

    name: str
    frame: str
    pose: PoseTuple
    size: float
    draw_key: Hashable
    rank: int

    @property
    def tracked(self) -> List[Any]:
        """The tracked values that a drag can change."""
        ...

    @property
    def position(self) -> Optional[Tuple[Any, ...]]:
        """The tracked or plain x, y and z where it stands, in its frame; None where it is no position."""
        ...

    def wanted(self, pose: PoseTuple, moved: bool, turned: bool) -> Tuple[List[Any], List[float]]:
        """What a drag to a pose asks for.

        Args:
            pose: where the handle has been dragged to.
            moved, turned: whether the drag has changed the position, and the orientation.

        Returns:
            ([tracked value], [what it should become]).
        """
        ...

    def motions(self, can_change: CanChange) -> Motions:
        """The ways in which it can be moved, given which sources take changes."""
        ...

    def shapes(self) -> List[Any]:
        """The Markers to grab, posed relative to the handle."""
        ...


class View(Protocol):
    """What shows the handles of a scene; its methods are called with the scene's lock held."""

    def put(self, handle: Handle) -> None:
        """A handle is there, or has changed."""
        ...

    def drop(self, name: str) -> None:
        """A handle was removed."""
        ...

    def let_go(self, name: str) -> None:
        """A drag has ended: the handle has to be shown where the scene has it, whatever this view shows."""
        ...

    def say(self, handle: Handle, text: str) -> None:
        """Show a message at a handle."""
        ...


def has_source(value: Any) -> bool:
    """Whether a value is tracked."""
    return type(value) is not float and values.is_tracked(value)
