"""Messages with their provenance from topics, for a command that owns nothing."""

import argparse
import time
from typing import TYPE_CHECKING, Callable, Dict, List, Optional, Protocol

import rosgraph
import rospy

from rosslt import node
from rosslt.cli.failure import Failure, Misused, did_you_mean
from rosslt.cli.master import full_name, problem_of, system_state
from rosslt.cli.slave_api import other_type
from rosslt.cli.verb import Argument
from rosslt.node import Heard

if TYPE_CHECKING:
    from rosslt.cli.links import Link

#: The arguments of verbs that can also be about a link of a robot, which `link_of` finds.
LINK_ARGUMENTS = [
    Argument('--frame', metavar='LINK', help='FIELD is of where this link of a robot is, as position/z'),
    Argument(
        '--in',
        dest='base',
        metavar='LINK',
        help='with --frame: as this link has it, that it hangs on (default: the one that the robot stands on)',
    ),
]

#: Time to wait for the other publishers of a topic after the first message, in seconds.
_GATHERING = 1.0


class Messages(Protocol):
    """Messages as they come, as a Listener has them."""

    def next_before(self, end: float) -> Optional[Heard]: ...

    def why_nothing(self, timeout: float) -> str: ...


def start_node(disable_signals: bool = False) -> None:
    """Make this process a node with a unique name and without locations; once.

    Args:
        disable_signals: whether SIGINT and SIGTERM do what they did before, also if the process waits for no message.
    """
    if not node.is_initialized():
        # without arguments, as private parameters among them would be left behind
        rospy.init_node('rosslt', anonymous=True, disable_rosout=True, disable_signals=disable_signals, argv=[])


def listener(*topics: str, is_exact: bool = False) -> node.Listener:
    """A Listener in a process that need not be a node yet.

    Raises:
        Failure: the last publisher of a topic has just ended.
        UnknownType: as in `Listener`.
    """
    start_node()
    try:
        return node.Listener(*topics, is_exact=is_exact)
    except rospy.ROSException as error:
        raise Failure(str(error)) from None


def link_of(master: rosgraph.Master, options: argparse.Namespace) -> 'Optional[Link]':
    """The link that `LINK_ARGUMENTS` name; None if none is named.

    Raises:
        Misused, Failure: there is no such link.
    """
    if options.base and not options.frame:
        raise Misused('--in is for --frame')
    if not options.frame:
        return None
    from rosslt.cli.links import find_link  # with the kinematics of the markers, which other calls do without

    return find_link(dict(master.getPublishedTopics('/')), options.frame, options.base or '')


def heard_publishers(
    master: rosgraph.Master,
    stream: Messages,
    topic: str,
    timeout: float,
    publisher: Optional[str] = None,
    is_meant: Callable[[Heard], bool] = lambda received: True,
    meant: Callable[[], str] = lambda: '',
) -> List[Heard]:
    """A message of each node that publishes a topic, in the order of their names.

    Args:
        master: knows who publishes it.
        stream: listens to that topic alone.
        topic: its full name.
        timeout: the time to wait for the first message, in seconds.
        publisher: wait for this node alone.
        is_meant: returns True for a message to wait for; others are passed over.
        meant: says what may be meant if only others came, as of `did_you_mean`.

    Raises:
        Failure: nobody sends such a message in time, or the node does not publish the topic.
    """
    awaited = system_state(master).publishers.get(topic, [])
    if publisher is not None:
        name = full_name(publisher)
        if name not in awaited:
            raise Failure(
                f'{name} does not publish {topic}{did_you_mean(name, awaited)}: ' + ', '.join(sorted(awaited))
            )
        awaited = [name]
    found: Dict[str, Heard] = {}
    others = 0
    end = time.monotonic() + timeout
    while set(awaited) - found.keys():
        received = stream.next_before(end)
        if received is None:
            break
        if (publisher is not None and received.publisher != awaited[0]) or not is_meant(received):
            others += 1
            continue
        if not found:
            end = min(end, time.monotonic() + _GATHERING)
        found.setdefault(received.publisher, received)
    if not found:
        if others:
            raise Failure(f'no such message on {topic} within {timeout:g} s, but {others} others{meant()}')
        raise Failure(why_silent(master, stream, topic, timeout, publisher and awaited[0]))
    return [found[name] for name in sorted(found)]


def why_silent(
    master: rosgraph.Master, stream: Messages, topic: str, timeout: float, publisher: Optional[str] = None
) -> str:
    """Why no message of a topic has come, as far as it can be found out.

    Args:
        master, stream, topic, timeout: as in `heard_publishers`.
        publisher: the full name of the node whose messages are waited for; by default all.
    """
    publishers = system_state(master).publishers.get(topic, [])
    awaited = publishers if publisher is None else [publisher]
    said, kept = node.published_types({*publishers, *awaited}), dict(master.getTopicTypes()).get(topic, '')
    # else the messages are read as they are sent
    is_read_as_kept = any(types.get(topic) == kept for types in said.values())
    others = [other_type(topic, name, kept, said) for name in awaited if is_read_as_kept]
    problems = ((name, problem_of(master, name)) for name in awaited)
    unreachable = [f'cannot reach {name}: {problem}' for name, problem in problems if problem]
    return '; '.join([stream.why_nothing(timeout), *filter(None, others), *unreachable])
