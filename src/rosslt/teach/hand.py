"""The hand of a device: it takes hold of a thing, moves it by the steps of the device, and lets go."""

import math
from typing import Any, Callable, List, Optional, Sequence, Set, Tuple, Union

import genpy

from rosslt.markers import HELD, Drags, Handle, Motions
from rosslt.markers.geometry import AXES, PoseTuple, Vector, normalized, product, rotate_vector
from rosslt.teach.devices import STILL, WAYS, Device, Numbers, Options, Step, Unusable
from rosslt.teach.filtering import Filter
from rosslt.teach.ghost import Ghost
from rosslt.teach.recording import Recording
from rosslt.teach.turning import rotation_of, scaled

#: The time after which a device of which nothing is heard has let go, in seconds.
SILENCE = 0.2

#: The length below which a direction lies in the span of others.
FLAT = 1e-6


class Hand:
    """A hand on one thing.

    Args:
        device: moves it.
        drags: the hands of the scene, or what records them.
        name: whose hand it is.
        options: what the user has chosen for the device.
        grasp: gives the thing, the ways in which it can be moved, and where it is shown; None if it is not.
        say: is called with what a person should know.

    Attributes:
        pose: where the hand has the thing; None if it does not hold it.
    """

    def __init__(
        self,
        device: Device,
        drags: Union[Drags, Recording, Ghost],
        name: str,
        options: Options,
        grasp: Callable[[], Optional[Tuple[Handle, Motions, PoseTuple]]],
        say: Callable[[str], None],
    ) -> None:
        self._device, self._drags, self._name, self._options = device, drags, name, options
        self._grasp, self._say = grasp, say
        self.pose: Optional[PoseTuple] = None
        self._last: Optional[Tuple[genpy.Message, float]] = None  # the last sound message, and when it was sent
        self._heard = -math.inf
        self._said: Set[str] = set()

    def take(self, message: genpy.Message, arrived: float, is_clutched: bool = True) -> None:
        """Do as a message of the device says.

        Args:
            message: of the device.
            arrived: when it came, a time of `time.monotonic`.
            is_clutched: whether a clutch is pressed; True without one.
        """
        if not (is_clutched and self._device.holds(message)):
            self.let_go()
            self._last = None
            return
        try:
            read = self._device.read(message)
            if read is not None:
                self._follow(read, arrived)
        except Unusable as error:
            self._warn(str(error))

    def expire(self, now: float) -> None:
        """Let go if the device has been silent; a message that is of no use is none."""
        if now - self._heard > SILENCE:
            self._last = None
            if self.pose is not None:
                self._say(f'{self._name} is silent')
                self.let_go()

    def let_go(self) -> None:
        """Let go of the thing, if it holds it."""
        if self.pose is not None:
            self._drags.release(self._handle.name, self._handle.frame, self.pose, self._name)
            self.pose = None
            self._said.clear()

    def _follow(self, message: genpy.Message, arrived: float) -> None:
        if not all(map(math.isfinite, self._device.numbers(message))):
            raise Unusable('a number is not finite')
        stamp = message.header.stamp.to_sec() if hasattr(message, 'header') else 0.0
        sent = stamp or arrived
        if self._last is not None and sent <= self._last[1]:
            raise Unusable('its stamp goes back' if sent < self._last[1] else 'it has been sent before')
        last, self._last, self._heard = self._last, (message, sent), arrived
        if self.pose is None or last is None:
            self._take_hold()
        else:
            self._drags.keep(self._handle.name, self._name)
            self.pose = self._moved(self.pose, last[0], message, sent - last[1])
            if not self._drags.move(self._handle.name, self._handle.frame, self.pose, self._name):
                raise Unusable('the thing is not shown any more')

    def _take_hold(self) -> None:
        found = self._grasp()
        if found is None:
            raise Unusable('the thing is not shown')
        handle, motions, pose = found
        if not self._drags.hold(handle.name, self._name, handle.frame, pose):
            raise Unusable(HELD)
        self._handle, self._motions, self.pose = handle, motions, pose
        self._begin(pose)

    def _begin(self, pose: PoseTuple) -> None:
        """Begin to move a thing from where it is."""
        self._wanted = pose[:3]  # without rounding to multiples
        self._filter = self._new_filter()

    def _new_filter(self) -> Optional[Filter]:
        is_filtered = self._device.trembles and self._options.smooth
        return Filter(self._options.smooth) if is_filtered else None

    def _moved(self, pose: PoseTuple, before: genpy.Message, now: genpy.Message, seconds: float) -> PoseTuple:
        """Return the pose to which the hand moves the thing by the next message.

        Args:
            pose: where it has had it.
            before, now, seconds: as of `Device.step`.

        Raises:
            Unusable: the message moves nothing.
        """
        step, here = self._device.step(before, now, seconds), pose[3:]
        axes = [axis for axis, is_free in zip(AXES, self._motions.axes) if is_free]
        if not self._motions.is_in_frame:
            axes = [rotate_vector(here, axis) for axis in axes]
        rings = [rotate_vector(ring.orientation(here), AXES[0]) for ring in self._motions.rings]
        allowed = self._allowed(step)
        move, turn = within(allowed.move, axes), within(allowed.turn, rings)
        for way, unit in ((step.move, 'm'), (turn, 'rad')):
            if _length(way) > self._options.max_step:
                raise Unusable(f'it leaps by more than {self._options.max_step:g} {unit}')
        if any((*allowed.move, *allowed.turn)) and not any((*move, *turn)):
            raise Unusable('the thing does not go that way, or its numbers take no change')
        if self._filter is not None:
            move, turn = self._filter.step(move, turn, seconds)
        self._wanted = _minus(self._wanted, move, -self._options.scale)
        x, y, z = self._snapped(axes) if any(move) else pose[:3]
        return (x, y, z, *normalized(*product(rotation_of(turn), here)))

    def _allowed(self, step: Step) -> Step:
        """The part of a step that the device may move."""
        x, y, z, roll, pitch, yaw = (
            one if way in self._options.only else 0.0 for way, one in zip(WAYS, (*step.move, *step.turn))
        )
        return Step((x, y, z), (roll, pitch, yaw))

    def _snapped(self, axes: Sequence[Vector]) -> Vector:
        """Return where the thing is wanted, as multiples in coordinates that may change without the others."""
        snap = self._options.snap
        x, y, z = (
            round(one / snap) * snap
            if snap and way in self._options.only and _length(_minus(axis, within(axis, axes), 1.0)) < FLAT
            else one
            for way, axis, one in zip(WAYS, AXES, self._wanted)
        )
        return x, y, z

    def _warn(self, reason: str) -> None:
        """Say once, as long as it holds, why a message moves nothing."""
        if reason not in self._said:
            self._said.add(reason)
            self._say(f'a message of {self._name} moves nothing: {reason}')


class NumbersHand(Hand):
    """A hand on numbers, each of which goes as one of the device does; the pose is those numbers."""

    _device: Numbers

    def _begin(self, pose: PoseTuple) -> None:
        self._numbers: List[float] = list(pose)  # without rounding to multiples
        self._filters = [self._new_filter() for _ in pose]

    def _moved(self, pose: PoseTuple, before: genpy.Message, now: genpy.Message, seconds: float) -> PoseTuple:
        ways = self._device.ways(before, now, seconds)
        if max(map(abs, ways)) > self._options.max_step:
            raise Unusable(f'it leaps by more than {self._options.max_step:g}')
        there: List[float] = list(pose)
        snap = self._options.snap
        for index, (way, smooth) in enumerate(zip(ways, self._filters)):
            if smooth is not None:
                (way, _, _), _ = smooth.step((way, 0.0, 0.0), STILL, seconds)
            if way:
                self._numbers[index] += self._options.scale * way
                there[index] = round(self._numbers[index] / snap) * snap if snap else self._numbers[index]
        moved: Any = tuple(there)
        return moved


def within(vector: Vector, directions: Sequence[Vector]) -> Vector:
    """The part of a vector that lies in the span of directions of length 1."""
    base: List[Vector] = []
    result = (0.0, 0.0, 0.0)
    for direction in directions:
        for other in base:
            direction = _minus(direction, other, _dot(direction, other))
        length = _length(direction)
        if length > FLAT:
            direction = scaled(direction, 1.0 / length)
            base.append(direction)
            result = _minus(result, direction, -_dot(vector, direction))
    return result


def _minus(vector: Vector, other: Vector, factor: float) -> Vector:
    return vector[0] - factor * other[0], vector[1] - factor * other[1], vector[2] - factor * other[2]


def _dot(first: Vector, second: Vector) -> float:
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def _length(vector: Vector) -> float:
    return math.sqrt(_dot(vector, vector))
