"""The location of a ROS parameter that another process reads, which has no locations of its own."""

from typing import Protocol, Tuple

from rosslt.messages import Scalar
from rosslt.node.json_scalars import Refused
from rosslt.node.locations.call_sites import CallSite
from rosslt.node.locations.location import Defaults, Location, ParameterLocation


class Reader(Protocol):
    """A process that reads parameters."""

    def take(self, location: Location, value: Scalar) -> None:
        """Take a new value, before it is in force.

        Raises:
            ValueError: it is not taken, as the text says.
        """

    def changed(self) -> None:
        """Follow values that were taken and are in force; called in a thread of its own."""

    def effect(self, name: str) -> str:
        """How a change of a parameter takes effect, as `takes effect ...`; '' if it does so at once."""


class OthersParameter(ParameterLocation):
    """The location of a scalar in a ROS parameter that another process reads."""

    __slots__ = ('_reader',)

    def __init__(self, name: str, site: CallSite, value: Scalar, defaults: Defaults, reader: Reader) -> None:
        super().__init__(name, site, value, defaults)
        self._reader = reader
        self.changed = (reader.changed,)

    @property
    def effect(self) -> str:
        return self._reader.effect(self.name)

    def is_read_again(self) -> bool:
        return not self.effect

    def set_outside(self, value: Scalar) -> Tuple[Scalar, Scalar]:
        if self.is_other(value):
            try:
                self._reader.take(self, value)
            except ValueError as error:
                raise Refused(str(error)) from None
        return self.value, value


class RobotNumber(OthersParameter):
    """The location of a number in the text of a robot (URDF), which another process reads.

    The number is not sent to the master by itself, so that any finite one can be.
    """

    __slots__ = ()

    def checked(self, value: object) -> Scalar:
        return Location.checked(self, value)
