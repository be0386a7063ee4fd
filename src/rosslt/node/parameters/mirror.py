"""The parameters below `<node>/rosslt`, and the one thread that keeps this node's values and all its parameters equal.

The node's memory holds the value in force; the parameter mirrors it, so that `rosparam get` shows it and
`rosparam set` changes it. All traffic with the master happens in one thread, which writes what has changed
here and reads what the master says has changed there: reading a location never waits for the network, and as
one thread does both, in order, memory and parameter always come to agree.
"""

import contextlib
import json
import re
import threading
from typing import Callable, Dict, Iterable, Iterator, List, Optional, Sequence, Tuple, Union

import rosgraph
import rospy

from rosslt.messages import Scalar
from rosslt.node.change.locks import LOCKS
from rosslt.node.change.owner_interface import Owner
from rosslt.node.json_scalars import Refused
from rosslt.node.locations.location import LiteralLocation, Location, put_in_force
from rosslt.node.no_master import NO_MASTER
from rosslt.node.parameters.server import (
    ParameterServer,
    Tree,
    as_shown,
    is_related,
    is_sent_alike,
    is_within,
    part_of,
    with_part,
)

#: The suffix that rospy appends to the name of an anonymous node: process and time.
ANONYMOUS = re.compile(r'_\d+_\d{13}$')

#: The namespace below a node's name that keeps what its parameters started from.
RECORDS = 'rosslt_records'

#: The parameter in it that keeps the last request that has changed something, to be taken back after a restart.
LAST_REQUEST = '_last_request'

#: The parameter in it that keeps the values that this node has given parameters, {name: value} as JSON.
SET_PARAMETERS = '_set_parameters'

#: The thread tries again after this many seconds if the master does not answer.
RETRY_PERIOD = 1.0


class Parameters:
    """Keeps parameters and the values behind them equal, from `start` on.

    `<node>/rosslt/<name>` shows the value of a literal, as JSON if no parameter can hold it. Beside it,
    `<node>/rosslt_records/<name>` keeps the literal that stood in the code, the id of its location, and the value, as
    JSON. At the next start a literal is known by its id: it has another name if rows above it were added or moved. If
    the code says another literal then, or none has that id, the value that an earlier run left is void.

    Args:
        owner: this node as the owner of locations.
        write_read: writes the parameters that this node reads as sources; returns their records, [(full name, text)].
        learn: called with the full name of any parameter that was set or deleted, in the one thread.

    Attributes:
        server: the parameter server.
        namespace: `<node>/rosslt`, '' before the node has a name.
        last_request: the last request, as `History.last` has written it; '' if there is none.
    """

    def __init__(
        self, owner: Owner, write_read: Callable[[], List[Tuple[str, Tree]]], learn: Callable[[str], None]
    ) -> None:
        self._owner, self._write_read, self._learn = owner, write_read, learn
        self._node = self.namespace = ''
        self.last_request: Tree = ''
        self.server = ParameterServer(self._notice)
        self._wake = threading.Condition()
        self._literals: Dict[str, LiteralLocation] = {}  # by name
        self._shown: Dict[LiteralLocation, None] = {}  # those that have been written, by an earlier run too
        self._unwritten: Dict[Union[Location, str], None] = {}  # an ordered set of locations and settings
        self._unread: Dict[str, None] = {}
        self._asked = 0  # requested writes, and how many of them are done
        self._done = 0
        self._is_answered = True  # by the master, when it was asked last
        self._is_cleared = False
        self._own: Tree = {}  # what others have set in the namespace
        self._records: Tree = {}
        self._left: Dict[int, str] = {}  # by id: the name under which an earlier run has left a literal's value
        self._renamed: Dict[LiteralLocation, str] = {}  # those that have another name since, with the earlier one
        self._set_parameters: Dict[str, Tree] = {}  # {name: value that this node has given it last}

    def start(self, node: str) -> None:
        """Begin, once this process is a node: read the values that an earlier run left.

        Args:
            node: the full name of this node; all below its `rosslt` namespace is listened to.
        """
        self._node, self.namespace = node, node + '/rosslt'
        self.server.start(self.namespace)
        self.server.subscribe(self.namespace)
        self._own = self.server.get(self.namespace)
        self._records = self.server.get(f'{node}/{RECORDS}')
        records = [(name, record) for name, record in _records_in(self._records) if len(record) == 3]
        self._left = {record[1]: name for name, record in records if isinstance(record[1], int)}
        self._set_parameters = _dict_in(part_of(self._records, SET_PARAMETERS))
        self.last_request = part_of(self._records, LAST_REQUEST) or ''
        if ANONYMOUS.search(node):
            rospy.on_shutdown(self._clear)  # its name does not come again
        threading.Thread(target=self._work, name='rosslt parameters', daemon=True).start()

    def setting(self, name: str) -> Tree:
        """Return the value that was set in the namespace, None if nothing was."""
        return part_of(self._own, name)

    def take_over(self, locations: Sequence[LiteralLocation]) -> None:
        """Start literals that the node has read with the values of their parameters, if these are still valid."""
        kept = [(location, self._kept(location)) for location in locations]
        pairs = [(location, value) for location, value in kept if value is not None]
        try:
            put_in_force(pairs)
        except Refused:  # by one of them: all others are taken
            for location, value in pairs:
                try:
                    put_in_force([(location, value)])
                except Refused as refused:
                    self._warn(location, refused)
        for location, _ in pairs:
            self._note_taken_over(location)

    def tell_lost(self, locations: Iterable[Location]) -> None:
        """Say of parameters that an earlier run has changed that they have been set to something else since."""
        for location in locations:
            left = self._set_parameters.get(location.name)
            if left is None or is_sent_alike(left, location.value):
                continue
            rospy.logwarn(
                '%s is %r: it was changed to %r in an earlier run, and set to another value since, as a launch file '
                'does; `rosslt save` would have kept it',
                location.name,
                location.value,
                left,
            )
            self.write(location)

    def take_over_unread(self, location: LiteralLocation) -> None:
        """Start a literal that nothing has read with the value of its parameter, if that is still valid."""
        value = self._kept(location)
        if value is not None:
            location.put(value)
            self._note_taken_over(location)

    def has_kept(self, name: str, location_id: int) -> bool:
        """Return whether a literal of that name and id begins with the value of a parameter, if that is valid."""
        is_given = part_of(self._own, name) is not None and len(read_record(part_of(self._records, name))) != 3
        return is_given or location_id in self._left

    def _name_left(self, location: LiteralLocation) -> str:
        """The name of the parameter that a literal begins with, if that is set."""
        record = read_record(part_of(self._records, location.name))
        is_own = len(record) == 3 and record[1] == location.id
        is_given = len(record) != 3 and part_of(self._own, location.name) is not None
        return location.name if is_own or is_given else self._left.get(location.id, location.name)

    def _kept(self, location: LiteralLocation) -> Optional[Scalar]:
        """The value of the parameter of a literal; None if it is not set or void."""
        name = self._name_left(location)
        value = part_of(self._own, name)
        if value is None:
            return None
        key = f'{self.namespace}/{name}'
        record = read_record(part_of(self._records, name))
        # A parameter without a record was not left by an earlier run: somebody, perhaps a launch file, has set it for
        # this one.
        said, location_id, kept = record if len(record) == 3 else (location.literal, location.id, value)
        if is_sent_alike(value, as_shown(kept)):
            value = kept
        # A literal edited from 1.0 to 1 in the running node was taken as the float 1.0; it is compared as a float.
        literal = float(location.literal) if type(said) is location.type is float else location.literal
        why = ''
        if location_id != location.id:
            if location_id in self._owner.locations.by_id:
                return None  # it has another name now
            why = 'is another number than in an earlier run'
        elif type(said) is not type(literal) or said != literal:
            why = f'now says {location.literal!r} where it said {said!r}'
        if why:
            if value != location.literal:
                rospy.loginfo('%s %s: the parameter %s = %r of it is dropped', location.place, why, key, value)
            return None
        try:
            return location.checked(value)
        except Refused as refused:
            self._warn(location, refused)
            return None

    def _warn(self, location: LiteralLocation, refused: Refused) -> None:
        key, value = f'{self.namespace}/{location.name}', location.value
        rospy.logwarn('%s goes on with %r, the parameter %s is not taken: %s', location.place, value, key, refused)

    def _note_taken_over(self, location: LiteralLocation) -> None:
        if location.value == location.literal:
            return
        location.remembered = True
        key = f'{self.namespace}/{location.name}'
        name = self._name_left(location)
        has_record = bool(read_record(part_of(self._records, name)))
        if has_record:
            self._shown[location] = None
        if name != location.name:
            self._renamed[location] = name
            self.write(location)
        rospy.loginfo(
            '%s is %r, %s; the code says %r (%s)',
            location.name,
            location.value,
            'from an earlier run' if has_record else f'as the parameter {key} says',
            location.literal,
            location.place,
        )

    def follow(self, location: LiteralLocation, is_written: bool) -> None:
        """Have `rosparam set` change a literal from now on, and show its value at once if `is_written`."""
        with self._wake:
            self._literals[location.name] = location
        if is_written:
            self.write(location)

    def write(self, *changed: Union[Location, str]) -> int:
        """Have the parameters of locations, and settings, follow soon; returns what `wait` waits for."""
        with self._wake:
            if not changed:
                return self._done
            self._unwritten.update(dict.fromkeys(changed))
            self._asked += 1
            self._wake.notify_all()
            return self._asked

    def wait(self, written: int, timeout: float) -> bool:
        """Wait until what `write` returned is done, for at most `timeout` seconds; True if it is."""
        with self._wake:
            return self._wake.wait_for(lambda: self._done >= written, timeout)

    def wait_for_all(self) -> bool:
        """Wait until all that was asked for is written, or the master does not answer; True if it is written."""
        with self._wake:
            self._wake.wait_for(lambda: self._done >= self._asked or not self._is_answered)
            return self._done >= self._asked

    def write_again(self, location: Location) -> None:
        """Have the record of a literal say what the code says now, if there is one."""
        if location in self._shown:
            self.write(location)

    def renew(self) -> None:
        """Show the values of literals, and the locks, to a new master, and subscribe to its parameters."""
        self.server.subscribe_again()
        self.last_request = ''
        self.write(*self._shown, *([LOCKS] if self._owner.access.locks else []))

    def _clear(self) -> None:
        """Delete this node's parameters, and write none again."""
        self._is_cleared = True
        with contextlib.suppress(*NO_MASTER):
            for namespace in ('rosslt', RECORDS):
                self.server.delete(f'{self._node}/{namespace}')

    def is_own(self, key: str) -> bool:
        """Return whether a parameter is one that rosslt itself stores for the locations of this node."""
        return bool(self._node) and any(is_within(key, f'{self._node}/{one}') for one in ('rosslt', RECORDS))

    def read(self, key: str) -> Tree:
        """Read a parameter without the parts that rosslt stores for this node's locations; None if it is not set."""
        value = rest = self.server.get(key)
        if self._node and is_within(self._node, key):
            for namespace in ('rosslt', RECORDS):
                rest = with_part(rest, f'{self._node}/{namespace}'[len(key.rstrip('/')) :], None)
        return rest if rest or not value else None

    def record_of_default(self, key: str) -> Tuple[str, List[Tree]]:
        """The name of the parameter that keeps what this node has set a parameter to whose default is in the code, and
        what an earlier run has left there."""
        return f'{self._node}/{RECORDS}/_{key}', read_record(part_of(self._records, '_' + key))

    def _notice(self, key: str) -> None:
        with self._wake:
            self._unread[key] = None
            self._wake.notify_all()

    def _work(self) -> None:
        while self._unwritten or not rospy.is_shutdown():
            with self._wake:
                self._wake.wait_for(lambda: self._unwritten or self._unread)
                asked, unwritten, unread = self._asked, self._unwritten, self._unread
                self._unwritten, self._unread = {}, {}
            try:
                self._write(list(unwritten))
                unwritten = {}  # written again, they would undo what was set since
                for key in list(unread):
                    self._read(key)
                    del unread[key]
            except NO_MASTER as error:
                why = f'the master does not answer ({error}); trying again'
                rospy.logwarn_throttle(30, 'parameters below %s do not follow, %s', self.namespace, why)
                with self._wake:
                    self._is_answered = False
                    self._wake.notify_all()
                rospy.rostime.wallsleep(RETRY_PERIOD)
                with self._wake:
                    self._unwritten.update(unwritten)
                    self._unread.update(unread)
                continue
            except Exception as error:
                # Without this thread, no parameter would follow any more.
                rospy.logerr('keeping parameters failed with %s: %.500s', type(error).__name__, error)
            with self._wake:
                self._done, self._is_answered = asked, True
                self._wake.notify_all()
        with self._wake:  # nobody asks it any more
            self._is_answered = False
            self._wake.notify_all()

    def _write(self, changed: List[Union[Location, str]]) -> None:
        if self._is_cleared:
            return
        pairs: List[Tuple[str, Tree]] = []
        has_read = False
        for one in changed:
            if isinstance(one, str):
                rows = self._owner.access.rows()
                self._own = with_part(self._own, one, rows)
                pairs.append((f'{self.namespace}/{one}', rows))
            elif isinstance(one, LiteralLocation):
                self._shown[one] = None
                pairs.append((f'{self.namespace}/{one.name}', as_shown(one.value)))
                record = [one.literal, one.next_id, one.value]
                pairs.append((f'{self._node}/{RECORDS}/{one.name}', json.dumps(record)))
                self._forget_name(one)
            else:
                has_read = True
                self._set_parameters[one.name] = one.value
        if has_read:
            pairs += self._write_read()
            pairs.append((f'{self._node}/{RECORDS}/{SET_PARAMETERS}', json.dumps(dict(self._set_parameters))))
        with self._owner.lock:
            last_request = self._owner.history.last()
        if last_request != self.last_request:
            pairs.append((f'{self._node}/{RECORDS}/{LAST_REQUEST}', last_request))
        self.server.set(pairs)
        self.last_request = last_request

    def _forget_name(self, location: LiteralLocation) -> None:
        """Delete what an earlier run has left of a literal under another name, unless another literal has that now."""
        name = self._renamed.pop(location, None)
        record = read_record(self.server.get(f'{self._node}/{RECORDS}/{name}')) if name else []
        if record[1:2] == [location.id]:
            for namespace in (self.namespace, f'{self._node}/{RECORDS}'):
                self.server.delete(f'{namespace}/{name}')

    def _read(self, key: str) -> None:
        """Take in what the master says of a parameter that was set, and of those above and below it."""
        if is_related(key, self.namespace):
            key = key if is_within(key, self.namespace) else self.namespace
            before, self._own = self._own, with_part(self._own, key[len(self.namespace) :], self.server.get(key))
            for name, location in list(self._literals.items()):
                if is_related(f'{self.namespace}/{name}', key):
                    self._take(location)
            for name in self._owner.settings:
                if not is_sent_alike(part_of(before, name), part_of(self._own, name)):
                    self._owner.set_setting(name, part_of(self._own, name))
        self._learn(key)

    def _take(self, location: LiteralLocation) -> None:
        """Put the parameter of a literal in force."""
        value = part_of(self._own, location.name)
        with self._wake:
            is_overtaken = location in self._unwritten
        # deleted, or about to be written: the value in force stays
        if value is None or is_overtaken or is_sent_alike(value, as_shown(location.value)):
            return
        try:
            self._owner.set_value(location, value, 'parameter server')
        except Refused as refused:
            rospy.logerr(
                'rosparam set %s/%s is refused, it is set back: %.500s', self.namespace, location.name, refused
            )
            self.write(location)


def kept_of(master: rosgraph.Master, node: str, name: str) -> Optional[Tuple[Tree, Tree]]:
    """Return the value that the code of a node gave a literal, and the value with which the node's next run begins if
    the code still gives it; None if no run has left one."""
    try:
        value = master.getParam(f'{node}/rosslt/{name}')
        record = read_record(master.getParam(f'{node}/{RECORDS}/{name}'))
    except rosgraph.MasterException:
        return None
    if len(record) != 3 or is_sent_alike(value, as_shown(record[0])):
        return None
    return record[0], value


def read_record(text: Tree) -> List[Tree]:
    """The content of a record; nothing if it is malformed."""
    try:
        record = json.loads(str(text))
    except (TypeError, ValueError, RecursionError):
        return []
    return record if isinstance(record, list) else []


def _records_in(tree: Tree, name: str = '') -> Iterator[Tuple[str, List[Tree]]]:
    """The records of literals in a tree of parameters, with their names."""
    for key, part in tree.items() if isinstance(tree, dict) else ():
        if not key.startswith('_'):
            yield from _records_in(part, f'{name}/{key}' if name else key)
    if name and not isinstance(tree, dict):
        yield name, read_record(tree)


def _dict_in(text: Tree) -> Dict[str, Tree]:
    """A dict that was written as JSON; an empty one if it is malformed."""
    try:
        found = json.loads(str(text))
    except (TypeError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
