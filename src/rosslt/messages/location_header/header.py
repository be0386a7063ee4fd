"""The paper's own header, `rosslt_msgs/LocationHeader`, for a bridge to the C++ library (paper, section IV.B).

It names fields by paths (`position/x`, `points/3/x`), and for each the source's node and id and an expression in
reverse Polish notation, which starts with the source's value on the stack: `2;*;1.5;+;`. Any objects with these
attributes will do, those of rclpy for example. It has one source a field, arithmetic and sines; what it cannot express
comes to it as what the paper makes of it: the left-most source, everything else as a constant.
"""

from typing import Dict, List, NamedTuple, Tuple

from rosslt.values import Source

ID_LIMIT = 1 << 31
"""Ids of the paper's header are smaller: int32."""

TO_ROS2 = {'secs': 'sec', 'nsecs': 'nanosec'}
"""The parts of a time have other names in ROS 2."""

FROM_ROS2 = {new: old for old, new in TO_ROS2.items()}

FUNCTIONS = ('sin', 'cos', 'asin', 'acos')
"""What the C++ library has beside + - * / and swap."""


class Location(NamedTuple):
    """The provenance of one field, as `rosslt_msgs/Location`."""

    source_node: str
    location_id: int
    expression: str


class LocationHeader(NamedTuple):
    """The provenance of a message, as `rosslt_msgs/LocationHeader`: as many paths as locations."""

    paths: List[str]
    locations: List[Location]


class PaperIds:
    """Gives locations ids of 31 bits and remembers them: a bridge has one for all messages."""

    def __init__(self) -> None:
        self._numbers: Dict[Source, int] = {}
        self._sources: Dict[Tuple[str, int], Source] = {}

    def number(self, source: Source) -> int:
        """The id of a source in the paper's header: the source's own where that is small enough."""
        number = self._numbers.get(source)
        if number is None:
            number = source.location_id % ID_LIMIT
            while (source.node, number) in self._sources:
                number = (number + 1) % ID_LIMIT
            self._numbers[source] = number
            self._sources[source.node, number] = source
        return number

    def source(self, node: str, number: int) -> Source:
        """The source that has an id in the paper's header; a new one where it comes from the C++ side."""
        source = self._sources.get((node, number))
        if source is None:
            source = Source(node, number)
            self._sources[node, number] = source
            self._numbers[source] = number
        return source
