"""Finds out whether a recorded history of changes and readings can have happened in one order.

Every change writes a value that no other change writes, so it is known which change a reading has seen. All that
has to do with one value of one register (its change, and who has read it or replaced it) lies between the first end and
the last begin of these operations: while it did, no other value can have been in the register. This is the test of
Gibbons and Korach, "Testing Shared Memories", SIAM Journal on Computing 26 (1997).
"""

import math
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Tuple

#: What is wrong: an acknowledged change is gone; one was applied twice; one is seen at another place, or was never
#: made; one that was refused was applied; values were there in contradictory orders.
LOST, TWICE, ELSEWHERE, REFUSED, ORDER = 'lost', 'twice', 'elsewhere', 'refused', 'order'


class Operation(NamedTuple):
    """What a client has done, with times of one clock.

    Attributes:
        register: what was changed or read.
        begin, end: when it was called and when it returned, in seconds; `end` is infinite where the client never knew.
        outcome: `ok`, `refused`, or `unknown` where no answer came.
        written: the value of a change, which no other one writes; None for a reading.
        seen: the value that was read; of a change, the one that it has replaced, or None where that is not known.
    """

    register: str
    begin: float
    end: float
    outcome: str
    written: Any = None
    seen: Any = None


class Fault(NamedTuple):
    """Something that cannot be: its kind, where, and which operations show it."""

    kind: str
    register: str
    text: str


class _Zone(NamedTuple):
    """A value was certainly in its register from `first` to `last`; where `last` < `first`, at some moment between."""

    first: float
    last: float
    value: Any


def check(operations: Iterable[Operation], initial: Any = 0.0) -> List[Fault]:
    """All faults of a history.

    Args:
        operations: in any order.
        initial: what all registers have before the first operation.
    """
    history = list(operations)
    by_register: Dict[str, List[Operation]] = {}
    writers: Dict[Any, Operation] = {}
    for operation in history:
        by_register.setdefault(operation.register, []).append(operation)
        if operation.written is not None:
            if operation.written in writers or operation.written == initial:
                raise ValueError(f'{operation.written!r} is written twice by the clients: nothing can be said')
            writers[operation.written] = operation
    faults: List[Fault] = []
    for register, own in sorted(by_register.items()):
        faults += _check_register(register, own, writers, initial)
    return faults


def _check_register(
    register: str, operations: List[Operation], writers: Dict[Any, Operation], initial: Any
) -> List[Fault]:
    faults: List[Fault] = []
    readers: Dict[Any, List[Operation]] = {}
    replaced: Dict[Any, Operation] = {}
    for operation in operations:
        if operation.outcome != 'ok' or operation.seen is None:
            continue
        value = operation.seen
        fault = _fault_of_value(register, operation, writers, initial)
        if fault is not None:
            faults.append(fault)
            continue
        readers.setdefault(value, []).append(operation)
        if operation.written is not None:
            if value in replaced:
                faults.append(
                    Fault(TWICE, register, f'{value!r} was replaced twice, by {replaced[value]} and by {operation}')
                )
            replaced[value] = operation
    zones = [
        zone
        for value in {initial, *(one.written for one in operations if one.written is not None)}
        for zone in [_zone(value, writers.get(value), readers.get(value, []))]
        if zone is not None
    ]
    return faults + _contradictions(register, zones)


def _fault_of_value(
    register: str, operation: Operation, writers: Dict[Any, Operation], initial: Any
) -> Optional[Fault]:
    """What is wrong with the value that an operation has seen, whatever its time."""
    if operation.seen == initial:
        return None
    writer = writers.get(operation.seen)
    if writer is None or writer.register != register:
        return Fault(ELSEWHERE, register, f'{operation} has seen what {writer or "nobody"} has written')
    if writer.outcome == 'refused':
        return Fault(REFUSED, register, f'{operation} has seen what was refused, {writer}')
    if writer.begin > operation.end:
        return Fault(ORDER, register, f'{operation} has seen what was written later, {writer}')
    return None


def _zone(value: Any, writer: Optional[Operation], readers: List[Operation]) -> Optional[_Zone]:
    """None for a value that may never have been in the register."""
    if writer is None:  # the initial value, which was written before everything
        return _Zone(-math.inf, max((one.begin for one in readers), default=-math.inf), value)
    if writer.outcome == 'refused' or (writer.outcome == 'unknown' and not readers):
        return None
    # one without an answer may have been applied at any time after it was called
    end = writer.end if writer.outcome == 'ok' else math.inf
    return _Zone(min([end, *(one.end for one in readers)]), max([writer.begin, *(one.begin for one in readers)]), value)


def _contradictions(register: str, zones: List[_Zone]) -> List[Fault]:
    faults: List[Fault] = []
    long = sorted(zone for zone in zones if zone.first <= zone.last)
    for one, other in zip(long, long[1:]):
        if other.first < one.last:
            faults.append(
                Fault(ORDER, register, f'{one.value!r} and {other.value!r} were both there{_times(one, other)}')
            )
    for short in zones:
        if short.first <= short.last:
            continue
        for zone in long:
            if zone.first < short.last and short.first < zone.last:
                faults.append(
                    Fault(
                        LOST, register, f'{short.value!r} was written while {zone.value!r} stayed{_times(short, zone)}'
                    )
                )
                break
    return faults


def _times(*zones: _Zone) -> str:
    spans: List[Tuple[float, float]] = [(min(one.first, one.last), max(one.first, one.last)) for one in zones]
    return ' (' + ', '.join(f'{first:.4f} .. {last:.4f}' for first, last in spans) + ')'
