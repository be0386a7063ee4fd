"""Locations that a getter and a setter of the user read and write (section IV-A of the paper)."""

from typing import Any, Callable, Optional, Tuple

from rosslt import values
from rosslt.messages import Scalar
from rosslt.node.json_scalars import Refused, to_json
from rosslt.node.locations.call_sites import CallSite
from rosslt.node.locations.location import Location
from rosslt.node.locations.mutex import change_lock_released


class ExternalLocation(Location):
    """A location outside of the code, in a file for example, that two functions of the user read and write.

    Args:
        value: returned by the getter just now; its type is the location's.
        getter: returns the value.
        setter: takes a new value; what it raises is the reason of a refusal. None: read-only.

    Attributes:
        row: as of a Location; it may change with the file.
    """

    __slots__ = ('_getter', '_setter', '_reading', 'row')
    row_holds_none = True

    def __init__(
        self,
        identity: str,
        name: str,
        site: CallSite,
        value: Scalar,
        getter: Callable[[], Any],
        setter: Optional[Callable[[Any], None]],
        read_only: bool = False,
        **limits: Any,
    ) -> None:
        self._getter, self._setter = getter, setter
        self._reading: Any = None
        self.row = ''
        super().__init__(identity, name, site, _scalar(value), read_only=read_only or setter is None, **limits)

    @property
    def value(self) -> Scalar:
        try:
            with change_lock_released():
                value = self._getter()
            value = _scalar(value)
            to_json(value)
        except Exception as error:  # the user's function: any exception is its fault
            why = str(error) if isinstance(error, Refused) else f'{type(error).__name__}: {error}'
            raise Refused(f'the getter of {self.name} fails: {why}') from error
        return value

    @property
    def tracked(self) -> Any:
        return self._reading_of(_scalar(self._getter()))

    def _reading_of(self, value: Scalar) -> Any:
        reading = self._reading
        if reading is None or values.untracked(reading) != value or type(values.untracked(reading)) is not type(value):
            reading = self._reading = values.track(value, self.source)
        return reading

    def name_node(self, node: str) -> None:
        super().name_node(node)
        self._reading = None

    def set_outside(self, value: Scalar) -> Tuple[Scalar, Scalar]:
        old = self.value
        self._set(value)
        try:
            return old, self.value
        except Refused:
            self._set(old)
            raise

    def _set(self, value: Scalar) -> None:
        if self._setter is None:
            raise Refused(f'{self.name} has no setter')
        try:
            with change_lock_released():
                self._setter(value)
        except values.Error as error:  # an error of rosslt already has a complete text
            raise Refused(str(error)) from error
        except Exception as error:  # the user's function: any exception is a refusal
            raise Refused(f'{type(error).__name__}: {error}') from error

    def put(self, value: Scalar) -> None:
        self._reading_of(value)


def _scalar(value: Scalar) -> Scalar:
    """A value that a getter gives, without provenance.

    Raises:
        TypeError: it is not a scalar.
    """
    plain = values.plain_scalar(value)
    if plain is None:
        raise TypeError(f'{value!r:.200} is not a float, int, str or bool')
    return plain
