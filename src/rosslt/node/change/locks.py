"""Access control: the requesters that may change a location of this node.

It guards against accidents, not against people: ROS 1 has no authentication, and requesters give their own name.
"""

import fnmatch
from typing import Any, Dict, List, NamedTuple, Optional

import rospy

from rosslt.node.json_scalars import Refused

ACCEPT_FROM, LOCKS = 'accept_changes_from', 'change_locks'

#: Parameters in the namespace of the locations that are settings of access.
SETTINGS = {ACCEPT_FROM, LOCKS}

#: The node as a whole, among the names of its locations.
WHOLE = ''


class Lock(NamedTuple):
    """A lock: its owner, and the reason."""

    who: str
    reason: str

    @property
    def text(self) -> str:
        """`locked by ada@desk: the robot is running`."""
        return f'locked by {self.who or "somebody"}' + (f': {self.reason}' if self.reason else '')


class Access:
    """The settings and locks that refuse a change before its values are checked.

    Attributes:
        accepted_from: requesters or patterns of them, as `fnmatch` takes them; None for all.
        locks: {name of a location, or WHOLE: Lock}.
    """

    def __init__(self) -> None:
        self._node = ''
        self.accepted_from: Optional[List[str]] = None
        self.locks: Dict[str, Lock] = {}

    def start(self, node: str) -> None:
        """Set the full name of this node, once it is known."""
        self._node = node

    def check(self, location: str, requester: str) -> None:
        """Raises Refused, with who and why, if a requester may not change a location of that name."""
        for name in (WHOLE, location):
            lock = self.locks.get(name)
            if lock is not None:
                raise Refused(f'{name_in_full(self._node, name)} is {lock.text}')
        if not self._accepts_from(requester):
            raise Refused(
                f'{self._node} takes changes from {" and ".join(self.accepted_from or []) or "nobody"} only, and this '
                f'one is from {requester or "somebody who does not say"}: see {self._node}/rosslt/{ACCEPT_FROM}'
            )

    def lock_of(self, location: str) -> str:
        """Say who has locked a location, and why; '' if nobody has locked that location alone."""
        return self.locks[location].text if location in self.locks else ''

    def _accepts_from(self, requester: str) -> bool:
        if self.accepted_from is None or requester == self._node:
            return True
        return any(fnmatch.fnmatchcase(requester, pattern) for pattern in self.accepted_from)

    def set(self, name: str, value: Any) -> None:
        """A parameter of SETTINGS was set; `{}` if it was deleted."""
        if name == ACCEPT_FROM:
            names = [value] if isinstance(value, str) else value
            if value == {}:
                self.accepted_from = None
            elif _is_list_of(names, str):
                self.accepted_from = names
            else:
                self.accepted_from = []
                rospy.logerr(
                    '%s/rosslt/%s is %.200r and no list of names: no changes are taken from others',
                    self._node,
                    name,
                    value,
                )
        else:
            self._set_locks([] if value == {} else value)

    def rows(self) -> List[List[str]]:
        """The locks as the parameter says them: [[name, who, reason], ...]."""
        return [[name, lock.who, lock.reason] for name, lock in self.locks.items()]

    def _set_locks(self, rows: object) -> None:
        if not isinstance(rows, list) or not all(_is_list_of(row, str) and len(row) == 3 for row in rows):
            raise Refused(f'{rows!r} is not a list of locks, [[LOCATION, WHO, WHY], ...]')
        self.locks = {name: Lock(who, reason) for name, who, reason in rows}


def name_in_full(node: str, name: str) -> str:
    """Return the name of a location of a node, or of the node for WHOLE, as others know it: a parameter has its full
    name already."""
    return name if name.startswith('/') else f'{node}/{name}'.rstrip('/')


def _is_list_of(value: object, kind: type) -> bool:
    return isinstance(value, list) and all(isinstance(one, kind) for one in value)
