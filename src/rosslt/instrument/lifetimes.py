"""Finds the objects of a program that outlive the function that changes them, so that the next round sees the change.

A node keeps its state in `self`, in globals and in variables assigned before its endless loop, and passes it on:

    for particle in self.cloud:             state = State(x=1.0)
        move(particle)                      while not rospy.is_shutdown():
                                                state = update(state)

Changes that `move` and `update` make to attributes and elements of their parameters last, like those that a method
makes to `self`.
"""

import ast
from typing import Any, Dict, Iterator, List, Optional, Set, Tuple

FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
_SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Module)

#: A loop that calls one of these waits for the world: it goes round for as long as the node runs.
_WAITING = {'sleep', 'publish', 'spin', 'spin_once', 'sendTransform', 'wait_for_message', 'recv', 'read', 'is_shutdown'}

#: Functions and methods that return the elements of their arguments.
_ELEMENTS_OF = {'enumerate', 'zip', 'reversed', 'list', 'sorted', 'values', 'items'}


def root_of(node: Optional[ast.AST]) -> Optional[str]:
    """The `a` of `a`, `a.b.c` and `a[0].b`; None for anything else."""
    while isinstance(node, (ast.Attribute, ast.Subscript, ast.Starred)):
        node = node.value
    return node.id if isinstance(node, ast.Name) else None


def is_endless(loop: ast.While) -> bool:
    """Return whether a loop runs as long as the node: its condition is constant and true, or it waits or publishes."""
    if isinstance(loop.test, ast.Constant):
        return bool(loop.test.value)
    called = {_last(node.func) for node in ast.walk(loop) if isinstance(node, ast.Call)}
    return bool(called & _WAITING)


def own_functions(tree: ast.AST) -> Dict[str, List[ast.AST]]:
    """{name: the functions that a program defines by it}; a class is called as its `__init__`."""
    functions: Dict[str, List[ast.AST]] = {}
    for node in ast.walk(tree):
        if isinstance(node, FUNCTIONS[:2]):
            functions.setdefault(node.name, []).append(node)
        elif isinstance(node, ast.ClassDef):
            made = [part for part in node.body if isinstance(part, FUNCTIONS[:2]) and part.name == '__init__']
            functions.setdefault(node.name, []).extend(made)
    return functions


def positional_parameters(function: Any) -> List[str]:
    """The parameters of a function that positional arguments go to, in their order."""
    return [one.arg for one in [*getattr(function.args, 'posonlyargs', ()), *function.args.args]]


def bound_arguments(function: Any, call: ast.Call) -> Iterator[Tuple[str, ast.expr]]:
    """(parameter, argument) of a call of a function."""
    parameters = positional_parameters(function)
    names = {*parameters, *(one.arg for one in function.args.kwonlyargs)}
    if parameters[:1] in (['self'], ['cls']):
        del parameters[0]
    yield from zip(parameters, call.args)
    for keyword in call.keywords:
        if keyword.arg in names:
            yield str(keyword.arg), keyword.value


class Lifetimes:
    """Decides which objects of a program outlive the function that uses them.

    Args:
        tree: of the program.
    """

    def __init__(self, tree: ast.Module) -> None:
        self._scopes: Dict[ast.AST, _Scope] = {
            node: _Scope(node) for node in ast.walk(tree) if isinstance(node, _SCOPES)
        }
        self._module = self._scopes[tree]
        self._functions: Dict[str, List[_Scope]] = {}
        for node, scope in self._scopes.items():
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                self._functions.setdefault(node.name, []).append(scope)
        #: Parameters that are handed what outlives the function, as far as it is known.
        self._handed: Set[Tuple[_Scope, str]] = set()
        while self._hand_on():
            pass

    def outlives(self, scope: ast.AST, name: str) -> bool:
        """Return whether the object of a name outlives the function, so that changes of its parts last.

        The name itself may be a local one.
        """
        return self._outlives(self._scopes[scope], name)

    def is_lasting(self, scope: ast.AST, expression: ast.AST) -> bool:
        """Return whether an expression's value is, or is a part of, an object that outlives the function."""
        return self._is_lasting(self._scopes[scope], expression)

    def _outlives(self, scope: '_Scope', name: str, seen: Tuple[str, ...] = ()) -> bool:
        if name in seen:
            return False
        if name == 'self' or (scope, name) in self._handed:
            return True
        if name not in scope.bound:
            return scope is not self._module and name in self._module.bound
        seen = (*seen, name)
        return any(self._is_lasting(scope, whole, seen) for whole in scope.parts_of.get(name, ()))

    def _is_lasting(self, scope: '_Scope', expression: ast.AST, seen: Tuple[str, ...] = ()) -> bool:
        """Implement `is_lasting` for one scope; `seen` stops recursion through names that refer to each other."""
        if isinstance(expression, ast.Call) and _last(expression.func) in _ELEMENTS_OF:
            parts = [*expression.args, getattr(expression.func, 'value', None)]
            return any(part is not None and self._is_lasting(scope, part, seen) for part in parts)
        root = root_of(expression)
        if root is None:
            return False
        is_part = not isinstance(expression, ast.Name)
        return (is_part or root != 'self') and self._outlives(scope, root, seen)

    def _hand_on(self) -> bool:
        """Note the parameters that are handed what lasts; whether there was any that was not known."""
        before = len(self._handed)
        for scope in self._scopes.values():
            for call, loop in scope.calls:
                for function in self._functions.get(_last(call.func), ()):
                    for parameter, argument in bound_arguments(function.node, call):
                        if self._is_lasting(scope, argument) or scope.is_from_before(argument, loop):
                            self._handed.add((function, parameter))
        return len(self._handed) > before


class _Scope:
    """A function, or the module.

    Attributes:
        node: of the syntax tree.
        bound: the names that it gives a meaning, without those that it declares to be others'.
        parts_of: {name: the expressions that it is the value, a part or an element of}.
        calls: the calls in it, each with the endless loop around it, or None.
    """

    def __init__(self, node: ast.AST) -> None:
        self.node = node
        self.bound: Set[str] = set()
        self.parts_of: Dict[str, List[ast.AST]] = {}
        self.calls: List[Tuple[ast.Call, Optional[ast.AST]]] = []
        self._bound_in: Dict[str, Set[Optional[ast.AST]]] = {}
        self._anew_in: Dict[str, Set[Optional[ast.AST]]] = {}
        if not isinstance(node, ast.Module):
            arguments = node.args  # type: ignore[attr-defined]
            parameters = [*getattr(arguments, 'posonlyargs', ()), *arguments.args, *arguments.kwonlyargs]
            self.bound.update(one.arg for one in parameters)
        declared: Set[str] = set()
        for part, loop in _with_loops(node):
            if isinstance(part, ast.Call):
                self.calls.append((part, loop))
            elif isinstance(part, ast.Assign):
                for target in part.targets:
                    self._bind(target, part.value, loop)
            elif isinstance(part, (ast.For, ast.comprehension)):
                self._bind(part.target, part.iter, loop)
            elif isinstance(part, (ast.Global, ast.Nonlocal)):
                declared.update(part.names)
            elif isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store):
                self.bound.add(part.id)
        self.bound -= declared

    def is_from_before(self, argument: ast.AST, loop: Optional[ast.AST]) -> bool:
        """Return whether an argument of a call in an endless loop was bound before the loop, and not anew in it."""
        name = getattr(argument, 'id', '')
        is_before = bool(self._bound_in.get(name, set()) - {loop})
        return loop is not None and is_before and loop not in self._anew_in.get(name, ())

    def _bind(self, target: ast.AST, value: ast.AST, loop: Optional[ast.AST]) -> None:
        for name in ast.walk(target):
            if isinstance(name, ast.Name) and isinstance(name.ctx, ast.Store):
                self.bound.add(name.id)
                self._bound_in.setdefault(name.id, set()).add(loop)
                if not any(getattr(part, 'id', None) == name.id for part in ast.walk(value)):
                    self._anew_in.setdefault(name.id, set()).add(loop)
                self.parts_of.setdefault(name.id, []).append(value)


def _with_loops(scope: ast.AST) -> Iterator[Tuple[ast.AST, Optional[ast.AST]]]:
    """The nodes of a scope, without those of the functions and classes in it, each with the endless loop around it."""
    waiting: List[Tuple[ast.AST, Optional[ast.AST]]] = [(child, None) for child in ast.iter_child_nodes(scope)]
    while waiting:
        node, loop = waiting.pop()
        yield node, loop
        if isinstance(node, (*FUNCTIONS, ast.ClassDef)):
            continue
        if loop is None and isinstance(node, ast.While) and is_endless(node):
            loop = node
        waiting.extend((child, loop) for child in ast.iter_child_nodes(node))


def _last(function: ast.AST) -> str:
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, 'id', '')
