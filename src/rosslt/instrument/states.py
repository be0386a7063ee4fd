"""Finds the state variables of a program: counters, clocks and accumulators that keep their value from one round of an
endless loop, or from one callback, to the next.

A state sums up all earlier rounds. A changed literal cannot change those, so the present value of a state keeps no
provenance: a new value affects future steps only.
"""

import ast
import re
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Set, Tuple

from rosslt.instrument.callees import PARAMETER_CALLS
from rosslt.instrument.lifetimes import FUNCTIONS, Lifetimes, is_endless

_BLOCKS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Module)

#: Methods that fill an object for the first time.
_FILLING = {'__init__', '__new__', '__post_init__', 'setup', 'reset'}


class States(NamedTuple):
    """The statements of a program that start a state, and those that step it.

    Attributes:
        steps: the statements that carry a state on; the values that they assign lose their provenance. Each with the
            indices of the other targets that it unpacks its value to: what those get keeps its provenance.
        parts: the expressions in lists, dicts and calls that steps assign, that are computed from what the state was
            before: `x + 1` in `pose = Pose(x + 1, limit)`. They lose their provenance, and what is only moved keeps it.
        starts: the statements that assign a state its first value.
    """

    steps: Dict[ast.AST, List[int]]
    parts: Set[ast.AST]
    starts: Set[ast.AST]


class _Change(NamedTuple):
    target: str
    statement: ast.AST
    blocks: Tuple[ast.AST, ...]  # the compound statements around it, the scope first
    refers_to_itself: bool
    read: Set[Optional[str]]


def dotted(node: Optional[ast.AST]) -> Optional[str]:
    """`a.b.c` of a name or a chain of attributes; None for anything else."""
    parts: List[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        return None
    parts.append(node.id)
    return '.'.join(reversed(parts))


def reads_parameters(tree: ast.AST) -> Callable[[ast.Call], bool]:
    """Make the test whether a call in a program reads a parameter, also by a name of the program's own, as in
    `get = rospy.get_param`."""
    names = {
        alias.asname
        for one in ast.walk(tree)
        if isinstance(one, ast.ImportFrom)
        for alias in one.names
        if alias.asname and alias.name in PARAMETER_CALLS
    }
    for one in ast.walk(tree):
        if isinstance(one, ast.Assign) and (dotted(one.value) or '').split('.')[-1] in PARAMETER_CALLS:
            names.update(filter(None, map(dotted, one.targets)))

    def does(call: ast.Call) -> bool:
        last = getattr(call.func, 'attr', getattr(call.func, 'id', ''))
        return last in PARAMETER_CALLS or dotted(call.func) in names

    return does


def _place(node: Optional[ast.AST]) -> Optional[str]:
    """Return the dotted name of an expression with its elements: `self.position[0]`."""
    if isinstance(node, ast.Subscript):
        whole = _place(node.value)
        return whole and f'{whole}[{ast.dump(node.slice)}]'
    if isinstance(node, ast.Attribute):
        whole = _place(node.value)
        return whole and f'{whole}.{node.attr}'
    return node.id if isinstance(node, ast.Name) else None


def _root(place: str) -> str:
    return re.split(r'[.\[]', place, maxsplit=1)[0]


def find_states(tree: ast.Module) -> States:
    """The states of a program."""
    lifetimes = Lifetimes(tree)
    stepped: Dict[ast.AST, Set[str]] = {}
    parts: Set[ast.AST] = set()
    starts: Set[ast.AST] = set()
    module_states: Set[str] = set()
    by_scope: List[Tuple[ast.AST, List[_Change], Set[str]]] = []
    for scope in ast.walk(tree):
        if isinstance(scope, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Module)):
            changes = _with_detours(list(_changes(scope, scope.body, (scope,))))
            declared = {
                name for node in _within(scope) if isinstance(node, (ast.Global, ast.Nonlocal)) for name in node.names
            }
            by_scope.append((scope, changes, declared))
    owners = _classes_of(tree)
    attributes: Dict[Optional[ast.AST], Set[str]] = {}
    for scope, changes, declared in by_scope:
        states = _carried(scope, changes, declared, lifetimes)
        for change in changes:
            if change.target in states and change.refers_to_itself:
                stepped.setdefault(change.statement, set()).add(change.target)
                parts.update(_parts_computed(change, _by_target(changes)))
        local = {target for target in states if not target.startswith('self.') and _root(target) not in declared}
        starts.update(change.statement for change in changes if change.target in local and not change.refers_to_itself)
        module_states |= {target for target in states if _root(target) in declared}
        attributes.setdefault(owners.get(scope), set()).update(
            target for target in states if target.startswith('self.')
        )
    for scope, changes, declared in by_scope:
        own = attributes.get(owners.get(scope), set())
        for change in changes:
            if change.refers_to_itself:
                continue
            is_global = isinstance(scope, ast.Module) or _root(change.target) in declared
            if change.target in own or (is_global and change.target in module_states):
                starts.add(change.statement)
    return States({statement: _others(statement, targets) for statement, targets in stepped.items()}, parts, starts)


def _others(statement: ast.AST, states: Set[str]) -> List[int]:
    """The indices of the targets beside states that a statement unpacks its value to."""
    targets = getattr(statement, 'targets', [])
    parts = getattr(targets[0], 'elts', []) if len(targets) == 1 else []
    if any(isinstance(part, ast.Starred) for part in parts):
        return []
    return [index for index, part in enumerate(parts) if _place(part) not in states]


def _within(scope: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a scope, without those of the functions and classes in it."""
    waiting = list(ast.iter_child_nodes(scope))
    while waiting:
        node = waiting.pop()
        yield node
        if not isinstance(node, (*FUNCTIONS, ast.ClassDef)):
            waiting.extend(ast.iter_child_nodes(node))


def _classes_of(tree: ast.Module) -> Dict[ast.AST, ast.AST]:
    """The class that each method is in."""
    return {
        method: owner
        for owner in ast.walk(tree)
        if isinstance(owner, ast.ClassDef)
        for method in owner.body
        if isinstance(method, (ast.FunctionDef, ast.AsyncFunctionDef))
    }


def _changes(scope: ast.AST, body: List[ast.stmt], blocks: Tuple[ast.AST, ...]) -> Iterator[_Change]:
    for statement in body:
        if isinstance(statement, ast.AugAssign):
            target = _place(statement.target)
            if target:
                yield _Change(target, statement, blocks, True, _read(statement.value) | {target})
        elif isinstance(statement, (ast.Assign, ast.AnnAssign)) and statement.value is not None:
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            read = _read(statement.value)
            for target_node in targets:
                parts = target_node.elts if isinstance(target_node, (ast.Tuple, ast.List)) else [target_node]
                for part in parts:
                    target = _place(part)
                    if target:
                        yield _Change(target, statement, blocks, target in read, read)
        if not isinstance(statement, _BLOCKS):
            for name in ('body', 'orelse', 'finalbody', 'handlers', 'cases'):
                for part in getattr(statement, name, ()):
                    if isinstance(part, ast.stmt):
                        yield from _changes(scope, [part], (*blocks, statement))
                    elif hasattr(part, 'body'):  # of `except` and `case`
                        yield from _changes(scope, part.body, (*blocks, statement))


def _read(expression: ast.AST) -> Set[Optional[str]]:
    """The variables that are read in an expression."""
    places = (ast.Name, ast.Attribute, ast.Subscript)
    return {_place(node) for node in ast.walk(expression) if isinstance(node, places)}


def _by_target(changes: List[_Change]) -> Dict[str, List[_Change]]:
    found: Dict[str, List[_Change]] = {}
    for change in changes:
        found.setdefault(change.target, []).append(change)
    return found


def _with_detours(changes: List[_Change]) -> List[_Change]:
    """Changes that know whether they refer to themselves by other variables: `new = x + 1`, and then `x = new`."""
    by_target = _by_target(changes)
    return [
        change
        if change.refers_to_itself or not _refers_by_detour(change, by_target)
        else change._replace(refers_to_itself=True)
        for change in changes
    ]


def _refers_by_detour(change: _Change, by_target: Dict[str, List[_Change]]) -> bool:
    loop = _endless_loop(change)
    seen = set()
    waiting = list(change.read)
    while waiting:
        name = waiting.pop()
        if name is None or name in seen:
            continue
        seen.add(name)
        for earlier in by_target.get(name, ()):
            # A later assignment comes too late in this round: it is computed from this change, not the reverse.
            if _comes_before(earlier, change) and (loop is None or loop in earlier.blocks):
                if change.target in earlier.read:
                    return True
                waiting.extend(earlier.read)
    return False


def _parts_computed(change: _Change, by_target: Dict[str, List[_Change]]) -> Iterator[ast.expr]:
    """The expressions in a list, dict or call that a step assigns that are computed from what the state was before."""
    waiting = [getattr(change.statement, 'value', None)]
    while waiting:
        for part in _inner(waiting.pop()):
            read = _read(part)
            if change.target in read or _refers_by_detour(change._replace(read=read), by_target):
                waiting.append(part)
                name = _place(part)
                before = [one for one in by_target.get(name or '', ()) if _comes_before(one, change)]
                if name is None or not all(map(_moves, before)):
                    yield part


def _inner(expression: Optional[ast.AST]) -> List[ast.expr]:
    """The expressions that a list, tuple, dict or call is written with."""
    if isinstance(expression, ast.Call):
        given = [*expression.args, *(keyword.value for keyword in expression.keywords if keyword.arg)]
    elif isinstance(expression, ast.Dict):
        given = expression.values
    else:
        given = getattr(expression, 'elts', [])
    return [part for part in given if not isinstance(part, ast.Starred)]


def _moves(change: _Change) -> bool:
    """Return whether a statement assigns what stands elsewhere as it is: `x, y, _ = self.pose`."""
    value = getattr(change.statement, 'value', None)
    is_assigned = isinstance(change.statement, (ast.Assign, ast.AnnAssign))
    return is_assigned and all(_place(part) is not None for part in getattr(value, 'elts', [value]))


def _comes_before(earlier: _Change, change: _Change) -> bool:
    return earlier.statement.lineno < change.statement.lineno  # type: ignore[attr-defined]


def _endless_loop(change: _Change) -> Optional[ast.AST]:
    """The outermost loop around a change that goes round for as long as the node runs."""
    return next((block for block in change.blocks if isinstance(block, ast.While) and is_endless(block)), None)


def _carried(scope: ast.AST, changes: List[_Change], declared: Set[str], lifetimes: Lifetimes) -> Set[str]:
    """The targets in a scope that are states."""
    found = set()
    for change in changes:
        if not change.refers_to_itself or change.target in found:
            continue
        if _is_count(change) and any(isinstance(block, (ast.For, ast.While)) for block in change.blocks):
            found.add(change.target)
            continue
        loop = _endless_loop(change)
        root = _root(change.target)
        is_kept = root in declared or (root != change.target and lifetimes.outlives(scope, root))
        if loop is not None:
            around = change.blocks[change.blocks.index(loop) :]
        elif is_kept and getattr(scope, 'name', '') not in _FILLING:
            around = change.blocks
        else:
            continue
        others = [other for other in changes if not _is_part(other, scope, lifetimes)] if is_kept else changes
        if not any(_makes_anew(other, change, around) for other in others):
            found.add(change.target)
    return found


def _is_part(change: _Change, scope: ast.AST, lifetimes: Lifetimes) -> bool:
    """Return whether an assignment names a part of a lasting object: `first = self.particles[0]`."""
    is_name = isinstance(change.statement, ast.Assign) and _root(change.target) == change.target
    return is_name and lifetimes.is_lasting(scope, change.statement.value)  # type: ignore[attr-defined]


def _is_count(change: _Change) -> bool:
    statement = change.statement
    return (
        isinstance(statement, ast.AugAssign)
        and isinstance(statement.op, (ast.Add, ast.Sub))
        and isinstance(statement.value, ast.Constant)
        and type(statement.value.value) is int
    )


def _makes_anew(other: _Change, change: _Change, around: Tuple[ast.AST, ...]) -> bool:
    """Return whether another assignment replaces the target, or the object that holds it, in every round."""
    is_around = change.target.startswith(other.target) and change.target[len(other.target) :][:1] in ('', '.', '[')
    if other.refers_to_itself or not is_around:
        return False
    # In a block that is not entered every time, it may or may not; then the value can be one of an earlier round.
    return other.blocks[-1] in around and not _comes_before(change, other)
