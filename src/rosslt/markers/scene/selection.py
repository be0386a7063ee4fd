"""Chooses the handles that a view draws, and how: a thing that was clicked has arrows and rings, others have none.

A thing whose node moves it in x and y, as a robot, while no drag can, has nothing to grab for its height and its sizes:
it would lie in front of the goal that it has come to. They have handles if all handles are shown.
"""

from typing import Dict, FrozenSet, List, NamedTuple, Optional, Set

from rosslt.markers.scene.handle import BODY, SIZES, Handle, Motions

#: The motions of a thing that nothing moves.
STUCK = Motions((False, False, False), is_stuck=True)

#: A scene of up to so many things is drawn with all handles.
FEW = 3


class Selection:
    """The drawn parts of the handles of a scene.

    Args:
        shows_all: whether all handles are drawn with all controls, also those of numbers that only fill a field.

    Attributes:
        shows_all: the same.
        things: the names of those that were clicked last: one, or one for each of several people.
    """

    def __init__(self, shows_all: bool) -> None:
        self.shows_all = shows_all
        self.things: FrozenSet[str] = frozenset()
        self._things: Dict[str, Dict[str, _Part]] = {}  # by the names of things, and of their handles
        self._have_moved: Set[str] = set()  # the names of things that have been elsewhere in x and y

    @property
    def rule(self) -> 'Rule':
        """All that decides which handles are drawn, except the other handles of their things."""
        return Rule(self.shows_all, self.things, len(self._things) <= FEW)

    def put(self, handle: Handle, motions: Motions) -> List[str]:
        """Note how a handle can be moved; gives the names of other handles that may be drawn or not by that."""
        before = self._seen(handle.thing)
        part = _Part(handle.level, motions.are_any, _is_sideways(handle, motions))
        self._things.setdefault(handle.thing, {})[handle.name] = part
        return [name for name in self._differing(handle.thing, before) if name != handle.name]

    def note_place(self, before: Handle, handle: Handle) -> List[str]:
        """Note where a handle is now, and where it was before; gives names as in `put`, its own among them."""
        thing = handle.thing
        if handle.level != BODY or thing in self._have_moved or before.pose[:2] == handle.pose[:2]:
            return []
        seen = self._seen(thing)
        self._have_moved.add(thing)
        return self._differing(thing, seen)

    def drop(self, handle: Handle) -> List[str]:
        """Forget a handle; gives names as in `put`."""
        before = self._seen(handle.thing)
        parts = self._parts(handle.thing)
        parts.pop(handle.name, None)
        if not parts:
            self._things.pop(handle.thing, None)
            self._have_moved.discard(handle.thing)
        return self._differing(handle.thing, before)

    def drawn(self, handle: Handle, motions: Motions) -> Optional[Motions]:
        """The motions that a handle is drawn with; None if it is not drawn.

        A thing that is not selected shows only one level of handles: its body, or its points if the body cannot be
        moved, or its sizes if it has neither.
        """
        outermost, can_move = self._seen(handle.thing)
        if not self.is_open(handle):
            if handle.level > outermost:
                return None
            motions = motions.without_controls(can_move)
        return motions if can_move else STUCK

    def is_open(self, handle: Handle) -> bool:
        """Return whether the thing of a handle shows all its handles."""
        rule = self.rule
        return rule.shows_all or rule.are_few or handle.thing in rule.things

    def _parts(self, thing: str) -> Dict[str, '_Part']:
        return self._things.get(thing, {})

    def _seen(self, thing: str) -> '_Seen':
        parts = self._parts(thing).values()
        grabbed = [part.level for part in parts if part.can_move and part.level < SIZES]
        is_driven = thing in self._have_moved and not self.shows_all
        can_move = any(part.is_sideways if is_driven else part.can_move for part in parts)
        return _Seen(min(grabbed or [part.level for part in parts], default=BODY), can_move)

    def _differing(self, thing: str, before: '_Seen') -> List[str]:
        """The names of the handles of a thing if they may be drawn in another way than before."""
        return [] if self._seen(thing) == before else list(self._parts(thing))


class Rule(NamedTuple):
    """Attributes: shows_all, things: as in Selection; are_few: whether there are so few things that all show all."""

    shows_all: bool
    things: FrozenSet[str]
    are_few: bool


class _Part(NamedTuple):
    """A handle of a thing.

    Attributes:
        level: as that of the handle.
        can_move: whether it can be moved.
        is_sideways: whether that is more than a change of the height, or of a size.
    """

    level: int
    can_move: bool
    is_sideways: bool


class _Seen(NamedTuple):
    """The attributes of a thing that decide how its handles are drawn.

    Attributes:
        outermost: the level of the body if it can be moved, else that of movable points, else the lowest level.
        can_move: whether any of its handles can be moved.
    """

    outermost: int
    can_move: bool


def _is_sideways(handle: Handle, motions: Motions) -> bool:
    if handle.level != BODY:
        return handle.level != SIZES and motions.are_any
    return any(motions.axes[:2]) or bool(motions.rings) or (motions.axes[2] and not motions.is_in_frame)
