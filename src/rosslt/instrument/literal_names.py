"""Names for number literals that are part of something else, `WAYPOINTS_2_x`, which outlive edits of other lines.

A name says what the whole is assigned to, or else which function is called with it, or runs there; then the keywords,
parameters, keys and indices on the way down to the number. What something is changed by is not what it is: the number
in `angle += 0.1` is `angle.step`. Lines and columns are not part of a name.
"""

import ast
import itertools
import re
from typing import Dict, List, Optional, Sequence, Set, Tuple

from rosslt.instrument.signatures import Signatures

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


def literal_names(tree: ast.Module, nodes: Sequence[Tuple[ast.expr, Optional[str]]]) -> List[Optional[str]]:
    """The name of each of some literals of a file, its words between dots; no two of those made here are the same.

    Args:
        tree: of the file.
        nodes: the literals in the order of the file, each with the name that it is the whole value of, or None.

    Returns:
        Their names; None for literals outside of assignments, calls and functions.
    """
    places = {
        id(child): (parent, field, index)
        for parent in ast.walk(tree)
        for field, value in ast.iter_fields(parent)
        for index, child in enumerate(value if isinstance(value, list) else [value])
        if isinstance(child, ast.AST)
    }
    signatures = Signatures(tree)
    assigned = [name and '.'.join([*_owner(node, places), re.sub(r'^self\.', '', name)]) for node, name in nodes]
    waiting: Set[Optional[str]] = set(filter(None, assigned))  # of which none has been met yet
    taken = set(waiting)
    found: List[Optional[str]] = []
    for (node, _), name in zip(nodes, assigned):
        made = name or '.'.join(_words(node, places, signatures)) or None
        if made in taken and not (name and name in waiting):
            made = next(other for at in itertools.count(2) for other in [f'{made}.{at}'] if other not in taken)
        waiting.discard(name)
        taken.add(made)
        found.append(made)
    return found


_Places = Dict[int, Tuple[ast.AST, str, int]]


def _words(node: ast.AST, places: _Places, signatures: Signatures) -> List[str]:
    words: List[str] = []  # from the number outward
    called = ''
    while id(node) in places:
        parent, field, index = places[id(node)]
        if isinstance(parent, (ast.List, ast.Tuple, ast.Set)):
            words.append(str(index))
        elif isinstance(parent, ast.Dict):
            key = parent.keys[index]
            words.append(str(key.value) if isinstance(key, ast.Constant) else str(index))
        elif isinstance(parent, ast.keyword):
            words.append(parent.arg or '')
        elif isinstance(parent, ast.Call) and field != 'func':
            if field == 'args':
                words += _argument(parent, index, signatures)
            called = (_target(parent.func) or [called])[-1]
        elif isinstance(parent, ast.arguments):
            words.append(_parameter(parent, field, index))
        elif isinstance(parent, ast.stmt):
            return (_assigned(parent, words) or ([called] if called else _function(parent, places))) + words[::-1]
        node = parent
    return []


def _owner(node: ast.AST, places: _Places) -> List[str]:
    """The class of which a literal is the default of a field, as of a dataclass; none for others."""
    statement, _, _ = places.get(id(node), (None, '', 0))
    owner, _, _ = places.get(id(statement), (None, '', 0))
    is_field = isinstance(statement, ast.AnnAssign) and isinstance(owner, ast.ClassDef)
    return [owner.name] if is_field and isinstance(owner, ast.ClassDef) else []


def _argument(call: ast.Call, index: int, signatures: Signatures) -> List[str]:
    """The parameter that takes an argument, or its index if that is not known; no word for the only argument."""
    parameter = signatures.parameter(call, index)
    if parameter is not None:
        return [parameter] if call.args[1:] or call.keywords else []
    return [str(index)] if call.args[1:] else []


def _parameter(arguments: ast.arguments, field: str, index: int) -> str:
    """The parameter that a default belongs to."""
    if field == 'kw_defaults':
        return arguments.kwonlyargs[index].arg
    positional = [*getattr(arguments, 'posonlyargs', ()), *arguments.args]
    return positional[len(positional) - len(arguments.defaults) + index].arg


def _assigned(statement: ast.stmt, words: List[str]) -> List[str]:
    """The words of what a statement assigns to; of `x, y = 1.0, 2.0` the one of a number, whose index is taken."""
    value: Optional[ast.expr]
    if isinstance(statement, ast.AugAssign):
        return [*_target(statement.target), 'step']
    if isinstance(statement, ast.Assign):
        target, value = statement.targets[0], statement.value
    elif isinstance(statement, ast.AnnAssign):
        target, value = statement.target, statement.value
    else:
        return []
    if (
        isinstance(target, (ast.Tuple, ast.List))
        and words
        and words[-1].isdigit()
        and int(words[-1]) < len(target.elts)
    ):
        at = int(words.pop())
        target, value = target.elts[at], value.elts[at] if isinstance(value, (ast.Tuple, ast.List)) else None
    named = _target(target)
    while isinstance(value, ast.BinOp):
        value = value.left
        if named and _target(value) == named:
            return [*named, 'step']
    return named


def _target(target: ast.AST) -> List[str]:
    """The words of `self.poses['left'].x`: `poses`, `left` and `x`; none if it is anything else."""
    if isinstance(target, ast.Name):
        return [] if target.id == 'self' else [target.id]
    if isinstance(target, ast.Attribute):
        return [*_target(target.value), target.attr]
    if isinstance(target, ast.Subscript):
        key = getattr(target.slice, 'value', None)  # of Python 3.8 an ast.Index
        key = key.value if isinstance(key, ast.Constant) else key
        return [*_target(target.value), str(key)] if isinstance(key, (int, str)) else _target(target.value)
    return []


def _function(node: ast.AST, places: _Places) -> List[str]:
    """The function that a statement stands in, or is; none for one of the module or of a class."""
    while not isinstance(node, _FUNCTIONS):
        if id(node) not in places:
            return []
        node = places[id(node)][0]
    return [node.name]
