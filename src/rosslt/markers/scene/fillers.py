"""Numbers of a pose that are there only because a field, or an argument, has to have one.

The rule: they make no arrow and no ring if other numbers of the same thing do the same, or if what they do cannot be
seen. The pose of a line that is drawn from tracked points is 0, 0, 0 and the identity; a pan-tilt unit is turned by
`quaternion_from_euler(0.0, tilt, pan)`; a text has an orientation, and faces the eye all the same.
"""

from typing import Any, Dict, Mapping, Sequence, TypeVar

from rosslt import node, values
from rosslt.markers.scene.handle import RankOf, has_source

Way = TypeVar('Way')


def fills(numbers: Sequence[Any], neutral: Sequence[float]) -> bool:
    """Return whether the numbers of a position, or of an orientation, only fill their fields.

    They do if the thing is neither moved nor turned, and each number is a source itself, or plain: a computed number
    may be anything the next time.

    Args:
        neutral: the numbers of a thing that is not moved, or not turned.
    """
    tracked = [number for number in numbers if has_source(number)]
    return tuple(map(float, numbers)) == tuple(neutral) and values.origins(tracked) is not None


def without_fillers(
    ways: Dict[values.Source, Way], present: Mapping[values.Source, Any], rank_of: RankOf
) -> Dict[values.Source, Way]:
    """The ways to turn a thing, except by sources that only fill an argument, or give a formula its shape.

    The former are 0, and changed only after others of the ways, as nobody has given them a name. The latter are as the
    2 in `sin(yaw / 2)`, by which a node makes a quaternion of an angle that it has summed up.

    Args:
        ways: of each source that turns it, the way.
        present: the values of sources.
        rank_of: as in `Handle.motions`.
    """
    first = min(map(rank_of, ways), default=0)
    return {
        source: way
        for source, way in ways.items()
        if rank_of(source) < node.SHAPE_RANK and (present[source] != 0 or rank_of(source) <= first)
    }
