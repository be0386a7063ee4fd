"""A twin: a copy of a running node under a master of its own, from which no packet reaches the live robot."""

import contextlib
import os
import pickle
import shutil
import subprocess
import sys
from typing import Any, Dict, List, Mapping, Sequence, Tuple

from rosslt.models.processes import LiveProcess

#: Runs a command in user, network, memory, mount and process namespaces of its own, which end with it.
UNSHARE = ('unshare', '--map-root-user', '--net', '--ipc', '--mount', '--pid', '--fork', '--kill-child', '--mount-proc')

#: (time in seconds since a play began, topic, serialized message).
Timed = Tuple[float, str, bytes]


class TwinFailed(Exception):
    """A twin did not come up, or its node ended; the text has the last lines that the node wrote."""


def is_isolation_allowed() -> bool:
    """Return whether this user may make namespaces on this machine."""
    if shutil.which(UNSHARE[0]) is None:
        return False
    return (
        subprocess.run([*UNSHARE, 'true'], stdin=subprocess.DEVNULL, capture_output=True, check=False).returncode == 0
    )


class Twin:
    """A copy of a node, which runs from the beginning to the end of a `with` block.

    Attributes:
        is_isolated: whether the copy has a network of its own and no devices. If not, it has only a master of its own
            on the loopback address, and what it does apart from ROS reaches what the live node reaches.

    Args:
        process: the node that is copied.
        parameters: the tree of all parameters, as the live master's `getParam('/')` gives it.
        inputs: {topic: type} of the topics that are played to the copy.
        outputs: {topic: type} of the topics whose messages the copy answers with.
        timeout: how long the copy may take until all its topics are connected, in seconds.
        isolate: whether it gets namespaces if they are allowed.
    """

    def __init__(
        self,
        process: LiveProcess,
        parameters: Mapping[str, Any],
        inputs: Mapping[str, str],
        outputs: Mapping[str, str],
        timeout: float = 30.0,
        isolate: bool = True,
    ) -> None:
        self.is_isolated = isolate and is_isolation_allowed()
        self._order: Dict[str, Any] = {
            'process': process,
            'parameters': parameters,
            'inputs': dict(inputs),
            'outputs': dict(outputs),
            'timeout': timeout,
        }
        self._changed: Dict[str, Any] = {}

    def __enter__(self) -> 'Twin':
        self._start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()

    def play(self, messages: Sequence[Timed], until: float) -> List[Timed]:
        """Send messages to the copy, and return what it sends.

        Args:
            messages: (seconds since the play begins, input, serialized message), in any order.
            until: when the play ends, in seconds since it began.

        Returns:
            What the copy sent, in order of arrival. What it sent before the play began, and no play has returned, is
            among it, with a negative time.

        Raises:
            TwinFailed: the copy has ended.
            KeyError: a topic is no input.
        """
        for _, topic, _ in messages:
            self._order['inputs'][topic]
        answers: List[Timed] = self._ask(('play', sorted(messages, key=lambda one: one[0]), until))
        return answers

    def set_parameter(self, name: str, value: Any) -> None:
        """Set a parameter, by its full name, of the twin's master. It stays set when the copy is started anew."""
        self._changed[name] = value
        self._ask(('set', name, value))

    def asked_parameters(self) -> List[str]:
        """The full names of the parameters that the copy has asked for since it was started, also of missing ones."""
        names: List[str] = self._ask(('asked',))
        return names

    def restart(self) -> None:
        """Start the copy anew, with a new master and the parameters that were set.

        Raises:
            TwinFailed: it does not come up.
        """
        self._stop()
        self._start()

    def _start(self) -> None:
        command = [sys.executable, '-m', 'rosslt.models.laboratory']
        environment = {name: text for name, text in os.environ.items() if name not in ('ROS_HOSTNAME', 'ROS_NAMESPACE')}
        self._laboratory = subprocess.Popen(
            [*UNSHARE, *command] if self.is_isolated else command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**environment, 'ROS_IP': '127.0.0.1', 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))},
            start_new_session=True,  # Ctrl-C is for this process, which ends the other
        )
        try:
            self._ask({**self._order, 'changed': self._changed})
        except BaseException:
            self._stop()
            raise

    def _stop(self) -> None:
        # closes its pipes, at which it ends, and waits for it; a request may be left if it has ended by itself
        with contextlib.suppress(BrokenPipeError), self._laboratory as laboratory:
            laboratory.stdin.close()  # type: ignore[union-attr]

    def _ask(self, request: object) -> Any:
        to, back = self._laboratory.stdin, self._laboratory.stdout
        assert to is not None
        assert back is not None
        try:
            pickle.dump(request, to)
            to.flush()
            failure, answer = pickle.load(back)
        except (BrokenPipeError, EOFError, pickle.UnpicklingError):
            raise TwinFailed('the process that holds the copy has ended') from None
        if failure:
            raise TwinFailed(failure)
        return answer
