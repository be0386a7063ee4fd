"""The graph of NumPy's operations that made arrays, one node for each, and the expressions of elements made of it.

Recording an operation keeps NumPy's function and its operands, and nothing else. When somebody wants to know where an
element comes from, NumPy's own function is called once more, with tracked numbers in arrays of objects: what it
computes with them is the expression. A function that takes no objects (`svd`), and a graph of more operations on
numbers than an expression may have, becomes a call with numbers as of `operation`: it is called again to be evaluated,
and differentiated numerically.
"""

import bisect
import contextlib
import functools
import itertools
import math
import operator
import sys
import time
from typing import Any, Callable, Dict, List, NamedTuple, Sequence, Tuple

import numpy

from ..affine import HALF, LIMIT
from ..calls import operation
from ..elimination import eliminate, solved
from ..functions import to_float
from ..graph import tracked_leaves
from ..numpy_ufuncs import BY_UFUNC
from ..operations import LAZY
from ..operations.notation import FUNCTION
from ..operations.table import TO_FLOAT, TRUNCATE
from ..recording import OF_PYTHON, OPERATION, allow, apply, apply_and_record, spend
from ..tracked import TRACKED
from .numbers import PYTHON_NUMBERS, python_number, rounding_of

MAX_SIZE = LIMIT
"""The size of a graph past which an array is plain: it is a state that feeds on itself."""

ELEMENTS_PER_SIZE = 256
"""So many elements that are copied for a node count as one operation more."""

MAX_COPIED = MAX_SIZE * ELEMENTS_PER_SIZE
"""So many elements are not copied."""

MAX_CALLED = 256
"""The most tracked numbers that a call is differentiated for; with more, its result is plain."""

OF_ARRAY = 8 * OF_PYTHON
"""How many operations of the compiled core take as long as one of arrays that is recorded."""

FAILING = (ArithmeticError, ValueError, TypeError, IndexError, AttributeError, numpy.linalg.LinAlgError)
"""What NumPy's functions raise of arrays of objects."""

_CONTRACTIONS = {numpy.matmul, numpy.dot, numpy.inner, numpy.tensordot, numpy.convolve, numpy.correlate, numpy.einsum}
_CONTRACTIONS |= {numpy.linalg.inv, numpy.linalg.solve}
_OBJECT = numpy.dtype(object)
_QUESTIONS = {'isfinite', 'isnan', 'isinf', 'signbit'}

Operand = Any
"""A node, a tracked number, or anything else that NumPy's functions take."""


class Call:
    """A call of a function of NumPy, with nodes and tracked numbers for what has provenance.

    Args:
        function, args, options: the call; what is in it belongs to it alone.
        part: the index of the result in what the function returns; None for all of it.
    """

    __slots__ = ('args', 'function', 'options', 'part')

    def __init__(self, function: Any, args: Sequence[Operand], options: Dict[str, Operand], part: Any = None) -> None:
        self.function, self.args, self.options, self.part = function, args, options, part

    def run(self, value_of: Callable[[Operand], Any], is_of_objects: bool) -> Any:
        """Compute the result for other operands.

        Args:
            value_of: gives what stands for a node or a tracked number.
            is_of_objects: whether that is an array of objects.
        """
        options = {name: option for name, option in self.options.items() if not (is_of_objects and name == 'dtype')}
        function = _OF_OBJECTS.get(self.function, self.function) if is_of_objects else self.function
        result = function(*replaced(self.args, value_of), **replaced(options, value_of))
        return result if self.part is None else result[self.part]


class Gathering:
    """An array of elements that come from several nodes and numbers, or from a part of one. It is used as a Call.

    Args:
        codes: for each element where it is found, 0 if it is plain.
        numbers: an array with the plain numbers.
        starts: the code of the first element of each entry.
        entries: nodes, and tracked numbers.
    """

    __slots__ = ('codes', 'entries', 'numbers', 'starts')

    function = None

    def __init__(self, codes: Any, numbers: Any, starts: List[int], entries: List[Operand]) -> None:
        self.codes, self.numbers, self.starts = codes, numbers, starts
        used = {0} if len(entries) == 1 else {self._entry_of(code) for code in codes.ravel().tolist() if code}
        self.entries = {at: entries[at] for at in used}

    def _entry_of(self, code: int) -> int:
        return bisect.bisect(self.starts, code) - 1

    def run(self, value_of: Callable[[Operand], Any], is_of_objects: bool) -> Any:
        """Compute the result for other operands, as of `Call`."""
        parts = {at: numpy.ravel(value_of(entry)) for at, entry in self.entries.items()}
        kind = object if is_of_objects else numpy.result_type(self.numbers, *parts.values())
        result = self.numbers.astype(kind, 'C')
        flat = result.reshape(-1)
        for index, code in enumerate(self.codes.ravel().tolist()):
            if code:
                at = self._entry_of(code)
                flat[index] = parts[at][code - self.starts[at]]
        return result.view(Objects) if is_of_objects else result


class Node:
    """An operation that made the elements of an array. It is never changed, but for what means the same.

    Args:
        call: what made it.
        operands: the nodes and tracked numbers in that.
        result: NumPy's result.
        copied: how many elements were copied for the call.

    Attributes:
        call: the same; None once the elements are known.
        shape, kind: the shape of the result, and the class of its numbers.
        size: how large the graph is: the longest way down, with what was copied.
    """

    __slots__ = ('_elements', 'call', 'kind', 'operands', 'shape', 'size')

    def __init__(self, call: Any, operands: Sequence[Operand], result: Any, copied: int = 0) -> None:
        self.call, self.operands = call, operands
        self.shape, self.kind = result.shape, result.dtype.type
        size = 0
        for operand in operands:
            below = operand.size if type(operand) is Node else operand._size
            if below > size:
                size = below
        self.size: int = size + 1 + copied // ELEMENTS_PER_SIZE
        self._elements: Any = None

    def __call__(self, value: Any, index: int) -> Any:
        """Give the provenance of an element, as `tracked.resolve` asks for it: that of another number is not known."""
        made = self.elements()[index]
        if type(made) not in PYTHON_NUMBERS:
            return ()
        if type(made._plain) is not type(value):
            made = apply_and_record(TO_FLOAT if type(value) is float else TRUNCATE, made)
        plain, rounding = made._plain, rounding_of(self.kind)
        return made if plain == value or abs(plain - value) <= rounding * max(abs(plain), abs(value)) else ()

    def known(self, index: int) -> Any:
        """An element, LAZY if it is not known yet."""
        return LAZY if self._elements is None else self._elements[index]

    def elements(self) -> List[Any]:
        """The elements in C's order: tracked numbers of Python, and anything else where there is no provenance."""
        if self._elements is None:
            # What was recorded by then is known whole, at the expense of what comes later.
            start, allowance = time.thread_time(), allow(sys.maxsize)
            try:
                _expand(self)
            finally:
                allow(allowance)
                spend(1 + round((time.thread_time() - start) / OPERATION))
        found: List[Any] = self._elements
        return found

    def keep(self, elements: List[Any]) -> None:
        """Keep the elements, and nothing of what they were made of."""
        self._elements = elements
        self.call, self.operands = None, ()

    def objects(self) -> Any:
        """The elements as an array that NumPy's functions compute with as they do with numbers."""
        made = numpy.empty(len(self.elements()), object)
        made[:] = self.elements()
        return made.reshape(self.shape).view(Objects)


def of_elements(elements: List[Any], result: Any) -> Node:
    """The node of an array that was made of numbers.

    Args:
        elements: tracked and plain numbers of Python, in C's order.
        result: NumPy's array.
    """
    node = Node(None, [element for element in elements if type(element) in PYTHON_NUMBERS], result)
    node.keep(elements)
    return node


def replaced(x: Operand, value_of: Callable[[Operand], Any]) -> Any:
    """Arguments with something else for nodes and tracked numbers, in lists and dicts, too."""
    if type(x) is Node or type(x) in TRACKED:
        return value_of(x)
    if type(x) in (list, tuple):
        return type(x)([replaced(part, value_of) for part in x])
    if type(x) is dict:
        return {name: replaced(part, value_of) for name, part in x.items()}
    return x


def _expand(node: Node) -> None:
    """Make the expressions of a node's elements."""
    order = _below(node)
    if sum([step.work for step in order]) > HALF:
        node.keep(_called(order))
        return
    for step in order:
        try:
            elements = _of_objects(step)
        except FAILING:
            elements = _called([step])
        step.node.keep(elements)


class _Step(NamedTuple):
    """A node that is not expanded, with what it forgets when another thread expands it, and about how many operations
    on numbers it stands for."""

    node: Node
    call: Any
    operands: Sequence[Operand]
    work: int


def _below(node: Node) -> List[_Step]:
    """List the nodes below one that are not expanded yet, and itself, operands before their users."""
    found: Dict[int, _Step] = {}
    stack: List[Any] = [node]
    while stack:
        one = stack.pop()
        if type(one) is _Step:
            found[id(one.node)] = one
        elif id(one) not in found:
            call, operands = one.call, one.operands
            if call is not None:
                stack.append(_Step(one, call, operands, _work(call, one.shape, operands)))
                stack.extend([operand for operand in operands if type(operand) is Node])
    return list(found.values())


def _work(call: Any, shape: Tuple[int, ...], operands: Sequence[Operand]) -> int:
    shapes = [operand.shape for operand in operands if type(operand) is Node]
    if call.function in _CONTRACTIONS:
        return 2 * math.prod(shape) * max([part[-1] for part in shapes if part] or [1])
    return max(map(math.prod, [shape, *shapes]))


def _of_objects(step: _Step) -> List[Any]:
    """The elements of a node whose operands are expanded, computed with objects.

    Raises:
        One of FAILING: NumPy's function takes no objects.
    """
    result = step.call.run(_objects_of, True)
    if type(result) not in TRACKED and getattr(result, 'dtype', None) is not _OBJECT:
        raise ValueError('the function makes plain numbers of objects')
    result = numpy.asarray(result, dtype=object)
    if result.shape != step.node.shape:
        raise ValueError('the function makes something else of objects')
    return [python_number(element) for element in result.ravel().tolist()]


def _objects_of(operand: Operand) -> Any:
    """The objects of a node, or a tracked number in an array."""
    if type(operand) is Node:
        return operand.objects()
    box = numpy.empty((), object)
    box[()] = operand
    return box.view(Objects)


def _called(order: List[_Step]) -> List[Any]:
    """The elements of the last of some nodes, as results of a call with numbers that computes all of the nodes."""
    inside = {id(step.node) for step in order}
    border = {id(operand): operand for step in order for operand in step.operands if id(operand) not in inside}
    given = [operand.objects().view(numpy.ndarray) if type(operand) is Node else operand for operand in border.values()]

    def program(*numbers: Any) -> Any:
        known = dict(zip(border, numbers))
        try:
            with numpy.errstate(all='ignore'):
                for step in order:
                    made = step.call.run(lambda operand: known[id(operand)], False)
                    known[id(step.node)] = numpy.asarray(made)
        except numpy.linalg.LinAlgError as error:
            raise ArithmeticError(str(error)) from None
        return known[id(last)]

    last = order[-1].node
    program.__name__ = getattr(order[-1].call.function, '__name__', 'array')
    elements: List[Any] = [None] * math.prod(last.shape)
    if len(tracked_leaves(given)) <= MAX_CALLED:
        with contextlib.suppress(*FAILING):
            elements = numpy.asarray(operation(program)(*given), dtype=object).ravel().tolist()
    return elements


class Objects(numpy.ndarray):
    """An array of tracked and plain numbers that NumPy computes with element by element, as the table of operations
    says."""

    def __index__(self) -> int:
        return operator.index(self.item())

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        options.pop('dtype', None)
        if 'out' in options:
            options['out'] = tuple(map(_bare, options['out']))
        bare = list(map(_bare, inputs))
        if ufunc.__name__ in _QUESTIONS:
            bare = [numpy.asarray(one, dtype=float) for one in bare]
        result = getattr(_ON_OBJECTS.get(ufunc.__name__, ufunc), method)(*bare, **options)
        if type(result) in TRACKED:
            return _objects_of(result)
        return result.view(Objects) if isinstance(result, numpy.ndarray) and result.dtype == object else result


def _bare(x: Any) -> Any:
    return x.view(numpy.ndarray) if isinstance(x, Objects) else x


def product(a: Any, b: Any) -> Any:
    """A product, without provenance where it is 0 whatever the other factor is: most of a matrix is such."""
    if (type(a) not in TRACKED and a == 0) or (type(b) not in TRACKED and b == 0):
        return 0.0
    return a * b


def _applied(row: Any) -> Callable[..., Any]:
    function = functools.partial(apply, row)
    # What rounds gives floats, as NumPy has it.
    return (lambda x: to_float(function(x))) if row.stepped and row.arity == 1 else function


#: Functions of numbers for the ufuncs that NumPy cannot apply to objects, by name.
ELEMENTWISE: Dict[str, Callable[..., Any]] = {
    name: _applied(row) for name, row in BY_UFUNC.items() if row.precedence == FUNCTION
}
ELEMENTWISE['multiply'] = product
_ON_OBJECTS = {name: numpy.frompyfunc(function, getattr(numpy, name).nin, 1) for name, function in ELEMENTWISE.items()}


def _divided(matrix: Any, right: Any) -> Any:
    """`matrix^-1 right` by elimination, whose every step is an operation of the table."""
    matrix, right = _matrix(matrix), numpy.asarray(right, object)
    columns = right[:, None] if right.ndim == 1 else right
    return numpy.array(solved(matrix.tolist(), columns.tolist()), object).reshape(right.shape)


def _matrix(x: Any) -> Any:
    x = numpy.asarray(x, object)
    if x.ndim != 2:
        raise TypeError('matrices in a stack are computed numerically')
    return x


def _einsum(subscripts: str, *operands: Any) -> Any:
    given, arrow, kept = subscripts.replace(' ', '').partition('->')
    if not arrow:
        kept = ''.join(sorted(label for label in set(given) - {','} if given.count(label) == 1))
    terms = given.split(',')
    ranges = {label: range(size) for term, one in zip(terms, operands) for label, size in zip(term, one.shape)}
    result = numpy.zeros([len(ranges[label]) for label in kept], object)
    for indices in itertools.product(*ranges.values()):
        at = dict(zip(ranges, indices))
        factors = [one[tuple([at[label] for label in term])] for term, one in zip(terms, operands)]
        result[tuple([at[label] for label in kept])] += functools.reduce(product, factors)
    return result


def _arange(*ends: Any, **given: Any) -> Any:
    names = ('stop',) if len(ends) == 1 and 'stop' not in given else ('start', 'stop', 'step')
    given.update(zip(names, ends))
    count = len(numpy.arange(**{name: numpy.asarray(end, float).item() for name, end in given.items()}))
    start, step = [
        numpy.asarray(given.get(name, default), object).item() for name, default in (('start', 0), ('step', 1))
    ]
    return numpy.array([start + index * step for index in range(count)], object)


#: What stands for functions of NumPy that take no objects.
_OF_OBJECTS = {
    numpy.arange: _arange,
    numpy.linalg.inv: lambda a: _divided(a, numpy.identity(len(a))),
    numpy.linalg.solve: _divided,
    numpy.linalg.det: lambda a: eliminate(_matrix(a).tolist()),
    numpy.einsum: _einsum,
}
