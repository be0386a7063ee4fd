"""The ROS parameters behind locations, and the one thread that keeps both equal.

The node's memory holds the value in force; the parameter mirrors it, so that `rosparam get` shows it and
`rosparam set` changes it. All traffic with the master happens in one thread, which writes what has changed
here and reads what the master says has changed there: reading a location never waits for the network, and as
one thread does both, in order, memory and parameter always come to agree.
"""

import contextlib
import json
import re
import threading
from typing import Any, Callable, Dict, List, Set, Tuple
from xml.parsers.expat import ExpatError
from xmlrpc.client import MultiCall, dumps, loads

import rosgraph
import rospy

from rosslt import files
from rosslt.node.json_scalars import Refused
from rosslt.node.locations import LiteralLocation
from rosslt.node.no_master import NO_MASTER
from rosslt.node.parameter_updates import ParameterUpdates

#: The suffix that rospy appends to the name of an anonymous node: process and time.
ANONYMOUS = re.compile(r'_\d+_\d{13}$')

#: The namespace below a node's name that keeps what its parameters started from.
RECORDS = 'rosslt_records'

#: The thread tries again after this many seconds where the master does not answer.
RETRY_PERIOD = 1.0


class Parameter:
    """A ROS parameter that the mirror keeps; the base of its kinds.

    Attributes:
        key: its full name.
        is_recorded: whether what it started from is written down beside it.
    """

    def __init__(self, key: str) -> None:
        self.key = key
        self.is_recorded = False

    def value(self) -> Any:
        """The value that the parameter should have."""
        raise NotImplementedError

    def pairs(self) -> List[Tuple[str, Any]]:
        """Return the parameters to set on the parameter server, [(full name, value)]."""
        return [(self.key, self.value())]

    def take(self, value: Any) -> None:
        """The parameter was set; raises Refused where the value is not accepted, and the parameter is set back."""
        raise NotImplementedError


class LiteralParameter(Parameter):
    """`<node>/rosslt/<name>`, behind the location of a literal.

    Beside it, `<node>/rosslt_records/<name>` keeps the literal that it started from, and the id of its location. Where
    the code says another literal at the next start, or another location has the name, what an earlier run left is void.

    Args:
        location: the location of the literal.
        changed: called with (location, value) where the parameter was set from outside; may raise Refused.
    """

    def __init__(self, node: str, location: LiteralLocation, changed: Callable[[LiteralLocation, Any], None]) -> None:
        super().__init__(f'{node}/rosslt/{location.name}')
        self.record_key = f'{node}/{RECORDS}/{location.name}'
        self.location = location
        self._changed = changed

    def value(self) -> Any:
        return self.location.value

    def pairs(self) -> List[Tuple[str, Any]]:
        if self.is_recorded:
            return super().pairs()
        self.is_recorded = True
        return [*super().pairs(), (self.record_key, [self.location.literal, f'{self.location.id:x}'])]

    def take(self, value: Any) -> None:
        self._changed(self.location, value)

    def take_over(self, left_behind: Dict[str, Any], records: Dict[str, Any]) -> None:
        """Start with what the parameter already says, where that still holds.

        Args:
            left_behind, records: what stands on the parameter server, by the name of the location.
        """
        location = self.location
        if location.name not in left_behind:
            return
        value = left_behind[location.name]
        record: Any = records.get(location.name)
        # A parameter without a record was not left by an earlier run: somebody, perhaps a launch file, has set it for
        # this one.
        is_left = isinstance(record, list) and len(record) == 2
        literal, location_id = record if is_left else (location.literal, f'{location.id:x}')
        # What says an int where a float is meant was taken for a float where it was edited in the running node.
        said = float(location.literal) if type(literal) is location.type is float else location.literal
        why = ''
        if location_id != f'{location.id:x}':
            why = 'is another number than in an earlier run'
        elif type(literal) is not type(said) or literal != said:
            why = f'now says {location.literal!r} where it said {literal!r}'
        if why:
            rospy.loginfo('%s %s: the parameter %s = %r of it is dropped', location.place, why, self.key, value)
            return
        try:
            location.put(location.checked(value))
        except Refused as refused:
            kept = location.value
            rospy.logwarn(
                '%s goes on with %r, the parameter %s is not taken: %s', location.place, kept, self.key, refused
            )
            return
        if location.value != location.literal:
            location.remembered = True
            rospy.loginfo(
                '%s is %r, %s; the code says %r (%s)',
                location.name,
                location.value,
                'from an earlier run' if is_left else f'as the parameter {self.key} says',
                location.literal,
                location.place,
            )


class ParameterMirror:
    """Keeps parameters and the values behind them equal, from `start` on.

    Args:
        namespace_set: called with (name below the node's `rosslt` namespace, value) where somebody sets a parameter
            there that is not mirrored; `{}` where it is deleted.
        set_elsewhere: called with the full name of any parameter that was set or deleted, in the one thread.

    Attributes:
        namespace: `<node>/rosslt`, '' before the node has a name.
        left_behind: what stood in that namespace at the start, by name.
        records: what the parameters of an earlier run started from, by name.
    """

    def __init__(self, namespace_set: Callable[[str, Any], None], set_elsewhere: Callable[[str], None]) -> None:
        self._namespace_set = namespace_set
        self._set_elsewhere = set_elsewhere
        self._node = self.namespace = ''
        self._updates: Any = None
        self._masters = threading.local()
        self._wake = threading.Condition()
        self._by_key: Dict[str, Parameter] = {}
        self._unwritten: Dict[Parameter, None] = {}  # an ordered set
        self._unread: Dict[str, None] = {}
        self._heard: Set[str] = set()  # keys that are subscribed to, with all below them
        self._asked = 0  # requested writes, and how many of them are done
        self._done = 0
        self._is_cleared = False
        self.left_behind: Dict[str, Any] = {}
        self.records: Dict[str, Any] = {}

    def start(self, node: str) -> None:
        """Begin, once this process is a node: read what an earlier run left.

        Args:
            node: the full name of this node; all below its `rosslt` namespace is listened to.
        """
        self._node = node
        self.namespace = node + '/rosslt'
        self._updates = ParameterUpdates(self.namespace, self._notice)
        self.subscribe(self.namespace)
        self.left_behind = flat(self.read(self.namespace, {}))
        self.records = flat(self.read(f'{node}/{RECORDS}', {}))
        threading.Thread(target=self._work, name='rosslt parameters', daemon=True).start()

    @property
    def _master(self) -> rosgraph.Master:
        """The master; XML-RPC's connections serve one thread each."""
        if not hasattr(self._masters, 'own'):
            self._masters.own = rosgraph.Master(rospy.get_name())
        return self._masters.own

    def add(self, parameter: Parameter) -> None:
        """Mirror a parameter of the node's `rosslt` namespace."""
        with self._wake:
            self._by_key[parameter.key] = parameter

    def write(self, *parameters: Parameter) -> int:
        """Have parameters follow, soon; returns what `wait` waits for."""
        with self._wake:
            if not parameters:
                return self._done
            self._unwritten.update(dict.fromkeys(parameters))
            self._asked += 1
            self._wake.notify_all()
            return self._asked

    def renew_literal(self, parameter: Parameter) -> None:
        """Record what the code says now beside a parameter that shows the value of a literal."""
        if parameter.is_recorded:
            parameter.is_recorded = False
            self.write(parameter)

    def wait(self, written: int, timeout: float) -> bool:
        """Wait until what `write` returned is done, for at most `timeout` seconds; True if it is."""
        with self._wake:
            return self._wake.wait_for(lambda: self._done >= written, timeout)

    def renew(self) -> None:
        """Show the values of literals to a new master, and follow what is set there."""
        heard, self._heard = self._heard, set()
        for key in heard:
            self.subscribe(key)
        for parameter in list(self._by_key.values()):
            self.renew_literal(parameter)

    def leave_nothing(self) -> None:
        """Have no parameter of this node outlive it: its name, an anonymous one, does not come again.

        What nodes have left that were called alike and ended without warning is cleared now.
        """
        rospy.on_shutdown(self._clear)
        kind = ANONYMOUS.sub('', self._node)
        left_behind = re.compile(re.escape(kind) + ANONYMOUS.pattern.rstrip('$') + r'(?=/rosslt(_[a-z]+)?/)')
        found = filter(None, map(left_behind.match, self._master.getParamNames()))
        for node in {one.group() for one in found} - {self._node}:
            try:
                self._master.lookupNode(node)
            except rosgraph.MasterError:
                self._delete(node)

    def _clear(self) -> None:
        """Delete this node's parameters, and write none again."""
        self._is_cleared = True
        with contextlib.suppress(*NO_MASTER):
            self._delete(self._node)

    def _delete(self, node: str) -> None:
        for namespace in ('rosslt', RECORDS):
            with contextlib.suppress(rosgraph.MasterError):  # there is none
                self._master.deleteParam(f'{node}/{namespace}')

    def is_own(self, key: str) -> bool:
        """Return whether a parameter is one that rosslt itself stores for the locations of this node."""
        return bool(self._node) and any(is_within(key, f'{self._node}/{one}') for one in ('rosslt', RECORDS))

    def read(self, key: str, default: Any) -> Any:
        """Read a parameter from the parameter server, without the parts that rosslt stores for this node's locations.

        Returns:
            The value; the default where the parameter is not set.
        """
        try:
            value = self._master.getParam(key)
        except rosgraph.MasterError:
            return default
        if not self._node or not is_within(self._node, key):
            return value
        rest = value
        for namespace in ('rosslt', RECORDS):
            rest = with_part(rest, f'{self._node}/{namespace}'[len(key.rstrip('/')) :], None)
        return rest if rest or not value else default

    def exchange(self, key: str, value: Any) -> Any:
        """Set a parameter; returns what it said until then, None where it was not set."""
        calls: Any = MultiCall(self._master.handle)
        calls.getParam(self._updates.name, key)
        calls.setParam(self._updates.name, key, value)
        (code, _, stood), (is_set, message, _) = calls()
        if is_set != 1:
            rospy.logwarn('the parameter %s is not set: %s', key, message)
        return stood if code == 1 else None

    def set(self, pairs: List[Tuple[str, Any]]) -> None:
        """Set parameters, all in one call of the master, which does not report them back to this process."""
        calls: Any = MultiCall(self._master.handle)
        keys: List[str] = []
        for key, value in pairs:
            try:
                calls.setParam(self._updates.name, key, as_sent(value))
                keys.append(key)
            except Refused as refused:
                rospy.logwarn('the parameter %s cannot show its value: %.500s', key, refused)
        for key, (code, message, _) in zip(keys, calls() if keys else ()):
            if code != 1:
                rospy.logwarn('the parameter %s is not set: %s', key, message)

    def record_key(self, key: str) -> str:
        """The name of the parameter that keeps what this node has set a parameter to that was not set before."""
        return f'{self._node}/{RECORDS}/_{key}'

    def was_default(self, key: str, value: Any) -> bool:
        """Return whether an earlier run set a parameter to that value because it had read the default in the code."""
        if self.records.get('_' + key) != [value]:
            return False
        try:
            return key not in json.loads(self.read(files.ORIGINS, '{}'))  # a launch file may have set it since
        except (TypeError, ValueError):  # what is there is not what `rosslt launch` writes
            return True

    def subscribe(self, key: str) -> None:
        """Follow changes of a key and of the keys below it, once this process is a node."""
        if self._updates is not None and not any(is_within(key, heard) for heard in self._heard):
            self._heard.add(key)
            self._updates.subscribe(self._master, key)

    def _notice(self, key: str, value: Any) -> None:
        """The master reports that a parameter, or a part of it, has been set."""
        with self._wake:
            self._unread[key] = None
            self._wake.notify_all()
        if not is_within(key, self.namespace):
            return
        for name, part in ((flat(value) if isinstance(value, dict) else {}) or {'': value}).items():
            full = f'{key}/{name}'.rstrip('/')
            if full not in self._by_key:
                self._namespace_set(full[len(self.namespace) + 1 :], part)

    def _work(self) -> None:
        while not rospy.is_shutdown():
            with self._wake:
                self._wake.wait_for(lambda: self._unwritten or self._unread)
                asked, unwritten, unread = self._asked, self._unwritten, self._unread
                self._unwritten, self._unread = {}, {}
            try:
                self._write(list(unwritten))
                for key in unread:
                    self._read(key)
            except NO_MASTER as error:
                why = f'the master does not answer ({error}); trying again'
                rospy.logwarn_throttle(30, 'parameters below %s do not follow, %s', self.namespace, why)
                rospy.rostime.wallsleep(RETRY_PERIOD)
                with self._wake:
                    for parameter in unwritten:
                        parameter.is_recorded = False
                    self._unwritten.update(unwritten)
                    self._unread.update(unread)
                continue
            except Exception as error:
                # Without this thread, no parameter would follow any more.
                rospy.logerr('keeping parameters failed with %s: %.500s', type(error).__name__, error)
            with self._wake:
                self._done = asked
                self._wake.notify_all()

    def _write(self, parameters: List[Parameter]) -> None:
        if not self._is_cleared:
            self.set([pair for parameter in parameters for pair in parameter.pairs()])

    def _read(self, key: str) -> None:
        """Take in what the master says of a parameter that was set, and of those above and below it."""
        for parameter in [one for name, one in list(self._by_key.items()) if is_related(name, key)]:
            value = self.read(parameter.key, None)
            with self._wake:
                is_overtaken = parameter in self._unwritten
            if value is None or is_overtaken:
                continue  # deleted, or about to be written: the value in force stays
            try:
                parameter.take(value)
            except Refused as refused:
                rospy.logerr('rosparam set %s is refused, it is set back: %.500s', parameter.key, refused)
                self.write(parameter)
        self._set_elsewhere(key)


def as_sent(value: Any) -> Any:
    """A value of a parameter as the master gets it.

    Raises:
        Refused: it cannot be sent: XML has no control characters, nor halves of others.
    """
    try:
        return loads(dumps((value,)).encode('utf-8'))[0][0]
    except (OverflowError, TypeError, ValueError, ExpatError) as error:
        raise Refused(f'the parameter server cannot hold {value!r}: {error}') from None


def is_sent_alike(one: Any, other: Any) -> bool:
    """Return whether two values are equal when sent to the master; False if one cannot be sent."""
    try:
        return dumps((one,), allow_none=True) == dumps((other,), allow_none=True)
    except (OverflowError, TypeError, ValueError):
        return False


def is_within(key: str, namespace: str) -> bool:
    """Return whether the parameter `key` is `namespace` itself or below it."""
    return key == namespace or key.startswith(namespace.rstrip('/') + '/')


def is_related(one: str, other: str) -> bool:
    """Return whether two parameters are the same, or one is below the other."""
    return is_within(one, other) or is_within(other, one)


def part_of(tree: Any, key: str) -> Any:
    """The part of a tree of parameters that has that name; None where there is none."""
    for step in key.split('/'):
        if step:
            tree = tree.get(step) if isinstance(tree, dict) else None
    return tree


def with_part(tree: Any, key: str, value: Any) -> Any:
    """A copy of a tree of parameters with another part of that name, or without it where the value is None."""
    first, _, rest = key.lstrip('/').partition('/')
    if not first:
        return value
    copied = dict(tree) if isinstance(tree, dict) else {}
    part = with_part(copied.get(first), rest, value)
    if part is not None:
        copied[first] = part
    else:
        copied.pop(first, None)
    return copied if copied or isinstance(tree, dict) else tree


def flat(tree: Any) -> Dict[str, Any]:
    """A tree of parameters as `{'a/b': value}`; `{}` for a value that is not a dict."""
    leaves: Dict[str, Any] = {}
    waiting = [('', tree)]
    while waiting:
        prefix, branch = waiting.pop()
        for name, value in branch.items() if isinstance(branch, dict) else ():
            if isinstance(value, dict):
                waiting.append((prefix + name + '/', value))
            else:
                leaves[prefix + name] = value
    return leaves
