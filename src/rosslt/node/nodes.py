"""This process as a node: its start, and the calls that need it."""

import copy
import functools
import re
import sys
import threading
import xmlrpc.client

import rospy

from rosslt import values
from rosslt.node import requests
from rosslt.node.locations import (
    ExternalLocation,
    HeldLocation,
    Refused,
    call_site,
    identity_of,
    name_of,
    scalar,
)
from rosslt.node.owner import SETTINGS, Owner

_owner = None
_starting = threading.Lock()


def init_node(name, *args, **rospy_options):
    """Start this node: `rospy.init_node`, and what makes its locations known and changeable.

    Args:
        name, and all others: as of `rospy.init_node`.

    Raises:
        rospy.ROSInitException, ValueError: as of `rospy.init_node`.
    """
    rospy.init_node(name, *args, **rospy_options)
    start()


def start():
    """Make this node's locations known and changeable, where rospy's `init_node` has been called already.

    Raises:
        rospy.ROSException: rospy's `init_node` has not been called.
    """
    global _owner
    with _starting:
        if _owner is None:
            if not rospy.core.is_initialized():
                raise rospy.ROSException('rosslt.node.start() needs rospy.init_node() to have been called')
            marshal_tracked_values()
            _owner = Owner()


def is_started():
    """Whether this node's locations can be known."""
    return _owner is not None


def location(value=None, name=None, key=None, minimum=None, maximum=None, read_only=False, *, getter=None, setter=None):
    """A value that can be changed at runtime (the paper's `create_location`, section IV-A).

    The place of the call identifies it: the same call again, in a loop or a callback, gives its current
        value.

    Args:
        value: the literal: a float, int, str or bool; or a message, list or dict of them, each leaf of which
            becomes a location (but for time stamps, sequence numbers and byte arrays).
        name: its name below `<node>/rosslt/`, words joined by `/`; by default file, line and column.
        key: tells the turns of a loop apart; anything with a `str()`.
        minimum, maximum: bounds that changes must keep, in the unit of the value.
        read_only: take no change.
        getter, setter: in place of a literal, functions that read and write a scalar somewhere else. What the
            setter
            raises is the reason of a refusal; without a setter the location is read-only.

    Returns:
        The current value, tracked; for a message, list or dict a new one.

    Raises:
        ValueError: the name is no name or is taken, or the literal itself is out of bounds.
        TypeError: the literal is of a type that cannot be a location.
        rospy.ROSException: `init_node` has not been called.
    """
    owner = started('location')
    frame = sys._getframe(1)
    limits = {'minimum': minimum, 'maximum': maximum, 'read_only': read_only}

    def build():
        site = call_site(frame)
        base, identity = _named(name, key, site)
        if getter is not None:
            place = _created(
                site,
                lambda: owner.locations.add(
                    ExternalLocation(owner.name, identity, base, site, getter, setter, **limits)
                ),
            )
            return lambda: place.tracked

        def leaf(literal, path):
            if isinstance(literal, (str, bool)):
                if not path and (minimum, maximum) != (None, None):
                    raise TypeError(f'bounds are for numbers, and {literal!r} is none')
                own_limits = {'read_only': read_only}
            else:
                own_limits = limits
            return _created(
                site,
                lambda: owner.add_literal(
                    HeldLocation(
                        owner.name, '\n'.join([identity, *path]), '/'.join([base, *path]), site, literal, **own_limits
                    )
                ),
            )

        return _reader(value, (), leaf)

    if (value is None) == (getter is None):
        raise TypeError('location() takes either a value or a getter')
    return owner.locations.at_call(frame, name, key, build)


def add_location(name, site, getter, setter=None, **limits):
    """A location at a place that is no call in this node's code: a number in a script, say. For the rooms above.

    Args:
        name: as of `location`; it is also what identifies the location.
        site: the CallSite, which is where it stands.
        getter, setter: as of `location`.
        limits: `minimum`, `maximum`, `read_only`, as of `location`.

    Returns:
        The ExternalLocation; its `tracked` is the current value, tracked.

    Raises:
        ValueError: the name is no name or is taken.
    """
    owner = started('add_location')
    base, identity = _named(name, None, site)
    return _created(
        site, lambda: owner.locations.add(ExternalLocation(owner.name, identity, base, site, getter, setter, **limits))
    )


def add_literal(location):
    """Take in a location of a room above whose value this node holds: a literal of a node that was not written for this.

    Other than the literals of `location()`, it has no parameter until it is changed; one that a launch file has set
    goes before it.

    Args:
        location: a HeldLocation.

    Returns:
        The location that is in force: an earlier one of the same place, or `location`.

    Raises:
        ValueError: its name or its id is taken by another place.
    """
    return started('add_literal').add_literal(location, is_written=False)


def remove_location(location):
    """Forget a location that `add_location` made: a change to it is refused from now on, as of an unknown one."""
    started('remove_location').locations.remove(location)


def get_param(name, *default):
    """`rospy.get_param`, with the parameter itself as the source.

    Args:
        name: the parameter's name, resolved as in rospy.
        default: what to return where it is not set; it is a source all the same, and a change sets the
            parameter.

    Returns:
        The parameter's value; in lists and dicts each number, text and truth value is tracked. Asking again
        makes no network call.

    Raises:
        KeyError: the parameter is not set, and there is no default.
        rospy.ROSException: `init_node` has not been called.
    """
    return read_parameter(sys._getframe(1), name, *default)


def read_parameter(frame, name, *default):
    """`get_param` for the call that a frame is making."""
    return started('get_param').parameter(rospy.resolve_name(name), frame, *default).read()


def undo():
    """Take the last change of this node's locations back.

    Returns:
        {Source: Change(old, new)}, empty where there was nothing to take back.

    Raises:
        ChangeRejected: the node takes no changes now, or a setter refuses the old value.
        rospy.ROSException: `init_node` has not been called.
    """
    try:
        return {location.source: requests.Change(old, new) for location, old, new in started('undo').undo()}
    except Refused as refused:
        raise requests.ChangeRejected(str(refused), {}) from None


def force_value(x, target, source=None, timeout=1.0):
    """Have `x` become `target` in the next message: solve for its sources, and have their owners change them.

    Waits for the owners' answers (the paper's `force_value`, section IV-A, acknowledged). Where several nodes
    own sources of `x`, each of them changes all of its own or none.

    Args:
        x: a tracked scalar, or a message or sequence holding tracked leaves.
        target: plain, of the same shape and unit.
        source: change this Source alone; by default the first in order of appearance that can.
        timeout: how long to wait for the owners' answers, in seconds.

    Returns:
        {Source: Change(old, new)}, with the values that the owners say they had and have now.

    Raises:
        NotTracked, NotInvertible: as of `solve`; nothing was requested.
        ChangeRejected: an owner refuses; of its sources none has changed.
        SourceUnreachable: an owner does not answer within the timeout.
        rospy.ROSException: `init_node` has not been called.
    """
    return requests.force_value(started('force_value'), x, target, source, timeout)


def reevaluate(x, timeout=1.0):
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
    return requests.reevaluate(started('reevaluate'), x, timeout)


def started(call):
    """This node as the owner of locations.

    Raises:
        rospy.ROSException: `init_node` has not been called; `call` names what needs it.
    """
    if _owner is None:
        raise rospy.ROSException(f'rosslt.{call} needs rosslt.init_node() to have been called')
    return _owner


def _named(name, key, site):
    """The name of the locations that a call creates, and what identifies them."""
    if name is None:
        return name_of(site, key), identity_of(site, key)
    full = name if key is None else '{}/{}'.format(name, re.sub(r'\W', '_', str(key)))
    if not re.fullmatch(r'[A-Za-z]\w*(/\w+)*', full, flags=re.ASCII):
        raise ValueError(f'{full!r} is not a name for a location: give words of letters, digits and _, joined by /')
    if full.split('/')[0] in SETTINGS:
        raise ValueError(f'a location cannot be named {full}: the parameter of that name is a setting of the node')
    return full, full


def _created(site, create):
    try:
        return create()
    except Refused as refused:
        raise ValueError(f'the location at {site.file}:{site.line}: {refused}') from None


def _reader(literal, path, leaf):
    """The function that reads a literal: a scalar's location, or a new container of what its parts' readers
    say."""
    plain = scalar(literal)
    if isinstance(plain, (bool, int, float, str)):
        place = leaf(plain, path)
        return lambda: place.tracked
    if isinstance(literal, dict):
        parts = {key: _reader(part, (*path, str(key)), leaf) for key, part in literal.items()}
        return lambda: {key: read() for key, read in parts.items()}
    if isinstance(literal, (list, tuple)):
        kind = type(literal)
        parts = [_reader(part, (*path, str(index)), leaf) for index, part in enumerate(literal)]
        return lambda: kind([read() for read in parts])
    if hasattr(literal, '_slot_types'):
        return _message_reader(literal, path, leaf)
    raise TypeError(
        f'a {type(literal).__name__} cannot be a location: give a float, int, str or bool, or a '
        'message, list or dict of them'
    )


def _message_reader(message, path, leaf):
    pattern, parts = copy.deepcopy(message), []
    for field, kind in zip(message.__slots__, message._slot_types):
        part = getattr(message, field)
        if kind.startswith(('time', 'duration')):
            parts.append((field, functools.partial(copy.deepcopy, part)))
        elif kind.startswith(('uint8[', 'char[')) or (message._type, field) == ('std_msgs/Header', 'seq'):
            continue
        else:
            parts.append((field, _reader(part, (*path, field), leaf)))

    def read():
        fresh = copy.copy(pattern)
        for field, read_field in parts:
            setattr(fresh, field, read_field())
        return fresh

    return read


def marshal_tracked_values():
    """Let `rospy.set_param` take tracked values: xmlrpc marshals exact types only."""
    dispatch = xmlrpc.client.Marshaller.dispatch
    for plain in (float, int, bool, str):
        tracked = type(values.track(plain(), values.Source('/', 0)))
        dispatch.setdefault(
            tracked, lambda marshaller, value, write, plain=plain: dispatch[plain](marshaller, plain(value), write)
        )
