"""Presses: a button of a joystick, a service, or Enter in a terminal."""

import contextlib
import queue
import signal
import sys
import threading
from typing import Any, Callable, Iterator, NamedTuple, Optional, Sequence, Set, Tuple

import rospy
from sensor_msgs.msg import Joy
from std_srvs.srv import Trigger, TriggerResponse

from rosslt.teach.devices import PERIOD


class Answer(NamedTuple):
    """The result of a press.

    Attributes:
        is_done: whether all is as measured, or as near as possible, or the row is written.
        changes: [(name of a source, its value before, after), ...]; for a row, its value above, and in the row.
        text: how it was seen, or the reason of a refusal.
        notes: what else a person should know.
    """

    is_done: bool
    text: str
    changes: Sequence[Tuple[str, Any, Any]] = ()
    notes: Sequence[str] = ()

    def __str__(self) -> str:
        changed = ', '.join(f'{name}: {old!r} -> {new!r}' for name, old, new in self.changes)
        return '; '.join(filter(None, [changed, self.text, *self.notes]))


BUSY = Answer(False, 'the press before is still being answered; nothing was changed by this one')

_Reply = Callable[[Answer], None]


class Presses:
    """Presses one after the other, from whatever they come. One that comes before the last one was answered is refused:
    what was measured then would be another thing by the time that it is looked at.

    Args:
        service: the name of the service that presses.
        joy: the topic of a joystick; '' for none.
        button: the number of its button.
        show: is called with who has pressed and the answer, in the threads of all.
        say: is called with what is wrong with the joystick.
    """

    def __init__(
        self,
        service: str,
        joy: str,
        button: int,
        show: Callable[[str, Answer], None],
        say: Callable[[str], None],
    ) -> None:
        self._service = rospy.resolve_name(service)
        self._joy, self._button, self._show, self._say = joy, button, show, say
        self._queue: queue.SimpleQueue[Optional[Tuple[str, _Reply]]] = queue.SimpleQueue()
        self._is_busy = threading.Lock()
        self._was_down: Optional[bool] = None
        self._said: Set[str] = set()
        rospy.on_shutdown(self.end)
        rospy.Service(self._service, Trigger, self._serve)
        if joy:
            rospy.Subscriber(joy, Joy, self._take, tcp_nodelay=True)
        if sys.stdin is not None and sys.stdin.isatty():
            signal.signal(signal.SIGTTIN, signal.SIG_IGN)  # in the background, reading fails instead of stopping it
            threading.Thread(target=self._read, name='rosslt presses', daemon=True).start()

    def answer_all(self, answer: Callable[[], Answer]) -> None:
        """Answer presses until `end` is called."""
        for by, reply in self._each():
            self._answer(answer, by, reply)

    def answer_waiting(self, answer: Callable[[], Answer]) -> None:
        """Answer the press that waits, if one does."""
        with contextlib.suppress(queue.Empty):
            press = self._queue.get_nowait()
            if press is not None:
                self._answer(answer, *press)

    def end(self) -> None:
        """Take no more presses."""
        self._queue.put(None)

    def _each(self) -> Iterator[Tuple[str, _Reply]]:
        while True:
            with contextlib.suppress(queue.Empty):
                press = self._queue.get(timeout=PERIOD)  # a signal that comes just before it waits does not wake it
                if press is None:
                    return
                yield press

    def _answer(self, answer: Callable[[], Answer], by: str, reply: _Reply) -> None:
        try:
            given = answer()
        finally:
            self._is_busy.release()
        self._show(by, given)
        reply(given)

    def _press(self, by: str, reply: _Reply = lambda answer: None) -> None:
        if self._is_busy.acquire(blocking=False):
            self._queue.put((by, reply))
        else:
            self._show(by, BUSY)
            reply(BUSY)

    def _serve(self, _: object) -> TriggerResponse:
        answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self._press(self._service, answers.put)
        answer = answers.get()
        return TriggerResponse(answer.is_done, str(answer))

    def _take(self, message: Joy) -> None:
        if self._button >= len(message.buttons):
            self._tell(f'{self._joy} has {len(message.buttons)} buttons, and no button {self._button}')
            return
        is_down, was_down = bool(message.buttons[self._button]), self._was_down
        self._was_down = is_down
        if is_down and was_down is None:
            self._tell(f'button {self._button} of {self._joy} is down already: it counts when it goes down again')
        elif is_down and not was_down:
            self._press(self._joy)

    def _tell(self, text: str) -> None:
        if text not in self._said:
            self._said.add(text)
            self._say(text)

    def _read(self) -> None:
        with contextlib.suppress(OSError):
            for _ in sys.stdin:
                self._press('Enter')
