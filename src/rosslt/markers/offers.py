"""The choices that people have for the things of a scene, in a menu of RViz or on a page, and the texts for them."""

from typing import Any, Collection, List, NamedTuple, Optional, Sequence, Set, Tuple

import numpy
import rospy

from rosslt import files, node, values
from rosslt.markers.describing import Descriptions
from rosslt.markers.drags.scene_drags import Drags
from rosslt.markers.scene.handle import Handle
from rosslt.markers.scene.scene import Scene

HEADING = 'A drag changes'
FREE = 'Move the body freely'
HOLD = 'Hold in place while others are dragged'
UNDO = 'Undo the last drag'
ROW = 'Row'

#: {title: what is done with the row of a list that a thing comes from}.
ROW_OPERATIONS = {
    'Duplicate': files.DUPLICATE,
    'Delete': files.DELETE,
    'Move up': files.UP,
    'Move down': files.DOWN,
}

#: How long a node may take to answer what is asked of a row, in seconds.
TIMEOUT = 2.0

#: A small change, relative to the size of the value.
NUDGE = 1e-3


class Choice(NamedTuple):
    """A choice of what a drag changes.

    Attributes:
        source: what is chosen, None for the default.
        changed: the sources that a drag changes if nothing else is chosen.
    """

    source: Optional[values.Source]
    changed: List[values.Source]


class Offers(NamedTuple):
    """The choices for the things of a scene.

    Attributes:
        scene: has the things.
        drags: changes what is chosen, and undoes.
        descriptions: says what sources are called and where they are.
    """

    scene: Scene
    drags: Drags
    descriptions: Descriptions

    def choices(self, handle: Handle) -> List[Choice]:
        """The sources that a drag of a thing may change, the default first; none if it changes nothing."""
        fixed: Collection[values.Source] = ()
        if not handle.takes_restart:
            fixed = self.descriptions.fixed(values.sources(handle.tracked))
        held = self.descriptions.held(handle.tracked, self.scene.shared(handle))
        choices = choices_of(handle.asked(self.descriptions.can_change), fixed, held)
        return [choice for choice in choices if choice.changed]

    def can_change(self, handle: Handle) -> bool:
        """True if a drag of a thing can change what it comes from, as far as known."""
        return handle.takes_restart or self.descriptions.can_change(handle.tracked)

    def title(self, choice: Choice) -> str:
        """The text of a choice."""
        return ', '.join(map(self.descriptions.one, choice.changed))

    def is_chosen(self, handle: Handle, choice: Choice) -> bool:
        """True if drags of a thing change what a choice says."""
        chosen = self.drags.chosen_for(handle)
        return choice.source in chosen if choice.source is not None else not chosen

    def choose(self, handle: Handle, source: Optional[values.Source]) -> None:
        """Have drags of a thing change a source as well, or no more if they do; None for the default alone."""
        chosen = self.drags.chosen_for(handle) if source is not None else ()
        if source in chosen:
            self.drags.chosen[handle.name] = tuple([one for one in chosen if one != source])
        else:
            self.drags.chosen[handle.name] = () if source is None else together(handle.tracked, chosen, source)

    def rows(self, choices: Sequence[Choice]) -> List[Tuple[str, values.Source]]:
        """(title, a number of it) of each row of a table that has numbers which a drag of a thing changes by default.

        The title is the name of that number.

        Args:
            choices: those of the thing.
        """
        found = self.descriptions.rows(choices[0].changed) if choices else []
        return [(self.descriptions.name(source), source) for source in found]

    def edit_row(self, name: str, source: values.Source, operation: str) -> None:
        """Do something with the row of a number, in its file, and say at a handle what was done, or why it is refused.

        It waits for the node that has the number.

        Args:
            name: of the handle.
            source: the number.
            operation: one of `files.OPERATIONS`.
        """
        try:
            text = node.edit_row(node.directory(), source, operation, TIMEOUT)
            rospy.loginfo('%s: %s', name, text)
        except files.FileError as error:
            text = f'nothing is written: {error.brief}'
            rospy.logwarn('%s: nothing is written: %s', name, error)
        except node.ChangeRejected as error:
            text = str(error)
            rospy.logwarn('%s: %s', name, text)
        except node.SourceUnreachable as error:
            text = f'cannot reach {source.node}: {error}'
            rospy.logwarn('%s: %s', name, text)
        handle = self.scene.handle(name)
        if handle is not None:
            self.scene.say(handle, text)

    def is_in_place(self, name: str) -> bool:
        """True if a thing is held in place while others are dragged."""
        return name in self.drags.in_place

    def set_in_place(self, name: str, is_in_place: bool) -> None:
        """Hold a thing in place while others are dragged, from their next drag on, or no more.

        Args:
            name: of the handle.
        """
        (self.drags.in_place.add if is_in_place else self.drags.in_place.discard)(name)

    def can_be_free(self, handle: Handle) -> bool:
        """True if a body can move in all three directions, and so in the plane of the screen too."""
        return all(handle.motions(self.descriptions.can_change).axes)


def choices_of(
    tracked: Sequence[Any],
    read_only: Collection[values.Source],
    held: Collection[values.Source] = (),
) -> List[Choice]:
    """The choices if a drag changes tracked values, the default first, which leaves what is held."""
    can = [source for source, slopes in values.slopes(list(tracked)).items() if source not in read_only and any(slopes)]
    default = default_sources(tracked, [*read_only, *held]) or can
    # Choosing a source makes a difference only if a value has several.
    has_several = any(len([source for source in can if source in values.sources(value)]) > 1 for value in tracked)
    others = [source for source in can if has_several and [source] != default]
    return [Choice(None, default)] + [Choice(source, [source]) for source in others]


def together(
    tracked: Sequence[Any], chosen: Sequence[values.Source], source: values.Source
) -> Tuple[values.Source, ...]:
    """The sources that are chosen with one more: those chosen last first, as far as each of them moves tracked values
    in a way of its own. Of two that do the same, a drag would change one."""
    slopes = values.slopes(list(tracked))
    kept = [source]
    for earlier in reversed(chosen):
        ways = [slopes[one] for one in (earlier, *kept)]
        if numpy.linalg.matrix_rank(ways) == len(ways):
            kept.insert(0, earlier)
    return tuple(kept)


def default_sources(tracked: Sequence[Any], read_only: Collection[values.Source] = ()) -> List[values.Source]:
    """The sources that a drag changes if none has been chosen, in order of appearance.

    Found by asking for a little change of each of the tracked values.
    """
    numbers = [value for value in tracked if not isinstance(value, str)]
    present = values.source_values(numbers)
    found: Set[values.Source] = set()
    for index in range(len(numbers)):
        targets = list(map(float, numbers))
        targets[index] += NUDGE * max(1.0, abs(targets[index]))
        try:
            found.update(values.continued(numbers, targets, present, read_only=read_only))
        except values.NotInvertible:
            found.update(values.nearest(numbers, targets, read_only=read_only)[0])
    return [source for source in values.sources(tracked) if source in found]
