"""The parameters that the positional arguments of a call go to, if the program itself says which function it calls."""

import ast
from collections import Counter
from typing import Any, Dict, Iterator, List, Optional

from rosslt.instrument.lifetimes import FUNCTIONS, positional_parameters

_FUNCTIONS = FUNCTIONS[:2]  # without lambdas


class Signatures:
    """The functions, classes and named tuples that a module defines at its top, each under a name that means nothing
    else in it, and the methods that one class alone has.

    Args:
        tree: of the module.
    """

    def __init__(self, tree: ast.Module) -> None:
        classes = [node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
        methods = [(one, part) for one in classes for part in one.body if isinstance(part, _FUNCTIONS)]
        of_classes = {id(part) for one in classes for part in one.body}
        bound = Counter(name for node in ast.walk(tree) if id(node) not in of_classes for name in _bound_by(node))
        last_star = max((node.lineno for node in tree.body if _imports_all(node)), default=0)
        self._known: Dict[str, Any] = {
            node.name: node
            for node in tree.body
            if isinstance(node, (*_FUNCTIONS, ast.ClassDef)) and bound[node.name] == 1 and node.lineno > last_star
        }
        self._tuples: Dict[str, List[str]] = {
            node.targets[0].id: _fields_of_tuple(node.value)
            for node in tree.body
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and node.lineno > last_star
            if bound[node.targets[0].id] == 1
        }
        assigned = {
            node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)
        }
        count = Counter(part.name for _, part in methods)
        self._own: Dict[int, Any] = {}  # by id of a call `self.f(...)`
        for one, method in methods:
            own = {part.name: part for part in one.body if isinstance(part, _FUNCTIONS)}
            if [argument.arg for argument in method.args.args[:1]] == ['self']:
                for call in (node for node in ast.walk(method) if isinstance(node, ast.Call)):
                    name = _of_self(call.func)
                    if name in own and count[name] == 1 and name not in assigned:
                        self._own[id(call)] = own[name]

    def parameter(self, call: ast.Call, index: int) -> Optional[str]:
        """The name of the parameter that takes an argument, None if it is not known.

        Args:
            call: the call.
            index: of the argument among its positional ones.
        """
        if any(isinstance(one, ast.Starred) for one in call.args[: index + 1]):
            return None
        name = call.func.id if isinstance(call.func, ast.Name) else ''
        called = self._known.get(name)
        if name in self._tuples:
            names = self._tuples[name]
        elif isinstance(called, ast.ClassDef):
            names = self._of_class(called)
        elif called is not None:
            names = [] if called.decorator_list else positional_parameters(called)
        else:
            names = _of_method(self._own.get(id(call)))
        return names[index] if index < len(names) else None

    def _of_class(self, made: ast.ClassDef) -> List[str]:
        """Return the parameters of a class's calls; none if they are not defined in the module."""
        own = {part.name: part for part in made.body if isinstance(part, _FUNCTIONS)}
        is_data = len(made.decorator_list) == 1 and _is_dataclass(made.decorator_list[0])
        if made.keywords or '__new__' in own or (made.decorator_list and not is_data):
            return []
        if '__init__' in own:
            return _of_method(own['__init__'])
        if is_data:
            return [] if made.bases else list(_fields(made))
        base = made.bases[0] if len(made.bases) == 1 else None
        if isinstance(base, ast.Call):
            return _fields_of_tuple(base)
        if _last(base) == 'NamedTuple':
            return list(_fields(made))
        name = base.id if isinstance(base, ast.Name) else ''
        if name in self._tuples:
            return self._tuples[name]
        inherited = self._known.get(name)
        if isinstance(inherited, ast.ClassDef) and inherited.lineno < made.lineno:
            return self._of_class(inherited)
        return []


def _bound_by(node: ast.AST) -> Iterator[str]:
    """The names to which a part of a program gives a meaning."""
    if isinstance(node, ast.alias):
        yield (node.asname or node.name).split('.')[0]
    elif isinstance(node, ast.Name):
        if not isinstance(node.ctx, ast.Load):
            yield node.id
    elif isinstance(node, ast.arg):
        yield node.arg
    elif isinstance(getattr(node, 'name', None), str):
        yield node.name  # type: ignore[attr-defined]


def _imports_all(node: ast.AST) -> bool:
    return isinstance(node, ast.ImportFrom) and node.names[0].name == '*'


def _of_self(function: ast.AST) -> str:
    is_of_self = isinstance(function, ast.Attribute) and getattr(function.value, 'id', '') == 'self'
    return function.attr if is_of_self else ''  # type: ignore[attr-defined]


def _of_method(method: Any) -> List[str]:
    """The parameters of a method without the object or class that it is called on; none if other decorators wrap it."""
    decorators = [getattr(one, 'id', '') for one in method.decorator_list] if method is not None else ['']
    if decorators == ['staticmethod']:
        return positional_parameters(method)
    return positional_parameters(method)[1:] if decorators in ([], ['classmethod']) else []


def _is_dataclass(decorator: ast.AST) -> bool:
    """Return whether a decorator is `dataclass`, and leaves the making of `__init__` as it is."""
    if isinstance(decorator, ast.Call):
        options = {one.arg for one in decorator.keywords}
        return not options & {'init', 'kw_only', None} and _is_dataclass(decorator.func)
    return _last(decorator) == 'dataclass'


def _last(name: Optional[ast.AST]) -> str:
    """The last part of a name: `dataclass` of `dataclasses.dataclass`."""
    return getattr(name, 'attr', getattr(name, 'id', ''))


def _fields(made: ast.ClassDef) -> Iterator[str]:
    """The fields of a dataclass or a NamedTuple that its calls take in order."""
    for part in made.body:
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
            words = {_last(one) for one in ast.walk(part.annotation)}
            if 'KW_ONLY' in words or isinstance(part.value, ast.Call):
                return  # `field(...)` may leave it out
            if 'ClassVar' not in words:
                yield part.target.id


def _fields_of_tuple(made: ast.expr) -> List[str]:
    """The fields of `namedtuple('Post', 'x y')` and `NamedTuple('Post', [('x', float)])`; none of anything else."""
    kind = _last(made.func) if isinstance(made, ast.Call) else ''
    if not isinstance(made, ast.Call) or kind not in ('namedtuple', 'NamedTuple'):
        return []
    if len(made.args) != 2 or any(one.arg not in ('defaults', 'module') for one in made.keywords):
        return []  # `rename` gives some other names
    try:
        fields = ast.literal_eval(made.args[1]) if kind == 'namedtuple' else _first_of_each(made.args[1])
    except (IndexError, TypeError, ValueError):
        return []  # they are not written there
    names = fields.replace(',', ' ').split() if isinstance(fields, str) else fields
    are_texts = isinstance(names, (list, tuple)) and all(isinstance(one, str) for one in names)
    return list(names) if are_texts else []


def _first_of_each(pairs: ast.expr) -> List[Any]:
    """The names in a list of (name, type)."""
    return [ast.literal_eval(getattr(pair, 'elts', [pair])[0]) for pair in getattr(pairs, 'elts', [])]
