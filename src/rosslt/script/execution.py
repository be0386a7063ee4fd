"""Running a script: the names that it can use, the limits on its run, and the steps that it makes.

A script can do little, and its run time is limited, as is the size of its numbers, texts and lists: one operation on
a huge one takes as long as all that a script may do. This protects against accidents, for example an endless loop. It
does not protect against attackers.
"""

import ast
import builtins
import math
import operator
import sys
import types
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Union

from rosslt import files, values


class Goto(NamedTuple):
    """Fly to a point, in metres."""

    x: float
    y: float
    z: float


class Wait(NamedTuple):
    """Stay for a while."""

    seconds: float


#: A step of a script.
Step = Union[Goto, Wait]

#: The maximal number of loop turns, function calls and waypoints of a script, and of elements of a text or list in it.
STEP_LIMIT = 100000

#: The maximal number of bits of a whole number: those of the largest float.
MOST_BITS = sys.float_info.max_exp

TICK = '__tick__'

#: Checks the size of values read from a variable, a list or a dict, so that no operation gets huge operands.
SIZED = '__sized__'

#: These check the size of a result that may be huge, such as that of `x ** y`: for `x * y`, for the y of `x *= y`, and
#: for `x[i] *= y`, which is a call as a whole.
COMPUTE, OPERAND, AUGMENT = '__compute__', '__operand__', '__augment__'

#: Such operations, by the names of their syntax, with the one that makes `x *= y`.
GROWING = {
    'Mult': (operator.mul, operator.imul),
    'Pow': (operator.pow, operator.ipow),
    'LShift': (operator.lshift, operator.ilshift),
}

#: The Python syntax that scripts do not support, with its usual names.
FORBIDDEN = {
    'Import': 'import',
    'ImportFrom': 'import',
    'ClassDef': 'class',
    'Try': 'try',
    'TryStar': 'try',
    'With': 'with',
    'Raise': 'raise',
    'Yield': 'yield',
    'YieldFrom': 'yield',
    'Match': 'match',
    'AsyncFunctionDef': 'async',
    'AsyncFor': 'async',
    'AsyncWith': 'async',
    'Await': 'await',
}

BUILTINS = (
    'abs',
    'all',
    'any',
    'dict',
    'divmod',
    'enumerate',
    'filter',
    'len',
    'list',
    'map',
    'max',
    'min',
    'repr',
    'reversed',
    'round',
    'set',
    'sorted',
    'str',
    'sum',
    'tuple',
    'zip',
)


#: {name of a function of whole numbers whose result may be huge: gives the logarithm of the result}.
COUNTING: Dict[str, Callable[..., float]] = {
    'factorial': lambda n: math.lgamma(n + 1.0),
    'perm': lambda n, k=None: math.lgamma(n + 1.0) - (0.0 if k is None or k > n else math.lgamma(n - k + 1.0)),
    'comb': lambda n, k: 0.0 if k > n else math.lgamma(n + 1.0) - math.lgamma(k + 1.0) - math.lgamma(n - k + 1.0),
}


def run(
    source: files.SourceText,
    numbers: Sequence[object],
    step_limit: int = STEP_LIMIT,
    say: Callable[..., object] = print,
) -> List[Step]:
    """Run a script.

    Args:
        source: the script.
        numbers: what its numbers are, in their order; tracked ones, so that the steps know what they came of.
        step_limit: how many turns of loops, calls of functions and waypoints it may take, and elements a list may have.
        say: prints what the script prints.

    Returns:
        Its steps, a list of Goto and Wait.

    Raises:
        files.FileError: it uses forbidden syntax, fails, or does not end.
    """
    _check(source)
    steps: List[Step] = []
    count = 0

    def tick() -> bool:
        nonlocal count
        count += 1
        if count > step_limit:
            raise RuntimeError('the script does not end: stopped after {} steps'.format(step_limit))
        return True

    def limited_range(*bounds: int) -> range:
        turns = range(*bounds)
        if len(turns) > step_limit:
            raise ValueError('{!r} is longer than the {} steps of a script'.format(turns, step_limit))
        return turns

    def goto(x: object, y: object, z: object) -> None:
        tick()
        steps.append(Goto(*[_number(value, 'goto') for value in (x, y, z)]))

    def wait(seconds: object) -> None:
        tick()
        duration = _number(seconds, 'wait')
        if duration < 0.0:
            raise ValueError('wait takes 0 or more seconds, not {}'.format(seconds))
        steps.append(Wait(float(duration)))

    def sized(value: Any) -> Any:
        if isinstance(value, int) and value.bit_length() > MOST_BITS:
            raise OverflowError('a whole number of {} bits is too large: no float holds it'.format(value.bit_length()))
        if isinstance(value, (str, bytes, list, tuple, dict, set)) and len(value) > step_limit:
            raise ValueError(too_long.format(len(value)))
        return value

    def operand(name: str, first: Any, second: Any) -> Any:
        if isinstance(first, int) and isinstance(second, int):
            if _bits(name, first, second) > MOST_BITS:
                raise OverflowError('the result is a whole number that is too large: no float holds it')
        elif name == 'Mult':
            for many, times in ((first, second), (second, first)):
                is_repeated = isinstance(many, (str, bytes, list, tuple)) and isinstance(times, int)
                if is_repeated and len(many) * times > step_limit:
                    raise ValueError(too_long.format(len(many) * times))
        return second

    def compute(name: str, first: Any, second: Any) -> Any:
        return GROWING[name][0](first, operand(name, first, second))

    def augment(name: str, container: Any, index: Any, second: Any) -> None:
        container[index] = GROWING[name][1](container[index], operand(name, container[index], second))

    def limited(name: str) -> Callable[..., Any]:
        def function(*arguments: Any) -> Any:
            is_count = all(isinstance(one, int) and one >= 0 for one in arguments)
            if is_count and COUNTING[name](*arguments) > MOST_BITS * math.log(2):
                raise OverflowError('the result is a whole number that is too large: no float holds it')
            return values.MATH[name](*arguments)

        return function

    too_long = 'a text or list of {{}} elements is longer than the {} steps of a script'.format(step_limit)
    mathematics = {**values.MATH, **{name: limited(name) for name in COUNTING if name in values.MATH}}
    for function in (goto, wait):
        function.__qualname__ = function.__name__  # as errors call them
    try:
        program = source.program(len(source.numbers))
        code = compile(_Limited().visit(program), source.path, 'exec')
        exec(
            code,
            {  # in here a script finds what stands below, and nothing else
                '__builtins__': {},
                files.LITERALS: list(numbers),
                TICK: tick,
                SIZED: sized,
                COMPUTE: compute,
                OPERAND: operand,
                AUGMENT: augment,
                'goto': goto,
                'wait': wait,
                'print': say,
                'range': limited_range,
                'int': values.to_int,
                'float': values.to_float,
                'bool': values.to_bool,
                'math': types.SimpleNamespace(**mathematics),
                **mathematics,
                **{name: getattr(builtins, name) for name in BUILTINS},
            },
        )
    except SyntaxError as error:  # return outside of a function, and the like
        raise files.FileError(source.path, error.lineno or 1, error.offset or 1, error.msg) from None
    except Exception as error:  # any exception is a fault of the script
        line = _line_of(error.__traceback__, source.path)
        name = '' if isinstance(error, RuntimeError) else type(error).__name__ + ': '
        raise files.FileError(source.path, line, 1, name + str(error)) from None
    return steps


def _number(value: object, function: str) -> float:
    """A coordinate, as a float that can become any other: one that came of an integer included."""
    if isinstance(value, (bool, str)) or not isinstance(value, (int, float)):
        raise TypeError('{} takes numbers, not {!r}'.format(function, value))
    if not math.isfinite(value):
        raise ValueError('{} takes finite numbers, not {}'.format(function, value))
    if not values.is_tracked(value):
        return float(value)
    instructions, (root,) = values.disassemble([values.to_float(value)])
    made: List[float] = values.assemble(
        [
            (values.SOURCE, instruction[1], float(instruction[2])) if instruction[0] == values.SOURCE else instruction
            for instruction in instructions
        ]
    )
    return made[root]


def _check(source: files.SourceText) -> None:
    """Refuse syntax that a script must not use."""
    for node in ast.walk(source.tree):
        name = type(node).__name__
        reason = None
        if name in FORBIDDEN:
            reason = 'there is no {} in a script'.format(FORBIDDEN[name])
        elif isinstance(node, ast.Attribute) and node.attr.startswith('_'):
            reason = 'there is no access to {} in a script'.format(node.attr)
        else:
            for named in (getattr(node, field, None) for field in ('id', 'name', 'arg')):
                if isinstance(named, str) and named.startswith('__'):
                    reason = 'there is no name {} in a script'.format(named)
        if reason:
            line, column = getattr(node, 'lineno', 1), getattr(node, 'col_offset', 0) + 1
            raise files.FileError(source.path, line, column, reason)


def _bits(name: str, first: int, second: int) -> float:
    """The number of bits that a whole number has, about, that an operation of GROWING comes to."""
    if name == 'Mult':
        return first.bit_length() + second.bit_length() - 1
    if name == 'LShift':
        return first.bit_length() + second if first else 0
    return second * math.log2(abs(first)) if first else 0


class _Limited(ast.NodeTransformer):
    """Has each turn of a loop and each call of a function call `__tick__`, which gives True; and sizes be checked."""

    def visit_Name(self, node: ast.Name) -> ast.AST:
        is_read = isinstance(node.ctx, ast.Load) and not node.id.startswith('__')
        return _call(node, SIZED, node) if is_read else node

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        self.generic_visit(node)
        return _call(node, SIZED, node) if isinstance(node.ctx, ast.Load) else node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        name = type(node.op).__name__
        return _call(node, COMPUTE, _constant(node, name), node.left, node.right) if name in GROWING else node

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AST:
        self.generic_visit(node)
        target, name = node.target, _constant(node, type(node.op).__name__)
        if name.value not in GROWING:
            return node
        if isinstance(target, ast.Name):
            node.value = _call(node, OPERAND, name, _at(node, ast.Name(target.id, ast.Load())), node.value)
        elif isinstance(target, ast.Subscript) and not isinstance(target.slice, ast.Slice):
            index = getattr(target.slice, 'value', None) if type(target.slice).__name__ == 'Index' else target.slice
            return _at(node, ast.Expr(_call(node, AUGMENT, name, target.value, index, node.value)))
        return node

    def visit_While(self, node: ast.While) -> ast.AST:
        return self._tick_first(node)

    def visit_For(self, node: ast.For) -> ast.AST:
        return self._tick_first(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        return self._tick_first(node)

    def visit_Lambda(self, node: ast.Lambda) -> ast.AST:
        self.generic_visit(node)
        node.body = _at(node.body, ast.BoolOp(ast.And(), [_tick(node.body), node.body]))
        return node

    def visit_comprehension(self, node: ast.comprehension) -> ast.AST:
        self.generic_visit(node)
        node.ifs.insert(0, _tick(node.iter))
        return node

    def _tick_first(self, node: Any) -> ast.AST:
        self.generic_visit(node)
        node.body.insert(0, _at(node, ast.Expr(_tick(node))))
        return node


def _tick(place: ast.AST) -> Any:
    return _call(place, TICK)


def _call(place: ast.AST, function: str, *arguments: Any) -> Any:
    return _at(place, ast.Call(_at(place, ast.Name(function, ast.Load())), list(arguments), []))


def _constant(place: ast.AST, value: str) -> Any:
    return _at(place, ast.Constant(value, kind=None))


def _at(place: ast.AST, node: Any) -> Any:
    return ast.copy_location(node, place)


def _line_of(trace: Optional[types.TracebackType], file: str) -> int:
    """The line that the script ran last."""
    line = 1
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line
