"""Which handles a view draws, and how: a thing that was clicked has arrows and rings, others have none."""

from typing import Dict, FrozenSet, List, NamedTuple, Optional

from rosslt.markers.scene.handle import BODY, SIZES, Handle, Motions

#: A scene of up to so many things is drawn with all handles.
FEW = 3


class Selection:
    """What is drawn of the handles of a scene.

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

    @property
    def rule(self) -> 'Rule':
        """All that decides which handles are drawn, except the other handles of their things."""
        return Rule(self.shows_all, self.things, len(self._things) <= FEW)

    def put(self, handle: Handle, motions: Motions) -> List[str]:
        """Note how a handle can be moved; gives the names of other handles that may be drawn or not by that."""
        parts = self._things.setdefault(handle.thing, {})
        before = _outermost(parts), _can_move(parts)
        parts[handle.name] = _Part(handle.level, motions.are_any)
        is_as_before = (_outermost(parts), _can_move(parts)) == before
        return [] if is_as_before else [name for name in parts if name != handle.name]

    def drop(self, handle: Handle) -> List[str]:
        """Forget a handle; gives names as in `put`."""
        parts = self._things.get(handle.thing, {})
        before = _outermost(parts), _can_move(parts)
        parts.pop(handle.name, None)
        if not parts:
            self._things.pop(handle.thing, None)
        return [] if (_outermost(parts), _can_move(parts)) == before else list(parts)

    def drawn(self, handle: Handle, motions: Motions) -> Optional[Motions]:
        """The motions that a handle is drawn with; None if it is not drawn.

        A thing that is not selected shows only one level of handles: its body, or its points if the body cannot be
        moved, or its sizes if it has neither.
        """
        parts = self._things[handle.thing]
        can_move = _can_move(parts)
        if not self.is_open(handle):
            if handle.level > _outermost(parts):
                return None
            motions = motions.without_controls(can_move)
        return motions._replace(is_stuck=not can_move)

    def is_open(self, handle: Handle) -> bool:
        """Return whether the thing of a handle shows all its handles."""
        rule = self.rule
        return rule.shows_all or rule.are_few or handle.thing in rule.things


class Rule(NamedTuple):
    """Attributes: shows_all, things: as in Selection; are_few: whether there are so few things that all show all."""

    shows_all: bool
    things: FrozenSet[str]
    are_few: bool


class _Part(NamedTuple):
    """A handle of a thing: its level, and whether it can be moved."""

    level: int
    can_move: bool


def _can_move(parts: Dict[str, _Part]) -> bool:
    return any(part.can_move for part in parts.values())


def _outermost(parts: Dict[str, _Part]) -> int:
    """The level of the body if it can be moved, else that of movable points, else the lowest level."""
    grabbed = [part.level for part in parts.values() if part.can_move and part.level < SIZES]
    return min(grabbed or [part.level for part in parts.values()], default=BODY)
