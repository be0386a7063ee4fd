"""Locations as dynamic_reconfigure's messages: their descriptions, and their values.

A parameter there has the name of its location, and a group for each name of a file in which locations stand.
"""

import math
import os
from typing import Any, Dict, Iterable, List, NamedTuple, Tuple

from dynamic_reconfigure import msg

from rosslt.messages import Scalar, limits_of
from rosslt.node.json_scalars import Refused
from rosslt.node.locations.location import Location

#: The keys of a group's dictionary in dynamic_reconfigure that are not names of parameters.
RESERVED = {'groups', 'id', 'name', 'parameters', 'parent', 'state', 'type'}

#: The range of an int in dynamic_reconfigure's messages.
LOWEST, HIGHEST = limits_of('int32')

#: dynamic_reconfigure's names for the types of locations.
TYPES = {float: 'double', int: 'int', str: 'str', bool: 'bool'}

#: The id of the group that all others are in.
ROOT = 0


class Shown(NamedTuple):
    """A location as dynamic_reconfigure shows it: the name that it has there, and its value."""

    name: str
    location: Location
    value: Scalar


class Configuration:
    """The locations of a node at one moment.

    Args:
        locations: those that there are; what dynamic_reconfigure cannot show is left out.

    Attributes:
        by_name: {name in dynamic_reconfigure: Shown}.
    """

    def __init__(self, locations: Iterable[Location]) -> None:
        self.by_name: Dict[str, Shown] = {}
        files: Dict[str, List[Shown]] = {}
        found = sorted(locations, key=lambda one: (one.site.file, one.site.line, one.site.column))
        for location in found:
            value = _readable(location)
            if value is None:
                continue
            # a name that means something else in dynamic_reconfigure gets a _ behind it
            shown = Shown(location.name + '_' * (location.name in RESERVED), location, value)
            self.by_name[shown.name] = shown
            files.setdefault(os.path.basename(location.site.file), []).append(shown)
        self._groups = list(files.items())

    def values(self) -> msg.Config:
        """The present values: what is published on `parameter_updates`."""
        return self._config((shown, shown.value) for shown in self.by_name.values())

    def descriptions(self) -> msg.ConfigDescription:
        """Names, types, bounds and defaults: what is published on `parameter_descriptions`."""
        groups = [msg.Group('Default', '', [], ROOT, ROOT)]
        for index, (name, members) in enumerate(self._groups, 1):
            described = [
                msg.ParamDescription(shown.name, TYPES[shown.location.type], 0, _described(shown.location), '')
                for shown in members
            ]
            groups.append(msg.Group(name, '', described, ROOT, index))
        shown = list(self.by_name.values())
        return msg.ConfigDescription(
            groups=groups,
            max=self._config((one, _highest(one.location)) for one in shown),
            min=self._config((one, _lowest(one.location)) for one in shown),
            dflt=self._config((one, _default(one)) for one in shown),
        )

    def _config(self, values: Iterable[Tuple[Shown, object]]) -> msg.Config:
        config = msg.Config()
        lists = {
            float: (config.doubles, msg.DoubleParameter),
            int: (config.ints, msg.IntParameter),
            str: (config.strs, msg.StrParameter),
            bool: (config.bools, msg.BoolParameter),
        }
        for shown, value in values:
            members, parameter = lists[shown.location.type]
            members.append(parameter(shown.name, value))
        config.groups = [msg.GroupState('Default', True, ROOT, ROOT)]
        config.groups += [msg.GroupState(name, True, index, ROOT) for index, (name, _) in enumerate(self._groups, 1)]
        return config


def _readable(location: Location) -> Any:
    """The value of a location, None if it has none or one that dynamic_reconfigure cannot show."""
    try:
        value = location.value
    except Refused:  # others are shown all the same
        return None
    if location.type is float and type(value) is int:
        value = float(value)
    return value if type(value) is location.type and _fits(value) else None


def _fits(value: Scalar) -> bool:
    """True if a scalar can be sent: ints have 32 bits."""
    return type(value) is not int or LOWEST <= value <= HIGHEST


def _described(location: Location) -> str:
    return location.place + (', read-only' if location.read_only else '')


def _lowest(location: Location) -> Scalar:
    """The lowest value that a location takes, as dynamic_reconfigure writes it."""
    if location.type is float:
        return -math.inf if location.minimum is None else location.minimum
    if location.type is int:
        return LOWEST if location.minimum is None else max(LOWEST, math.ceil(location.minimum))
    return False if location.type is bool else ''


def _highest(location: Location) -> Scalar:
    """The highest value that a location takes, as dynamic_reconfigure writes it."""
    if location.type is float:
        return math.inf if location.maximum is None else location.maximum
    if location.type is int:
        return HIGHEST if location.maximum is None else min(HIGHEST, math.floor(location.maximum))
    return True if location.type is bool else ''


def _default(shown: Shown) -> Scalar:
    """Return the default of a field: the literal in the code if known and valid, else the present value."""
    literal = shown.location.literal
    return literal if type(literal) is shown.location.type and _fits(literal) else shown.value
