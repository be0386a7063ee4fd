"""What of a program runs once, as its text says: the module itself, and the functions that it calls once."""

import ast
from typing import Any, Dict, Iterator, List, Set, Tuple

from rosslt.instrument.lifetimes import own_functions


def repeated_parts(tree: ast.AST) -> Set[int]:
    """The ids of the parts of a tree that may run more than once: bodies of functions, and loops."""
    parts: List[ast.AST] = []
    for one in ast.walk(tree):
        if isinstance(one, ast.Lambda):
            parts.append(one.body)
        elif isinstance(one, (ast.FunctionDef, ast.AsyncFunctionDef)):
            parts += one.body
        elif isinstance(one, ast.While):
            parts += [one.test, *one.body]
        elif isinstance(one, ast.For):
            parts += one.body
    return {id(inner) for part in parts for inner in ast.walk(part)}


def functions_run_once(tree: ast.Module, repeated: Set[int]) -> Iterator[Tuple[Any, Set[int]]]:
    """(a function that the program calls once, or several times one by one; the ids of what each call runs once).

    Each place that names the function, or the class of which it is the `__init__`, is a call, in the module itself or
    in a function of that kind.

    Args:
        tree: of the program.
        repeated: its `repeated_parts`.
    """
    mentions: Dict[str, Set[int]] = {}
    for one in ast.walk(tree):
        name = getattr(one, 'id', getattr(one, 'attr', getattr(one, 'value', None)))
        if isinstance(one, (ast.Name, ast.Attribute, ast.Constant)) and isinstance(name, str):
            mentions.setdefault(name, set()).add(id(one))
    called = {id(one): id(one.func) for one in ast.walk(tree) if isinstance(one, ast.Call)}
    once = {function for call, function in called.items() if call not in repeated}
    waiting = {
        name: made
        for name, made in own_functions(tree).items()
        if name != '__init__' and not any(getattr(one, 'decorator_list', ()) for one in made)
    }
    while True:
        begun = [name for name in waiting if name in mentions and mentions[name] <= once]
        if not begun:
            return
        for function in (function for name in begun for function in waiting.pop(name)):
            inner = ast.Module(function.body, [])  # type: ignore[attr-defined]
            run = {id(part) for part in ast.walk(inner)} - repeated_parts(inner)
            once |= {function for call, function in called.items() if call in run}
            yield function, run
