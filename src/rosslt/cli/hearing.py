"""Waiting for messages of a topic: of each of its publishers, or for the first one of a topic that is silent."""

import time
from typing import Callable, Dict, List, Optional

import rosgraph

from rosslt.cli.failure import Failure
from rosslt.cli.master import full_name, system_state
from rosslt.cli.reading import Inbox, Received
from rosslt.cli.suggestions import did_you_mean
from rosslt.cli.unreachable import problem_of

#: Time to wait for the other publishers of a topic after the first message, in seconds.
_GATHERING = 1.0


def heard_publishers(
    master: rosgraph.Master,
    inbox: Inbox,
    topic: str,
    timeout: float,
    publisher: Optional[str] = None,
    is_meant: Callable[[Received], bool] = lambda received: True,
) -> List[Received]:
    """A message of each node that publishes a topic, in the order of their names.

    Args:
        master: knows who publishes it.
        inbox: listens to that topic alone.
        topic: its full name.
        timeout: the time to wait for the first message, in seconds.
        publisher: wait for this node alone.
        is_meant: returns True for a message to wait for; others are passed over.

    Raises:
        Failure: nobody sends such a message in time, or the publisher is none.
    """
    awaited = system_state(master).publishers.get(topic, [])
    if publisher is not None:
        name = full_name(publisher)
        if name not in awaited:
            raise Failure(
                f'{name} does not publish {topic}{did_you_mean(name, awaited)}: ' + ', '.join(sorted(awaited))
            )
        awaited = [name]
    found: Dict[str, Received] = {}
    end = time.monotonic() + timeout
    while set(awaited) - found.keys():
        received = inbox.next_before(end)
        if received is None:
            break
        if (publisher is not None and received.publisher != awaited[0]) or not is_meant(received):
            continue
        if not found:
            end = min(end, time.monotonic() + _GATHERING)
        found.setdefault(received.publisher, received)
    if not found:
        raise Failure(f'no message within {timeout:g} s')
    return [found[name] for name in sorted(found)]


def why_silent(master: rosgraph.Master, topic: str, type_: str) -> str:
    """Why no message comes on a topic, as far as the master and the publishers' addresses tell."""
    publishers = system_state(master).publishers.get(topic, [])
    if not publishers:
        return f'nobody publishes it any more; the master keeps it as {type_}'
    return '; '.join(
        '{}: {}'.format(name, problem_of(master, name) or f'publishes it as {type_}, but sends nothing')
        for name in sorted(publishers)
    )
