"""A teacher: has a device move one thing of a scene, as a view has a mouse do."""

import contextlib
import functools
import queue
import re
import time
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Type, Union

import genpy
import rospy
from sensor_msgs.msg import Joy

from rosslt import node, values
from rosslt.markers import (
    FRAME_RATE,
    Descriptions,
    Drags,
    Follower,
    Handle,
    Motions,
    NumbersHandle,
    OtherViews,
    Rules,
    Scene,
    Settings,
    Watch,
    short_numbers,
)
from rosslt.markers.geometry import PoseTuple
from rosslt.teach.appending import Appending
from rosslt.teach.devices import PERIOD, RESOLUTION, Device, Frame, Joystick, NotTaught, Numbers, Options, Unusable
from rosslt.teach.ghost import Ghost
from rosslt.teach.hand import SILENCE, Hand, NumbersHand
from rosslt.teach.pairing import Field
from rosslt.teach.presses import Presses
from rosslt.teach.recording import Recording, Written
from rosslt.teach.target import Target

#: Shows whether the hand holds the thing, where it is or what its numbers are, and {name: value} of its sources.
Show = Callable[[bool, Sequence[float], Dict[str, Any]], None]

#: How often sources follow, in Hz: a device that sends at 50 Hz does not wait for it.
RATE = 100.0

#: The maximal wait for messages that show the last change, at the end, in seconds.
ENDING = 2.0

#: A number in a text, which is no part of a name.
_NUMBER = re.compile(r'(?<![\w./\[#])-?\d[\d.]*(e[-+]?\d+)?\b')


class Teacher(Follower):
    """A view of all that can be dragged, which draws nothing, and whose hand is a device.

    All of it runs in the thread that calls `find` and `teach`; messages of the device wait in a queue.

    Args:
        say: is called with each text that stands at the thing, and with what is wrong with the device.
        device: moves the thing.

    Attributes:
        recording: of what its hand does; None if the thing stays where the hand lets go.
    """

    def __init__(self, say: Callable[[str], None], device: Device) -> None:
        descriptions, scene = Descriptions(), Scene(Settings())
        super().__init__(scene, descriptions)
        self._say, self._device = say, device
        rules = Rules(rate=RATE, resolution=device.resolution if isinstance(device, Numbers) else RESOLUTION)
        others = OtherViews(scene, str)
        self._drags = Drags(scene, rules, descriptions.name, node.NodeErrors().raised_since, others)
        self._there: Dict[str, Tuple[Motions, PoseTuple]] = {}  # by name: what is shown, and where
        self._name, self._said = '', ''
        self._messages: queue.SimpleQueue[Tuple[bool, genpy.Message, float]] = queue.SimpleQueue()
        self.recording: Optional[Recording] = None
        self._target: Optional[Target] = None
        self._ghost: Optional[Ghost] = None
        self._appending: Optional[Appending] = None
        self._presses: Optional[Presses] = None

    # As a view.

    def draw(self, handle: Handle, motions: Motions) -> None:
        """Note how a handle can be moved, and where it is."""
        self._there[handle.name] = motions, handle.pose

    def move(self, handle: Handle) -> None:
        """Note where a handle is."""
        self._there[handle.name] = self._there[handle.name][0], handle.pose

    def erase(self, name: str) -> None:
        """Forget a handle."""
        self._there.pop(name, None)

    def say(self, handle: Handle, text: str) -> None:
        """Say what stands at the thing, once as long as it stands there with whatever numbers: a refusal has those of
        the hand, which goes on."""
        reason = _NUMBER.sub('', text)
        if handle.name == self._name and reason != self._said:
            self._said = reason
            self._say(short_numbers(text))

    # For the command.

    def record(self, tolerance: float, lever: float, show: Callable[[Written], None]) -> None:
        """Have each path of the hand become rows, and the thing go back.

        Args:
            tolerance, lever: as of a Recording.
            show: is called with what was written.
        """
        self.recording = Recording(self._drags, self._scene, tolerance, lever, self._descriptions.name)
        self._show_written = show

    def lead_ghost(self) -> None:
        """Have the hand lead a ghost of the thing, and nothing change."""
        self._ghost = Ghost(self._scene, self._descriptions.name, self._say)

    def append(self) -> None:
        """Have the hand lead a ghost of the thing, which becomes a row at each press."""
        self._ghost = self._appending = Appending(self._scene, self._descriptions.name, self._say)

    def find(self, target: Union[str, Field], topic: str, timeout: float) -> str:
        """The name of the handle that is meant.

        Args:
            target: its name, or a topic that shows one thing; for a device of numbers, a Field.
            topic: that the device sends on.
            timeout: how long to wait for it, in seconds.

        Raises:
            NotTaught: there is none, there are several, or the device cannot move it, or is not there.
        """
        end, device = time.monotonic() + timeout, self._device
        if isinstance(target, Field):
            assert isinstance(device, Numbers)
            self._target = Target(self._scene, target, device, topic)
            return self._find_numbers(self._target, end)
        Watch(self._scene)
        found: List[str] = []
        while not found and time.monotonic() < end and not rospy.is_shutdown():
            self._keep_up()
            found = self._called(target)
            rospy.rostime.wallsleep(1.0 / FRAME_RATE)
        movable = ', '.join(sorted(self._movable())) or 'none'
        if not found:
            raise NotTaught(f'nothing that can be dragged is called {target}; there are: {movable}')
        if len(found) > 1:
            raise NotTaught(f'{target} shows several things: ' + ', '.join(sorted(found)))
        if not (device.turns or any(self._there[found[0]][0].axes)):
            raise NotTaught(
                f'{found[0]} can only be turned, and a {type(device).__name__} turns nothing'
                + ' without --turn' * isinstance(device, Joystick)
            )
        if isinstance(device, Frame):
            handle = self._scene.handle(found[0])
            device.begin(handle.frame if handle is not None else '', max(end - time.monotonic(), 1.0))
        handle = self._scene.handle(found[0])
        writing = self.recording or self._appending
        if writing is not None and handle is not None:
            writing.check(handle)
        return found[0]

    def _find_numbers(self, target: Target, end: float) -> str:
        while target.name not in self._there:
            if target.why and (time.monotonic() > end or rospy.is_shutdown()):
                raise NotTaught(target.why)
            self._keep_up()
            rospy.rostime.wallsleep(PERIOD)
        if target.left_out:
            self._say(target.left_out)
        return target.name

    def teach(
        self,
        name: str,
        by: str,
        topic: str,
        device_class: Type[genpy.Message],
        options: Options,
        clutch: str,
        show: Show,
        presses: Optional[Presses] = None,
    ) -> None:
        """Have a device move a thing until this process is interrupted; it has let go then.

        Args:
            name: of the handle.
            by: the name of the device.
            topic, device_class: as `device` gives them.
            options: of the device, and of its clutch.
            clutch: the topic of a Joy whose button is pressed as long as the hand holds; '' for none.
            show: is called some thirty times a second.
            presses: append rows, after `append` was called.
        """
        self._name, self._presses = name, presses
        kind = NumbersHand if isinstance(self._device, Numbers) else Hand
        drags = self._ghost or self.recording or self._drags
        grasp = functools.partial(self._grasp, name)
        hand = kind(self._device, drags, by, options, grasp, self._say)
        subscribers = [rospy.Subscriber(topic, device_class, self._note, False, tcp_nodelay=True)]
        if clutch:
            subscribers.append(rospy.Subscriber(clutch, Joy, self._note, True, tcp_nodelay=True))
        try:
            with contextlib.suppress(KeyboardInterrupt):
                self._obey(hand, Joystick(options), bool(clutch), show)
        finally:
            hand.let_go()
            self._wait_until_let_go()
            self._write_led()
            for subscriber in subscribers:
                subscriber.unregister()
        self._keep_up()  # a refusal of the last change is said
        self._show(hand, show)

    def _wait_until_let_go(self) -> None:
        end = time.monotonic() + ENDING
        while self._scene.is_held(self._name) and time.monotonic() < end and not rospy.is_shutdown():
            rospy.rostime.wallsleep(1.0 / FRAME_RATE)

    def _write_led(self) -> None:
        """Have a path that has ended become rows, once the thing has gone back."""
        if self.recording is None or self.recording.ended is None:
            return
        led, self.recording.ended = self.recording.ended, None
        self._wait_until_let_go()
        try:
            written = self.recording.write(led)
        except NotTaught as error:
            self._say(str(error))
        else:
            self._show_written(written)
            if written.untaken:
                self._say(f'the rows are written, but {written.untaken}')

    def _obey(self, hand: Hand, clutch: Joystick, has_clutch: bool, show: Show) -> None:
        pressed = 0.0  # when the clutch was last reported as pressed
        due = time.monotonic()
        while not rospy.is_shutdown():
            now = time.monotonic()
            if now >= due:
                self._keep_up()
                self._show(hand, show)
                if self._presses is not None and self._appending is not None:
                    self._presses.answer_waiting(self._appending.append)
                due = now + 1.0 / FRAME_RATE
            try:
                is_clutch, message, arrived = self._messages.get(timeout=max(due - now, 0.0))
            except queue.Empty:
                hand.expire(time.monotonic())
                self._write_led()
                continue
            was_held = hand.pose is not None
            hand.expire(arrived)
            self._write_led()
            if is_clutch:
                pressed = arrived if clutch.holds(message) else 0.0
                if not pressed:
                    hand.let_go()
            else:
                hand.take(message, arrived, not has_clutch or arrived - pressed <= SILENCE)
            self._write_led()
            if hand.pose is not None and self._name in self._there:
                self._there[self._name] = self._there[self._name][0], hand.pose
            if was_held != (hand.pose is not None):
                self._show(hand, show)

    def _show(self, hand: Hand, show: Show) -> None:
        handle = self._scene.handle(self._name)
        place = hand.pose or (self._there[self._name][1] if self._name in self._there else ())
        sources = values.source_values(list(handle.tracked)) if handle is not None else {}
        shown = handle.rounded(place) if isinstance(handle, NumbersHandle) else place[:3]
        show(hand.pose is not None, shown, {self._descriptions.name(one): value for one, value in sources.items()})

    def _note(self, message: genpy.Message, is_clutch: bool) -> None:
        self._messages.put((is_clutch, message, time.monotonic()))

    def _grasp(self, name: str) -> Optional[Tuple[Handle, Motions, PoseTuple]]:
        """A thing, how it can be moved, and where it is shown, None if it is not."""
        if self._target is not None:
            try:
                self._target.renew()
            except NotTaught as error:
                raise Unusable(str(error)) from None
        self.follow()
        self._said = ''
        handle = self._scene.handle(name)
        return None if handle is None or name not in self._there else (handle, *self._there[name])

    def _keep_up(self) -> None:
        self._scene.expire()
        self.follow()

    def _movable(self) -> List[str]:
        return [name for name, (motions, _) in self._there.items() if motions.are_any]

    def _called(self, target: str) -> List[str]:
        """The names of the handles that may be meant: of a thing with a body that can be moved, that one."""
        movable = self._movable()
        if target in movable:
            return [target]
        handles = {name: self._scene.handle(name) for name in movable if self._scene.origin(name)[0] == target}
        return [name for name, one in handles.items() if one and (one.thing == name or one.thing not in handles)]
