"""Changes as a node's own code asks for them: of its sources and those of others."""

from typing import Any, Collection, Dict, Mapping, Optional, Sequence

import rospy

from rosslt import srv, values
from rosslt.node import client, forcing, listening
from rosslt.node.api import started
from rosslt.node.commit_participant import APPLIED
from rosslt.node.history import NOTHING_TO_UNDO
from rosslt.node.json_scalars import from_json
from rosslt.node.node_errors import NodeErrors


def undo() -> Dict[values.Source, client.Change]:
    """Take the last change of this node's locations back.

    Returns:
        {Source: Change(old, new)}, empty where there was nothing to take back.

    Raises:
        ChangeRejected: the node takes no changes now, or a setter refuses the old value.
        rospy.ROSException: `init_node` has not been called.
    """
    owner = started('undo')
    answer = owner.change_sources(srv.ChangeSourcesRequest(undo=True, requester=owner.name))
    if answer.state != APPLIED and answer.reasons != [NOTHING_TO_UNDO]:
        raise client.ChangeRejected(answer.reasons[0], {})
    return {
        values.Source(owner.name, one.location_id): client.Change(from_json(one.old_value), from_json(one.new_value))
        for one in answer.changes
    }


def request_values(
    wanted: Mapping[values.Source, Any], timeout: float = 1.0, request_id: str = ''
) -> Dict[values.Source, client.Change]:
    """Have the owners of sources give them new values, all or none: what every change ends in. For the rooms above.

    Args:
        wanted: {Source: new value}.
        timeout, request_id: as of `force_value`.

    Returns:
        {Source: Change(old, new)}, with the values that the owners say they had and have now.

    Raises:
        ChangeRejected, SourceUnreachable: as of `force_value`.
        rospy.ROSException: `init_node` has not been called.
    """
    return client.request_values(started('request_values'), wanted, timeout, request_id)


def force_value(
    x: Any,
    target: Any,
    source: Optional[values.Source] = None,
    timeout: float = 1.0,
    request_id: str = '',
    sources: Optional[Collection[values.Source]] = None,
) -> Dict[values.Source, client.Change]:
    """Have `x` become `target` in the next message: solve for its sources, and have their owners change them.

    Waits for the owners' answers (the paper's `force_value`, section IV-A, acknowledged). Where several nodes own
    sources of `x`, all of them change or none: each is asked first whether it would take its part, and where one
    refuses or dies nevertheless, the others are taken back.

    Args:
        x: a tracked scalar, or a message or sequence holding tracked leaves.
        target: plain, of the same shape and unit.
        source: change this Source alone; by default the first in order of appearance that can.
        timeout: how long to wait for the owners' answers, in seconds; taking back may take a second more.
        request_id: what groups several calls, those of one drag for instance: they are one change in the owners'
            histories, and taken back as one. By default each call is a request of its own.
        sources: change no other than these, such as `[first, second]`.

    Returns:
        {Source: Change(old, new)}, with the values that the owners say they had and have now.

    Raises:
        NotTracked, NotInvertible: as of `solve`; nothing was requested.
        ChangeRejected: an owner refuses.
        SourceUnreachable: an owner does not answer within the timeout.
            Of both, `changed` says what could not be taken back in other nodes; it is empty but for rare cases.
        rospy.ROSException: `init_node` has not been called.
    """
    return client.force_value(started('force_value'), x, target, source, timeout, request_id, sources)


def force_field(
    topic: str,
    field: str,
    target: Any,
    source: Optional[values.Source] = None,
    sources: Optional[Sequence[values.Source]] = None,
    rounds: int = 5,
    timeout: float = 5.0,
    keep_anyway: bool = False,
) -> forcing.Outcome:
    """Have a field of a topic become a target, and see that it has.

    Solves for the field of the next message, has the owners change its sources, and looks at the messages that the same
    publisher sends then. Where the field is not as wanted, because the node takes another branch for instance, the
    new message's expression is solved, until the field is as wanted (to a relative 1e-9) or comes no nearer.

    Args:
        topic: as of `rospy.Subscriber`. Of several publishers, the first one whose message has a source is taken.
        field: `pose/position/x`, `points[3].x`; '' for the whole message.
        target: plain, of the field's shape, in its unit; in a message or array None leaves a part free.
        source: change this Source alone.
        sources: change no other than these.
        rounds: how many times it is solved at most.
        timeout: how long to wait for the first message, and for each message that shows a change, in seconds.
        keep_anyway: leave the changes where the target is not reached; otherwise they are taken back.

    Returns:
        The Outcome: what has changed, what was seen, and after how many messages and milliseconds. A field that moves
        by itself is solved for the moment it was seen at; then `moves` is True.

    Raises:
        NotTracked, NotInvertible: there is no answer to begin with; nothing was requested.
        ChangeRejected, SourceUnreachable: as of `force_value`.
        NotReached: the sources have changed, but no message shows the target; the error says what came instead, and
            why as far as it is known, and has the Outcome.
        ValueError: the topic's messages have no such field, it cannot hold the target (400 in a `uint8`), or both
            `source` and `sources` were given.
        rospy.ROSException: nobody publishes the topic, no message came in time, or `init_node` has not been called.
    """
    if source is not None and sources is not None:
        raise ValueError('give either source or sources')
    owner = started('force_field')
    with listening.Listener(rospy.resolve_name(topic)) as stream, NodeErrors() as errors:
        heard = stream.first(field, timeout)
        chosen = sources if source is None else [source]
        return forcing.close_loop(owner, stream, errors, heard, field, target, chosen, rounds, timeout, keep_anyway)


def reevaluate(x: Any, timeout: float = 1.0) -> Any:
    """`x` as it would be had its sources' current values been used (the paper's `reevaluate`, section IV-A).

    Args:
        x: a tracked scalar, or a message, list or dict holding tracked leaves; plain ones stay as they are.
        timeout: how long to wait for the owners' answers, in seconds.

    Returns:
        The same with new values and the same provenance; containers are copied.

    Raises:
        SourceUnreachable: an owner does not answer within the timeout, or does not know the source any more.
        rospy.ROSException: `init_node` has not been called.
    """
    return client.reevaluate(started('reevaluate'), x, timeout)
