"""Finds the expressions whose numbers a program counts or decides by: what comes of that does not know of the number.

    for i in range(N_SHELVES):          row = [0.0] * COLUMNS          if MODE == 2:
        shelves.append(make(i))

In a round, it is counted and decided anew. In the set-up, what was made stays as it is.
"""

import ast
from typing import Collection, Dict, Iterator, List, Set, Tuple

from rosslt.instrument.callees import STRICT_DECORATORS
from rosslt.instrument.lifetimes import FUNCTIONS, is_endless
from rosslt.instrument.set_up_names import code_run_once
from rosslt.instrument.states import dotted

#: Functions of other packages that take counts: the first and the last of their arguments that are, and their keywords.
_COUNTS: Dict[str, Tuple[int, int, Tuple[str, ...]]] = {
    'collections.deque': (1, 1, ('maxlen',)),
    'numpy.arange': (0, 2, ('start', 'stop', 'step')),
    'numpy.empty': (0, 0, ('shape',)),
    'numpy.eye': (0, 1, ('N', 'M')),
    'numpy.full': (0, 0, ('shape',)),
    'numpy.identity': (0, 0, ('n',)),
    'numpy.linspace': (2, 2, ('num',)),
    'numpy.logspace': (2, 2, ('num',)),
    'numpy.ones': (0, 0, ('shape',)),
    'numpy.repeat': (1, 1, ('repeats',)),
    'numpy.tile': (1, 1, ('reps',)),
    'numpy.zeros': (0, 0, ('shape',)),
    'range': (0, 2, ()),
    'rospy.Publisher': (99, 99, ('queue_size',)),
    'rospy.Subscriber': (99, 99, ('queue_size',)),
}


def plain_readings(tree: ast.Module, bound: Collection[str]) -> Dict[int, str]:
    """{id of an expression: what counts or decides by it}, as `range`, `numpy.zeros` and `if`.

    Decisions are found in what runs once: all others are taken in rounds, too.

    Args:
        tree: of the program.
        bound: the names that the program itself gives a meaning.
    """
    once, _ = code_run_once(tree)
    origins = _origins(tree)
    if 'range' not in bound and '*' not in bound:
        origins['range'] = 'range'
    found: Dict[int, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name = _origin(node.func, origins)
            if name in _COUNTS:
                found.update({id(part): name for count in _counts(node, name) for part in _readings(count)})
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
            for whole, number in ((node.left, node.right), (node.right, node.left)):
                if isinstance(whole, (ast.List, ast.Tuple, ast.ListComp)):
                    found.update({id(part): 'the length of a list' for part in _readings(number)})
        elif id(node) in once and isinstance(node, (ast.If, ast.IfExp, ast.While)):
            if not (isinstance(node, ast.While) and is_endless(node)):
                kind = 'while' if isinstance(node, ast.While) else 'if'
                found.update({id(part): kind for part in _decided_by(node.test)})
    strict = [node for node in ast.walk(tree) if isinstance(node, FUNCTIONS[:2]) and _is_compiled(node)]
    for part in (part for function in strict for part in ast.walk(function)):
        found.pop(id(part), None)
    return found


def _origins(tree: ast.AST) -> Dict[str, str]:
    """{name: the module, or the function of a module, that it is imported as}, without names of anything else."""
    imported: Dict[str, Set[str]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                origin = alias.name if alias.asname else alias.name.split('.')[0]
                imported.setdefault(alias.asname or origin, set()).add(origin)
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                origin = f'{"." * node.level}{node.module or ""}.{alias.name}'
                imported.setdefault(alias.asname or alias.name, set()).add(origin)
        elif isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            imported.setdefault(node.id, set()).add('')
        elif isinstance(node, ast.arg):
            imported.setdefault(node.arg, set()).add('')
        elif isinstance(node, (*FUNCTIONS[:2], ast.ClassDef)):
            imported.setdefault(node.name, set()).add('')
    return {name: origin for name, origins in imported.items() if len(origins) == 1 for origin in origins if origin}


def _origin(function: ast.AST, origins: Dict[str, str]) -> str:
    """`numpy.zeros` of `np.zeros`; '' if that is not known."""
    first, *others = (dotted(function) or '').split('.')
    return '.'.join([origins[first], *others]) if first in origins else ''


def _counts(call: ast.Call, name: str) -> Iterator[ast.expr]:
    first, last, keywords = _COUNTS[name]
    if not any(isinstance(one, ast.Starred) for one in call.args):
        yield from call.args[first : last + 1]
    yield from (keyword.value for keyword in call.keywords if keyword.arg in keywords)


def _decided_by(test: ast.expr) -> Iterator[ast.expr]:
    if isinstance(test, ast.BoolOp):
        for part in test.values:
            yield from _decided_by(part)
    elif isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        yield from _decided_by(test.operand)
    elif not isinstance(test, ast.Compare):
        yield from _readings(test)
    elif not any(isinstance(one, (ast.Is, ast.IsNot)) for one in test.ops):
        for operand in (test.left, *test.comparators):
            yield from _readings(operand)


def _readings(expression: ast.expr) -> List[ast.expr]:
    """The expressions that may give numbers with provenance: whatever has a name in it, and the parts of a tuple."""
    if isinstance(expression, (ast.Tuple, ast.List)):
        return [part for one in expression.elts for part in _readings(one)]
    is_length = isinstance(expression, ast.Call) and dotted(expression.func) == 'len'
    has_name = any(isinstance(part, ast.Name) for part in ast.walk(expression))
    return [expression] if has_name and not is_length and not isinstance(expression, ast.Starred) else []


def _is_compiled(function: ast.AST) -> bool:
    """Return whether another compiler reads a function: it would not know what is called there."""
    decorators = [getattr(one, 'func', one) for one in getattr(function, 'decorator_list', ())]
    return any(getattr(one, 'attr', getattr(one, 'id', '')) in STRICT_DECORATORS for one in decorators)
