"""The choices that people have for the things of a scene, in a menu of RViz or on a page, and the texts for them."""

from typing import Any, Dict, List, NamedTuple, Optional

from rosslt import values
from rosslt.markers.describing import Descriptions
from rosslt.markers.drags.choices import Choice, choices_of
from rosslt.markers.drags.drags import Drags
from rosslt.markers.scene.handle import Handle
from rosslt.markers.scene.scene import Scene

HEADING = 'A drag changes'
FREE = 'Move the body freely'
UNDO = 'Undo the last drag'


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
        """The sources that a drag of a thing may change, the default first."""
        return choices_of(handle.tracked, self.descriptions.read_only(values.sources(handle.tracked)))

    def title(self, choice: Choice, present: Dict[values.Source, Any]) -> str:
        """The text of a choice, with {Source: its value}."""
        return self.descriptions.several(choice.changed, present)

    def chosen(self, name: str, choices: List[Choice]) -> Optional[values.Source]:
        """The source that has been chosen for a thing, None for the default; also where the choice is there no more."""
        chosen = self.drags.chosen.get(name)
        return chosen if chosen in [choice.source for choice in choices] else None

    def choose(self, name: str, source: Optional[values.Source]) -> None:
        """Have drags of a thing change a source, None for the default."""
        self.drags.chosen[name] = source

    def can_be_free(self, handle: Handle) -> bool:
        """True where a body can move in all three directions, and so in the plane of the screen too."""
        return all(handle.motions(self.descriptions.can_change).axes)
