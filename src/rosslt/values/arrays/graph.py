"""The graph of NumPy's calls that made arrays, one node for each, and the expressions of elements made of it.

Recording a call keeps NumPy's function and its operands, and nothing else. When somebody wants to know where an element
comes from, the call is expanded: a ufunc by its row of the table; any other function by calling it with symbols, which
it can add, multiply and move, and cannot look at, so that what it makes of them holds for all numbers. A function that
looks at its operands (`sort`, `svd`), and a graph of more operations on numbers than an expression may have, becomes a
call with numbers as in `operation`: the same function is called again to be evaluated, and its slopes are differences.
"""

import functools
import math
import operator
import sys
import time
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy

from ..affine import HALF, LIMIT
from ..calls import operation
from ..functions import to_float
from ..graph import tracked_leaves
from ..numpy_ufuncs import BY_UFUNC
from ..operations.table import TO_FLOAT, TRUNCATE
from ..recording import OF_PYTHON, OPERATION, allow, apply, apply_and_record, spend
from ..shapes import OtherShape, are_kept
from ..tracked import TRACKED
from ..tree import is_tracked
from .numbers import BINARY, PYTHON_NUMBERS, plain_number, python_number, rounding_of

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

NOISE = 256.0
"""How many units in the last place of the largest element or operand NumPy may have rounded by."""

SERIAL = 1 << 32
"""The code of an element is its index in a node plus so many times the serial number of that node."""

FAULTS: List[Callable[[str, Exception], None]] = []
"""Functions that are called with the name of a function and the error that kept its call from being recorded."""


def report(function: Any, error: Exception) -> None:
    """Tell that a call could not be recorded."""
    for tell in FAULTS:
        tell(getattr(function, '__name__', 'array'), error)


Operand = Any
"""A node, a tracked number, or anything else that NumPy's functions take."""


class Call:
    """A call of a function of NumPy, with nodes and tracked numbers for operands that have provenance.

    Args:
        function, args, options: the call; its lists and dicts belong to it alone.
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
        result = self.function(*replaced(self.args, value_of), **replaced(options, value_of))
        return result if self.part is None else result[self.part]


class Gathering:
    """An array of elements that come from several nodes and numbers, or from a part of one. It is used as a Call.

    Args:
        codes: for each element where it is found, 0 if it is plain.
        numbers: an array with the plain numbers.
        entries: nodes and tracked numbers by their serial numbers.
    """

    __slots__ = ('codes', 'entries', 'numbers')

    function = None

    def __init__(self, codes: Any, numbers: Any, entries: Dict[int, Operand]) -> None:
        self.codes, self.numbers = codes.ravel(), numbers
        used = list(entries) if len(entries) == 1 else set((self.codes // SERIAL).tolist())
        self.entries = {serial: entries[serial] for serial in used if serial in entries}

    def run(self, value_of: Callable[[Operand], Any], is_of_objects: bool) -> Any:
        """Compute the result for other operands, as in `Call`."""
        parts = {serial: numpy.ravel(value_of(entry)) for serial, entry in self.entries.items()}
        kind = object if is_of_objects else numpy.result_type(self.numbers, *parts.values())
        result = self.numbers.astype(kind, 'C')
        flat, serials = result.reshape(-1), self.codes // SERIAL
        for serial, part in parts.items():
            chosen = serials == serial
            flat[chosen] = part[self.codes[chosen] % SERIAL]
        return result


class Node:
    """An operation that made the elements of an array. Immutable, except for equivalent replacements.

    Args:
        call: what made it.
        operands: the nodes and tracked numbers in that.
        result: NumPy's result.
        copied: how many elements were copied for the call.

    Attributes:
        call: the same; None once the elements are known.
        shape, kind: the shape of the result, and the class of its numbers.
        size: how large the graph is: the longest way down, with what was copied.
        known: the elements once they were asked for, as `elements` gives them; None before.
    """

    __slots__ = ('_rounding', '_summed', 'call', 'kind', 'known', 'operands', 'shape', 'size')

    is_uncertain = True  # an element that is looked up may have no provenance

    def __init__(self, call: Any, operands: Sequence[Operand], result: Any, copied: int = 0) -> None:
        self.call, self.operands = call, operands
        self.shape, self.kind = result.shape, result.dtype.type
        size = 0
        for operand in operands:
            below = operand.size if type(operand) is Node else operand._size
            if below > size:
                size = below
        self.size: int = size + 1 + copied // ELEMENTS_PER_SIZE
        self.known: Any = None
        self._rounding: Optional[float] = None
        self._summed = 0.0

    def __call__(self, value: Any, index: int) -> Any:
        """Give the provenance of an element, as `tracked.resolve` asks for it: that of another number is not known."""
        made = self.elements()[index]
        if type(made) not in PYTHON_NUMBERS:
            return ()
        if type(made._plain) is not type(value):
            made = apply_and_record(TO_FLOAT if type(value) is float else TRUNCATE, made)
        plain, difference = made._plain, abs(made._plain - value)
        is_same = plain == value or difference <= rounding_of(self.kind) * max(abs(plain), abs(value))
        return made if is_same or difference <= self._noise() else ()

    def _noise(self) -> float:
        """Return what rounding may leave of numbers that cancel out: the expression may give 0 and NumPy not, or the
        other way round."""
        if self._rounding is None:
            unit = numpy.finfo(self.kind).eps if issubclass(self.kind, numpy.floating) else 0.0
            self._rounding = float(NOISE * unit * max(_largest(self.elements()), self._summed))
        return self._rounding

    def elements(self) -> List[Any]:
        """The elements in C's order: tracked numbers of Python, and anything else if there is no provenance."""
        if self.known is None:
            # Calls recorded so far are expanded as a whole, at the expense of later ones.
            start, allowance = time.thread_time(), allow(sys.maxsize)
            try:
                _expand(self)
            except Exception as error:  # of whatever type: the program goes on
                report(getattr(self.call, 'function', None), error)
                self.keep([None] * math.prod(self.shape))
            finally:
                allow(allowance)
                spend(1 + round((time.thread_time() - start) / OPERATION))
        found: List[Any] = self.known
        return found

    def keep(self, elements: List[Any]) -> None:
        """Keep the elements, and drop the call and its operands."""
        if self.call is not None:
            self._summed = max(
                [_largest(one.known or [] if type(one) is Node else [one]) for one in self.operands], default=0.0
            )
        self.known = elements
        self.call, self.operands = None, ()

    def objects(self, of: Callable[[Any], Any]) -> Any:
        """Return the results of a function for the elements, as an array of objects."""
        made = numpy.empty(len(self.elements()), object)
        made[:] = [of(element) for element in self.elements()]
        return made.reshape(self.shape)


def _largest(numbers: Sequence[Any]) -> float:
    """The largest size of tracked numbers that are finite; 0 if there are none."""
    sizes = [abs(one._plain) for one in numbers if type(one) in PYTHON_NUMBERS]
    return max(filter(math.isfinite, sizes), default=0.0)


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
    order, trace = _below(node), _Trace()
    for step in order:
        elements = _traced(step, trace)
        if trace.left < 0:
            node.keep(_called(order))
            return
        step.node.keep(_called([step]) if elements is None else elements)


class _Step(NamedTuple):
    """A node that is not expanded, with what it forgets when another thread expands it."""

    node: Node
    call: Any
    operands: Sequence[Operand]


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
                stack.append(_Step(one, call, operands))
                stack.extend([operand for operand in operands if type(operand) is Node])
    return list(found.values())


class _Trace:
    """The use that functions make of symbols.

    Attributes:
        left: how many operations may still be done; below 0 there were too many.
        has_looked: True if a function has looked at a symbol.
    """

    left = HALF
    has_looked = False


def _traced(step: _Step, trace: _Trace) -> Any:
    """The elements of a node whose operands are expanded, by arithmetic; None if its function looks at its operands."""
    call, shape = step.call, step.node.shape
    is_each = isinstance(call.function, numpy.ufunc) and call.function.signature is None
    trace.left -= max(map(math.prod, [shape, *[one.shape for one in step.operands if type(one) is Node]]))
    if trace.left < 0:
        return None

    def symbol(number: Any) -> Any:
        return number if is_each or type(number) not in TRACKED else Symbol(number, trace)

    def value_of(operand: Operand) -> Any:
        if type(operand) is Node:
            return operand.objects(symbol)
        if not is_each:
            return symbol(operand)
        box = numpy.empty((), object)
        box[()] = operand
        return box

    if is_each:
        call = Call(numpy.frompyfunc(of_numbers(call.function), call.function.nin, 1), call.args, {})
    trace.has_looked = False
    try:
        result = numpy.asarray(call.run(value_of, True), object)
        # A ufunc may have been given a larger array to write to.
        result = numpy.broadcast_to(result, shape) if is_each else result
    except Exception:  # an exception with symbols does not mean one with numbers
        return None
    # NumPy takes an error of a comparison for an answer.
    if trace.has_looked or result.shape != shape:
        return None
    return [one.number if type(one) is Symbol else python_number(one) for one in result.ravel().tolist()]


def _called(order: List[_Step]) -> List[Any]:
    """The elements of the last of some nodes, as results of a call with numbers that computes all of the nodes."""
    inside = {id(step.node) for step in order}
    border = {id(operand): operand for step in order for operand in step.operands if id(operand) not in inside}
    given = [_numbers_of(operand) if type(operand) is Node else operand for operand in border.values()]
    last = order[-1].node
    usual: List[Tuple[int, ...]] = []  # the shapes of the first call, which has the present numbers

    def program(*numbers: Any) -> Any:
        known = {key: numpy.asarray(number) for key, number in zip(border, numbers)}
        has_other = False
        try:
            with numpy.errstate(all='ignore'):
                for at, step in enumerate(order):
                    made = numpy.asarray(step.call.run(lambda operand: known[id(operand)], False))
                    if at == len(usual):
                        usual.append(made.shape)
                    if made.shape == usual[at]:
                        made = numpy.broadcast_to(made, step.node.shape)
                    else:
                        has_other, made = True, _beginning(made, step.node.shape, step.node is last)
                    known[id(step.node)] = made
        except OtherShape:
            raise
        except Exception as error:  # of whatever type: there is no result for these numbers
            raise ArithmeticError(str(error)) from None
        made = known[id(last)]
        if has_other and not made.ndim:
            raise OtherShape('the arrays that it is computed of would have another shape')
        return made.view(_OfOtherShape) if has_other else made

    program.__name__ = getattr(order[-1].call.function, '__name__', 'array')
    if len(tracked_leaves(given)) > MAX_CALLED:
        raise OverflowError('more than %d tracked numbers' % MAX_CALLED)
    elements: List[Any] = numpy.asarray(operation(program)(*given), dtype=object).ravel().tolist()
    return elements


class _OfOtherShape(numpy.ndarray):
    """The result of a call for numbers with which an array has another shape; missing elements have no value."""

    def item(self, *place: Any) -> Any:
        if are_kept():
            raise OtherShape('its array would have another shape')
        try:
            return super().item(*place)
        except IndexError:
            raise OtherShape('its array would not have that element') from None


def _beginning(made: Any, shape: Tuple[int, ...], may_be_shorter: bool) -> Any:
    """The beginning of a result of another shape than the former one: the elements of a range are found there."""
    if not made.ndim == len(shape) == 1 or (made.size < shape[0] and not may_be_shorter):
        raise OtherShape('an array would have the shape %s instead of %s' % (made.shape, shape))
    return made[: shape[0]]


def _numbers_of(node: Node) -> Any:
    """The elements of a node as an array of objects if any has provenance; a single number as it is."""
    if not node.shape:
        return node.elements()[0]
    if is_tracked(node.elements()):
        return node.objects(lambda number: number)
    return node.objects(plain_number).astype(node.kind)


class Symbol:
    """A number that NumPy's functions compute with and cannot look at: whatever it is, they do the same.

    Args:
        number: a tracked number.
        trace: records the operations on it.
    """

    __slots__ = ('number', 'trace')

    def __init__(self, number: Any, trace: _Trace) -> None:
        self.number, self.trace = number, trace

    def _is_unknown(self, *_: Any) -> Any:
        self.trace.has_looked = True
        raise TypeError('a function looks at its operands')

    def __index__(self) -> int:
        """A whole number that counts or chooses elements does so as one in an index does."""
        return operator.index(self.number._plain)

    __bool__ = __float__ = __int__ = __hash__ = __eq__ = __ne__ = _is_unknown
    __lt__ = __le__ = __gt__ = __ge__ = _is_unknown
    real = property(lambda self: self)


def _symbolic(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of numbers as one of symbols."""

    def method(self: Symbol, *others: Any) -> Any:
        if any(isinstance(one, numpy.ndarray) for one in others):
            return NotImplemented  # the array asks for each of its elements
        self.trace.left -= 1
        if self.trace.left < 0:
            raise OverflowError('too many operations')
        made = function(self.number, *[one.number if type(one) is Symbol else python_number(one) for one in others])
        return Symbol(made, self.trace) if type(made) in TRACKED else made

    return method


def product(a: Any, b: Any) -> Any:
    """A product, without provenance if one factor is a plain 0, as most elements of a matrix are."""
    if (type(a) not in TRACKED and a == 0) or (type(b) not in TRACKED and b == 0):
        return 0.0
    return a * b


def _by_row(row: Any) -> Callable[..., Any]:
    if row.arity == 2:
        return lambda a, b: apply(row, a, b)
    # What rounds gives floats, as NumPy has it.
    return (lambda x: to_float(apply(row, x))) if row.stepped else lambda x: apply(row, x)


EXACT: Dict[str, Callable[..., Any]] = {name: _by_row(row) for name, row in BY_UFUNC.items()}
EXACT.update(multiply=product, square=lambda a: a * a, positive=lambda a: a, conjugate=lambda a: a)
"""The ufuncs that the table of operations knows, as functions of numbers."""

for _name in BINARY:
    _function: Any = product if _name == 'mul' else getattr(operator, _name)
    setattr(Symbol, '__%s__' % _name, _symbolic(_function))
    setattr(Symbol, '__r%s__' % _name, _symbolic(lambda a, b, _function=_function: _function(b, a)))
for _name, _function in (('__neg__', operator.neg), ('__abs__', abs), *EXACT.items()):
    setattr(Symbol, _name, _symbolic(_function))


def of_numbers(ufunc: Any) -> Callable[..., Any]:
    """A ufunc as a function of numbers, plain and tracked."""
    return functools.partial(_computed, ufunc)


def _computed(ufunc: Any, *numbers: Any) -> Any:
    if TRACKED.isdisjoint(map(type, numbers)):
        return ufunc(*numbers)
    exact = EXACT.get(ufunc.__name__)
    if exact is not None:
        try:
            return exact(*numbers)
        except (ArithmeticError, TypeError, ValueError):
            pass  # NumPy gives an infinite number, for instance

    @functools.wraps(ufunc, updated=())
    def quiet(*numbers: Any) -> Any:
        with numpy.errstate(all='ignore'):
            return ufunc(*numbers)

    return operation(quiet)(*numbers)
