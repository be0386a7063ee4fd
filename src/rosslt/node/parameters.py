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
from rosslt.node.locations import LiteralLocation, namespaces_of
from rosslt.node.no_master import NO_MASTER
from rosslt.node.parameter_updates import ParameterUpdates

#: What rospy appends to the name of an anonymous node: process and time.
ANONYMOUS = re.compile(r'_\d+_\d{13}$')

#: Where below a node's name is kept what its parameters started from.
_RECORDS = 'rosslt_literals', 'rosslt_ids', 'rosslt_defaults'

#: The thread tries again after this many seconds where the master does not answer.
RETRY_PERIOD = 1.0


def default_key(node: str, key: str) -> str:
    """Where a node keeps what its code had as the default of a parameter that it has set since, and what it has set."""
    return f'{node}/rosslt_defaults{key}'


class Parameter:
    """One ROS parameter that the mirror keeps; the base of its kinds.

    Attributes:
        key: its full name.
        is_set: whether it is known to be on the parameter server; what is not was read as a default in the code.
        is_kept: whether it is set again at a new master that does not have it.
        is_dropped: whether it is mirrored no more.
    """

    is_kept = False
    is_dropped = False

    def __init__(self, key: str) -> None:
        self.key = key
        self.is_set = True

    def value(self) -> Any:
        """The value that the parameter should have."""
        raise NotImplementedError

    @property
    def records(self) -> List[Tuple[str, Any]]:
        """What is written beside it: (full name, value)."""
        return []

    def take(self, value: Any) -> None:
        """The parameter was set; raises Refused where the value is not accepted, and the parameter is set back."""
        raise NotImplementedError


class LiteralParameter(Parameter):
    """`<node>/rosslt/<name>`, behind the location of a literal.

    Beside it, `<node>/rosslt_literals/<name>` keeps the literal that it started from. Where the code says
    another one at the next start, what an earlier run left behind is void. `<node>/rosslt_ids/<name>` keeps which
    literal that was, where its name does not say so: one that is its place is that of another one after an edit.

    Args:
        location: the location of the literal.
        changed: called with (location, value) where the parameter was set from outside; may raise Refused.
    """

    def __init__(self, node: str, location: LiteralLocation, changed: Callable[[LiteralLocation, Any], None]) -> None:
        super().__init__(f'{node}/rosslt/{location.name}')
        self.literal_key = f'{node}/rosslt_literals/{location.name}'
        self.id_key = f'{node}/rosslt_ids/{location.name}'
        self.location = location
        self._changed = changed

    def value(self) -> Any:
        return self.location.value

    @property
    def records(self) -> List[Tuple[str, Any]]:
        location = self.location
        ids = [] if location.is_known_by_name else [(self.id_key, f'{location.id:x}')]
        return [(self.literal_key, location.literal), *ids]

    def take(self, value: Any) -> None:
        self._changed(self.location, value)

    def take_over(self, left_behind: Dict[str, Any], literals: Dict[str, Any], ids: Dict[str, Any]) -> None:
        """Start with what the parameter already says, where that still holds.

        Args:
            left_behind, literals, ids: what stands on the parameter server, by the name of the location.
        """
        location = self.location
        if location.name not in left_behind:
            return
        value = left_behind[location.name]
        if not location.is_known_by_name and ids.get(location.name, f'{location.id:x}') != f'{location.id:x}':
            rospy.loginfo(
                '%s is another number than in an earlier run: its parameter %s = %r is dropped',
                location.place,
                self.key,
                value,
            )
            return
        # A parameter without a recorded literal was not left by an earlier run: somebody, perhaps a
        # launch file, has set it for this one.
        literal = literals.get(location.name, location.literal)
        # What says an int where a float is meant was taken for a float where it was edited in the running node.
        said = float(location.literal) if type(literal) is location.type is float else location.literal
        if type(literal) is not type(said) or literal != said:
            rospy.loginfo(
                '%s now says %r where it said %r: the parameter %s = %r of an earlier run is dropped',
                location.place,
                location.literal,
                literal,
                self.key,
                value,
            )
            return
        try:
            location.put(location.checked(value))
        except Refused as refused:
            rospy.logwarn(
                'the parameter %s is not taken, %s goes on with %r: %s',
                self.key,
                location.place,
                location.value,
                refused,
            )
            return
        if location.value != location.literal:
            location.remembered = True
            rospy.loginfo(
                '%s is %r, %s; the code says %r (%s)',
                location.name,
                location.value,
                'from an earlier run' if location.name in literals else f'as the parameter {self.key} says',
                location.literal,
                location.place,
            )


class ParameterMirror:
    """Keeps parameters and the values behind them equal, from `start` on.

    Args:
        namespace_set: called with (name below the node's `rosslt` namespace, value) where somebody sets a parameter
            there that is not mirrored; `{}` where it is deleted.

    Attributes:
        left_behind: what stood in the node's `rosslt` namespace at the start, by name.
        literals: the literals that the parameters of an earlier run started from, by name.
        ids: which literals those were whose name does not say so, by name.
        defaults: the parameters that an earlier run has set, and that the code has a default for, by their full name
            without the first slash: (that default, the value).
    """

    def __init__(self, namespace_set: Callable[[str, Any], None]) -> None:
        self._namespace_set = namespace_set
        self._node = self._namespace = ''
        self._updates: Any = None
        self._masters = threading.local()
        self._wake = threading.Condition()
        self._by_key: Dict[str, Parameter] = {}
        self._unwritten: Dict[Parameter, None] = {}  # an ordered set
        self._unread: Dict[Parameter, None] = {}
        self._recorded: Set[Parameter] = set()  # parameters whose literal is written down
        self._heard: Set[str] = set()  # keys that are subscribed to, with all below them
        self._asked = 0  # requested writes, and how many of them are done
        self._done = 0
        self._is_cleared = False
        self.left_behind: Dict[str, Any] = {}
        self.literals: Dict[str, Any] = {}
        self.ids: Dict[str, Any] = {}
        self.defaults: Dict[str, Any] = {}

    def start(self, node: str) -> None:
        """Begin, once this process is a node: read what an earlier run left, and follow what is there by now.

        Args:
            node: the full name of this node; all below its `rosslt` namespace is listened to.
        """
        self._node = node
        self._namespace = node + '/rosslt'
        self._updates = ParameterUpdates(self._namespace, self._notice)
        self._subscribe(self._namespace)
        self.left_behind = flat(self.read(self._namespace, {}))
        self.literals, self.ids, self.defaults = (flat(self.read(node + '/' + name, {})) for name in _RECORDS)
        for key in list(self._by_key):
            self._subscribe_unheard(key)
        threading.Thread(target=self._work, name='rosslt parameters', daemon=True).start()

    @property
    def _master(self) -> rosgraph.Master:
        """The master; XML-RPC's connections serve one thread each."""
        if not hasattr(self._masters, 'own'):
            self._masters.own = rosgraph.Master(rospy.get_name())
        return self._masters.own

    def add(self, parameter: Parameter) -> None:
        """Mirror a parameter from now on, or from the start on."""
        with self._wake:
            self._by_key[parameter.key] = parameter
        if self._updates is not None:
            self._subscribe_unheard(parameter.key)

    def remove(self, parameter: Parameter) -> None:
        """Mirror a parameter no more."""
        with self._wake:
            parameter.is_dropped = True
            if self._by_key.get(parameter.key) is parameter:
                del self._by_key[parameter.key]

    def write(self, *parameters: Parameter) -> int:
        """Have parameters follow, soon; returns what `wait` waits for."""
        with self._wake:
            if not parameters:
                return self._done
            self._unwritten.update(dict.fromkeys(parameters))
            for parameter in parameters:
                parameter.is_set = True
            self._asked += 1
            self._wake.notify_all()
            return self._asked

    def read_again(self, key: str) -> int:
        """Have what stands at a key, above or below it be read again; returns what `wait` waits for."""
        with self._wake:
            self._unread.update((self._by_key[name], None) for name in self._related(key))
            self._asked += 1
            self._wake.notify_all()
            return self._asked

    def renew_literal(self, parameter: Parameter) -> None:
        """Record what the code says now beside a parameter that shows the value of a literal."""
        if parameter in self._recorded:
            self._recorded.discard(parameter)
            self.write(parameter)

    def wait(self, written: int, timeout: float) -> bool:
        """Wait until what `write` returned is done, for at most `timeout` seconds; True if it is."""
        with self._wake:
            return self._wake.wait_for(lambda: self._done >= written, timeout)

    def renew(self) -> None:
        """Set all parameters again at a new master; of those that are not this node's own, what it lacks."""
        for key in self._heard:
            self._updates.subscribe(self._master, key)
        shown = list(self._recorded)
        self._recorded.clear()
        for parameter in list(self._by_key.values()):
            if parameter.is_kept and parameter.is_set:
                if self.read(parameter.key, None) is None:
                    shown.append(parameter)
                else:
                    self.read_again(parameter.key)
        self.write(*shown)

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
        for namespace in ('rosslt', *_RECORDS):
            with contextlib.suppress(rosgraph.MasterError):  # there is none
                self._master.deleteParam(f'{node}/{namespace}')

    def read(self, key: str, *default: Any) -> Any:
        """What a parameter says on the parameter server now, without what is kept there for the locations of this
        node; KeyError where it is not set and has no default."""
        namespace = key.rstrip('/') + '/'
        with contextlib.suppress(rosgraph.MasterError):
            value = self._master.getParam(key)
            if not self._node or not (self._node + '/').startswith(namespace):
                return value
            rest = _without_records(value, self._node[len(namespace) :])
            if rest or not value:
                return rest
        if default:
            return default[0]
        raise KeyError(key)

    def was_default(self, key: str, value: Any) -> bool:
        """Whether an earlier run has set a parameter to that value, where it had read the default in the code."""
        record = self.defaults.get(key.lstrip('/'))
        if not isinstance(record, list) or len(record) != 2 or not files.equal(record[1], value):
            return False
        try:
            return key not in json.loads(self.read(files.ORIGINS, '{}'))  # a launch file may have set it since
        except (TypeError, ValueError):  # what is there is not what `rosslt launch` writes
            return True

    def _subscribe_unheard(self, key: str) -> None:
        if not any(name in self._heard for name in [key, *namespaces_of(key)]):
            self._subscribe(key)

    def _subscribe(self, key: str) -> None:
        """Subscribe to changes of a key and of the keys below it."""
        self._heard.add(key)
        self._updates.subscribe(self._master, key)

    def _notice(self, key: str, value: Any) -> None:
        """The master reports that a parameter, or a part of it, has been set."""
        with self._wake:
            for name in [key] if key in self._by_key else self._related(key):
                self._unread[self._by_key[name]] = None
            self._wake.notify_all()
        if not (key + '/').startswith(self._namespace + '/'):
            return
        for name, part in ((flat(value) if isinstance(value, dict) else {}) or {'': value}).items():
            full = f'{key}/{name}'.rstrip('/')
            if full not in self._by_key:
                self._namespace_set(full[len(self._namespace) + 1 :], part)

    def _related(self, key: str) -> List[str]:
        """The keys of parameters that are set where one is: it, those above it, those below it."""
        return [
            name for name in self._by_key if key == name or name.startswith(key + '/') or key.startswith(name + '/')
        ]

    def _work(self) -> None:
        while not rospy.is_shutdown():
            with self._wake:
                self._wake.wait_for(lambda: self._unwritten or self._unread)
                asked, unwritten, unread = self._asked, list(self._unwritten), list(self._unread)
                self._unwritten.clear()
                self._unread.clear()
            try:
                self._write(unwritten)
                for parameter in unread:
                    self._take(parameter)
            except NO_MASTER as error:
                rospy.logwarn_throttle(
                    30,
                    'parameters below %s do not follow, the master does not answer (%s); trying again',
                    self._namespace,
                    error,
                )
                rospy.rostime.wallsleep(RETRY_PERIOD)
                self.write(*unwritten, *unread)
                continue
            with self._wake:
                self._done = asked
                self._wake.notify_all()

    def _write(self, parameters: List[Parameter]) -> None:
        """Set parameters, all in one call of the master, which does not report them back to this process."""
        if self._is_cleared:
            return
        calls: Any = MultiCall(self._master.handle)
        keys: List[str] = []
        for parameter in parameters:
            if parameter.is_dropped:
                continue
            pairs = [(parameter.key, parameter.value())]
            if parameter not in self._recorded:
                pairs += parameter.records
            if isinstance(parameter, LiteralParameter):
                self._recorded.add(parameter)
            for key, value in pairs:
                try:
                    loads(dumps((value,)).encode('utf-8'))  # XML has no control characters, nor halves of others
                except (OverflowError, TypeError, ValueError, ExpatError) as error:
                    rospy.logwarn('the parameter %s cannot show %r: %s', key, value, error)
                else:
                    calls.setParam(self._updates.name, key, value)
                    keys.append(key)
        if keys:
            for key, (code, message, _) in zip(keys, calls()):
                if code != 1:
                    rospy.logwarn('the parameter %s is not set: %s', key, message)

    def _take(self, parameter: Parameter) -> None:
        if parameter.is_dropped:
            return
        value = self.read(parameter.key, None)
        with self._wake:
            overtaken = parameter in self._unwritten
        parameter.is_set = value is not None or overtaken
        if value is None or overtaken:
            return  # deleted, or about to be written: the value in force stays
        try:
            parameter.take(value)
        except Refused as refused:
            rospy.logerr('rosparam set %s is refused, it stays %r: %.500s', parameter.key, parameter.value(), refused)
            self.write(parameter)
        except NO_MASTER:
            raise
        except Exception as error:
            # Without this thread, no parameter would follow any more.
            rospy.logerr('rosparam set %s failed with %s: %.500s', parameter.key, type(error).__name__, error)


def _without_records(tree: Any, node: str) -> Any:
    """A tree of parameters without what is kept in it for the locations of a node.

    Args:
        node: its name below the tree.
    """
    if not isinstance(tree, dict):
        return tree
    if not node:
        return {name: part for name, part in tree.items() if name not in ('rosslt', *_RECORDS)}
    first, _, below = node.partition('/')
    rest = {name: _without_records(part, below) if name == first else part for name, part in tree.items()}
    return {name: part for name, part in rest.items() if name != first or part != {} or tree[name] == {}}


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
