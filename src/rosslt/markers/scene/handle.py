"""Handles, as views and drags know them."""

from typing import Any, Callable, Hashable, Iterable, List, NamedTuple, Optional, Tuple

from visualization_msgs.msg import Marker

from rosslt import values
from rosslt.markers.geometry import (
    PoseTuple,
    Rotation,
    Vector,
    normalized,
    onto,
    product,
    turn_without_noise,
    without_noise,
)
from rosslt.markers.scene.basis import Basis

#: The size of arrows and rings relative to the thing that they surround, so that they stand outside it: RViz begins
#: arrows at half of that.
CONTROL_SCALE = 1.5

#: The levels of the handles of a thing, the outermost first.
BODY, POINTS, SIZES = range(3)

#: A flag for each of x, y and z.
Axes = Tuple[bool, bool, bool]


class Settings(NamedTuple):
    """The settings of all handles, which a user chooses.

    Attributes:
        is_planar: whether things move in x and y and turn around z only (2D).
        ball_size: the diameter of the balls on what has no size of its own, in metres.
        draws_all: whether the view has to draw every marker itself, also those that RViz shows without its help.
    """

    is_planar: bool = False
    ball_size: float = 0.2
    draws_all: bool = False


class Ring(NamedTuple):
    """A way to turn a thing.

    Attributes:
        name: unique among the rings of the thing.
        direction: the axis that it turns around, of length 1.
        is_in_frame: whether the axis is one of the frame, or of the thing itself, with which it turns.
    """

    name: str
    direction: Vector
    is_in_frame: bool = True

    def orientation(self, rotation: Rotation) -> Rotation:
        """The rotation that turns the x axis of the frame onto its axis, given how the thing is turned."""
        upright = onto(self.direction)
        return upright if self.is_in_frame else product(rotation, upright)


class Motions(NamedTuple):
    """The ways in which a thing can be moved.

    Attributes:
        axes: along which of x, y and z.
        is_in_frame: whether these are axes of the frame, or of the thing itself, as it is turned.
        arrows: which of them have arrows beside the body.
        rings: the ways to turn it, as it is turned now.
        is_button: whether its body cannot be moved, and a click on it selects its thing, which can.
        is_stuck: whether nothing of its thing can be moved.
    """

    axes: Axes
    is_in_frame: bool = False
    arrows: Axes = (False, False, False)
    rings: Tuple[Ring, ...] = ()
    is_button: bool = False
    is_stuck: bool = False

    @property
    def are_any(self) -> bool:
        """True if it can be moved or turned."""
        return any(self.axes) or bool(self.rings)

    def without_controls(self, can_thing_move: bool) -> 'Motions':
        """Return a copy of which only the body can be grabbed.

        Args:
            can_thing_move: whether any handle of its thing can be moved.
        """
        is_button = can_thing_move and not any(self.axes)
        return self._replace(arrows=(False, False, False), rings=(), is_button=is_button)

    def of_body(self, is_free: bool) -> List[int]:
        """The axes that a grabbed body moves along: 0, 1 and 2 for x, y and z.

        A mouse moves a body that can go every way in the plane of x and y.

        Args:
            is_free: whether it moves in the plane of the screen instead: all three axes.
        """
        axes = [axis for axis in range(3) if self.axes[axis]]
        return axes if len(axes) < 3 or is_free else [0, 1]


#: Tells of a tracked value whether it has a source that takes changes.
CanChange = Callable[[Any], bool]

#: Tells of a source how willingly it is changed if several could be: 0 first.
RankOf = Callable[[values.Source], int]


class Limited(NamedTuple):
    """A number that a drag leaves within its limits, as the position of a joint before a link that is pulled.

    Attributes:
        name: for people.
        value: tracked, or plain.
        lower, upper: its limits; infinite if there are none.
    """

    name: str
    value: Any
    lower: float
    upper: float


class Handle:
    """Something that can be dragged. It is made anew of every message, so that its values have their latest provenance.

    Args:
        name: unique, and the same for the same thing in the next message.
        frame: the frame that the pose is in.
        pose: where it stands.
        size: how large it is, in metres.
        draw_key: all that its drawing depends on, except its pose and its motions.
        numbers: those that a drag can change, as far as they are tracked.
        shapes: makes the Markers to grab, posed relative to the handle.
        rank: of several handles that would stand on one thing, those of the lowest rank stay.
        thing: the name of the thing that it is a part of; by default it is a thing by itself.

    Attributes:
        tracked: the tracked values that a drag can change.
        basis: what their provenance comes from if nobody tracks the node that sends them; else None.
    """

    __slots__ = ('basis', 'draw_key', 'frame', 'name', 'pose', 'rank', 'shapes', 'size', 'thing', 'tracked')

    #: Whether it is the body of its thing, or one of its points or sizes.
    level = BODY

    #: Whether its shapes are the thing itself, which RViz does not show.
    draws_thing = False

    #: Whether a change of its numbers has a node started again: then they are changed once, when a hand lets it go.
    takes_restart = False

    #: What its drags leave within limits.
    limits: Tuple[Limited, ...] = ()

    #: The tracked or plain x, y and z where it stands, in its frame; None if it is not a position.
    position: Optional[Tuple[Any, ...]] = None

    def __init__(
        self,
        name: str,
        frame: str,
        pose: PoseTuple,
        size: float,
        draw_key: Hashable,
        numbers: Iterable[Any],
        shapes: Callable[[], List[Marker]],
        rank: int = 0,
        thing: str = '',
    ) -> None:
        self.name, self.frame, self.pose, self.size, self.draw_key, self.rank = name, frame, pose, size, draw_key, rank
        self.thing = thing or name
        self.basis: Optional[Basis] = None
        self.tracked, self.shapes = [value for value in numbers if has_source(value)], shapes

    def wanted(self, pose: PoseTuple, moved: bool, turned: bool) -> Tuple[List[Any], List[float]]:
        """The targets of a drag to a pose.

        Args:
            pose: where the handle has been dragged to.
            moved, turned: whether the drag has changed the position, and the orientation.

        Returns:
            ([tracked value], [what it should become]).
        """
        raise NotImplementedError

    def settled(self, start: PoseTuple, pose: PoseTuple, noise: float) -> PoseTuple:
        """A reported pose whose unchanged coordinates are exactly those of the start: RViz reports all of them, in 32
        bits.

        Args:
            start: where the hand took hold of it.
            noise: the rounding error of 32 bits, relative.
        """
        x, y, z = without_noise(start[:3], pose[:3], noise)
        rotation = (start[3], start[4], start[5], start[6])
        return (x, y, z, *turn_without_noise(rotation, normalized(*pose[3:]), noise))

    def asked(self, can_change: CanChange) -> List[Any]:
        """Return the tracked values that a drag may ask to become others.

        Args:
            can_change: as in `motions`.
        """
        del can_change
        return self.tracked

    def turn(self, pose: PoseTuple, near: Optional[float] = None) -> float:
        """Return the angle of a pose around its only axis, in radians; it can turn more than once around.

        Args:
            near: of the turns that look alike, the one nearest to this is meant; by default nearest to the present one.
        """
        return 0.0

    @property
    def whole(self) -> str:
        """The name of what moves as one with it, as all links of a robot; its own name by default."""
        return self.name

    def limited(self, targets: List[float], turn: float) -> Tuple[List[float], str]:
        """The targets of a drag within the limits that the thing has, whatever its numbers come from.

        Args:
            targets: as `wanted` gives them, at least one.
            turn: how far the drag has turned it, as in `turn`.

        Returns:
            The targets, and what to tell a person of the limit that was met, '' if there is none.
        """
        return targets, ''

    def motions(self, can_change: CanChange, rank_of: Optional[RankOf] = None) -> Motions:
        """The ways in which it can be moved.

        Args:
            can_change: tells which sources take changes.
            rank_of: given if numbers that only fill their fields are to give way, as `fillers` says.
        """
        raise NotImplementedError


def has_source(value: Any) -> bool:
    """True for a tracked value."""
    return type(value) is not float and values.is_tracked(value)
