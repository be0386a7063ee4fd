"""Calls of NumPy's functions with arrays and numbers that have provenance: NumPy computes, and the call is recorded."""

from typing import Any, Callable, Dict, List, Sequence, Tuple

import numpy

from ..recording import spend
from .graph import MAX_COPIED, MAX_SIZE, OF_ARRAY, Call, Node, of_numbers, report
from .memory import lazy_number
from .numbers import CLASSES, WITH_PROVENANCE, complete, plain_number, python_number, recorded
from .tracked_array import (
    Argument,
    TrackedArray,
    converted,
    of_list,
    of_memory,
    plain,
    provenance_of,
    receptive,
    with_node,
)

_ARRAY: Any = numpy.ndarray
_NUMBERS = (float, int, numpy.generic)

#: What a function may take beside arrays and lists and be called again with: most are of these classes themselves.
_CONSTANTS = {type(getattr(numpy, '_NoValue', None)), type(None), type(Ellipsis), bool, int, float, str, slice}
_KINDS_OF_CONSTANTS = (int, float, str, range, type, numpy.dtype, numpy.generic)

ARRAYS = frozenset({numpy.ndarray, TrackedArray, list, tuple})
"""The classes of operands that are computed element by element."""


def wrapped(result: Any, call: Call, operands: Sequence[Any], copied: int) -> Any:
    """A result of NumPy with its provenance: an array, a number, or a tuple or list of these.

    Args:
        result: what NumPy gives.
        call, operands, copied: as in `graph.Node`.
    """
    try:
        return _wrapped(result, call, operands, copied)
    except Exception as error:  # of whatever type: the program goes on
        report(call.function, error)
        return result


def _wrapped(result: Any, call: Call, operands: Sequence[Any], copied: int) -> Any:
    if isinstance(result, (list, tuple)):
        parts = [
            _wrapped(part, Call(call.function, call.args, call.options, at), operands, copied)
            for at, part in enumerate(result)
        ]
        return getattr(type(result), '_make', type(result))(parts)  # a named tuple, too
    kind = type(result)
    if kind is not numpy.ndarray and kind not in CLASSES:
        return result
    if result.dtype.kind != 'f' and not _is_of_ints(call, operands):
        return result
    node = Node(call, operands, result, copied)
    if kind is numpy.ndarray:
        return with_node(result, node)
    if node.size > MAX_SIZE:
        return result
    return lazy_number(result, node, 0, kind)


def _is_of_ints(call: Call, operands: Sequence[Any]) -> bool:
    """Return True if a function that gives whole numbers computes with such: they are not indices."""
    kinds = [operand.kind if type(operand) is Node else type(operand._plain) for operand in operands]
    name = getattr(call.function, '__name__', '')
    is_index = name.startswith('arg') or name in ('searchsorted', 'digitize', 'count_nonzero', 'bincount')
    is_of_ints = all(issubclass(kind, (int, numpy.integer)) for kind in kinds)
    return call.function is converted or (is_of_ints and not is_index)


class _Captured:
    """The arguments of a call, as a node keeps them.

    Attributes:
        arrays: those of this class among them.
        operands: the nodes and tracked numbers in them.
        copied: how many elements were copied.
        is_whole: whether it may be called with them again.
    """

    def __init__(self) -> None:
        self.arrays: List[TrackedArray] = []
        self.operands: List[Any] = []
        self.copied = 0
        self.is_whole = spend(OF_ARRAY)

    def all(self, x: Any) -> Any:
        """Arguments in a list or dict, as the call of an argument gives each; what cannot be kept is not."""
        try:
            return {name: self(one) for name, one in x.items()} if type(x) is dict else [self(one) for one in x]
        except Exception as error:  # of whatever type: the program goes on
            report(None, error)
            self.is_whole = False
            return x

    def __call__(self, x: Argument) -> Any:
        """An argument with nodes for arrays with provenance, and plain arrays copied: the program may change them."""
        kind = type(x)
        if kind in _CONSTANTS:
            return x
        if kind in WITH_PROVENANCE or kind is TrackedArray:
            if kind is TrackedArray:
                self.arrays.append(x)
            made = provenance_of(x) if self.is_whole else None
            if made is None:
                return self(plain(x))
            self.operands.append(made)
            return made
        if isinstance(x, numpy.ndarray):
            self.copied += x.size
            self.is_whole = self.is_whole and x.dtype.kind in 'biuf' and self.copied < MAX_COPIED
            return x.copy() if self.is_whole else x
        if kind in (list, tuple):
            return kind([self(part) for part in x])
        self.is_whole = self.is_whole and isinstance(x, _KINDS_OF_CONSTANTS)
        return x


def compute(ufunc: Any, method: str, inputs: Sequence[Argument], options: Dict[str, Argument]) -> Any:
    """Call a ufunc: the result has NumPy's own numbers, with the provenance of the operands."""
    if method != '__call__' or options or ufunc.nout != 1:
        if method == 'at' and type(inputs[0]) is TrackedArray:
            return _write_at(ufunc.at, *inputs)
        return call(ufunc if method == '__call__' else getattr(ufunc, method), inputs, options)
    numbers, args, operands = [], [], []
    copied, has_array = 0, False
    for operand in inputs:
        kind = type(operand)
        number = operand
        if kind is TrackedArray:
            has_array = True
            number = _ARRAY.view(operand, numpy.ndarray)
            operand = provenance_of(operand)
            if operand is None:
                copied += number.size
                operand = number
            else:
                operands.append(operand)
        elif kind is numpy.ndarray:
            has_array = True
            copied += number.size
        elif kind in WITH_PROVENANCE:
            number = plain_number(operand)
            operand = python_number(operand)
            operands.append(operand)
        elif not isinstance(operand, _NUMBERS):
            return call(ufunc, inputs, options)
        numbers.append(number)
        args.append(operand)
    result = ufunc(*numbers)
    if not has_array:
        return recorded(result, of_numbers(ufunc), *inputs)
    if not operands or copied >= MAX_COPIED or not spend(OF_ARRAY):
        return result
    # The program may change plain arrays.
    args = [arg.copy() if type(arg) is numpy.ndarray else arg for arg in args]
    return wrapped(result, Call(ufunc, args, {}), operands, copied)


def _write_at(function: Callable[..., Any], target: TrackedArray, indices: Argument, *numbers: Argument) -> None:
    """Call the method `at` of a ufunc, which reads what it writes: it changes a copy, whose elements are moved."""

    def at(array: Any, *arguments: Any) -> Any:
        made = numpy.array(array)
        function(made, *arguments)
        return made

    mask = numpy.zeros(target.shape, bool)
    made = call(at, (target, plain(indices), *numbers), {})
    plain(target)[...] = plain(made)
    mask[plain(indices)] = True
    target.write_provenance(mask, provenance_of(made))


_TARGETS = ('dst', 'a', 'arr')
"""The names of the first arguments of NumPy's functions that return nothing: they write to these."""

RECEPTIVE = {numpy.identity, numpy.eye}
RECEPTIVE |= {getattr(numpy, name + like) for name in ('zeros', 'ones', 'empty') for like in ('', '_like')}
"""What they make is there to be written to."""

LOST: List[Callable[[Any, Any], None]] = []
"""Are called with a plain result, and with the arguments that had provenance."""


def call(function: Any, arguments: Sequence[Argument], options: Dict[str, Argument]) -> Any:
    """Call a function of NumPy: the result has NumPy's own numbers, with their provenance if it is known."""
    captured, out, kept = _Captured(), options.get('out'), options
    is_masked = out is not None and isinstance(function, numpy.ufunc) and 'where' in options
    if out is not None:  # what a function only writes to is no operand
        kept = {name: one for name, one in options.items() if name != 'out' and not (is_masked and name == 'where')}
    # Provenance is taken first: a function may overwrite its operands.
    args, named = captured.all(arguments), captured.all(kept)
    given, plain_options = [plain(one) for one in arguments], plain(options)
    result = function(*given, **plain_options)
    if result is None:
        target = arguments[0] if arguments else next((options[name] for name in _TARGETS if name in options), None)
        if type(target) is TrackedArray:
            target.write_as(
                lambda marks, of: function(
                    *[marks if one is target else of(one) for one in arguments],
                    **{name: marks if one is target else of(one) for name, one in options.items()},
                )
            )
        return None
    if function in RECEPTIVE:
        return receptive(result)
    targets: List[Any] = []
    if out is not None:
        outs, shown = (out, plain_options['out']) if type(out) is tuple else ((out,), (plain_options['out'],))
        results = result if len(outs) > 1 else (result,)
        targets = [one if _is_shown(part, array) else None for one, array, part in zip(outs, shown, results)]
    elif isinstance(result, (numpy.ndarray, list, tuple)):
        if given and result is given[0]:
            return arguments[0]
        for at, one in enumerate(given):
            if one is result:  # its former elements are not operands
                targets, args[at] = [arguments[at]], None
        if not targets:
            result, is_view = _views(result, captured.arrays, given)
            if is_view:
                return result
    made = result
    if captured.operands and captured.is_whole:
        if getattr(getattr(result, 'dtype', None), 'kind', '') == 'f':
            named.pop('dtype', None)  # numbers of 32 bits would be too coarse to be differentiated
        made = wrapped(result, Call(function, args, named), captured.operands, captured.copied)
    if made is result and captured.operands:
        for tell in LOST:
            tell(result, (arguments, options))
    parts = list(made) if len(targets) > 1 else [made]
    for at, (target, part) in enumerate(zip(targets, parts)):
        if type(target) is TrackedArray:
            chosen = numpy.broadcast_to(plain_options['where'], target.shape) if is_masked else ...
            target.write_provenance(chosen, provenance_of(part))
        if isinstance(target, numpy.ndarray) and not isinstance(part, numpy.generic):
            parts[at] = target
    return tuple(parts) if len(targets) > 1 else parts[0]


def _is_shown(result: Any, out: Any) -> bool:
    """Return True for what was written to an array; NumPy may give the number of one without axes."""
    return out is result or (isinstance(out, numpy.ndarray) and not out.ndim and isinstance(result, numpy.generic))


def _views(result: Any, arrays: Sequence[TrackedArray], given: Sequence[Any]) -> Tuple[Any, bool]:
    """A result, or the results in a list, with the provenance of the arrays that it shows, and whether it shows some.

    Args:
        arrays: those with provenance that NumPy's function was given.
        given: its plain arguments.
    """
    if type(result) in (list, tuple):
        parts = [_views(part, arrays, given) for part in result]
        is_view = bool(parts) and all(is_view for _, is_view in parts)
        return (type(result)([part for part, _ in parts]), True) if is_view else (result, False)
    if not isinstance(result, numpy.ndarray) or result.base is None:
        return result, False
    for array in arrays:
        memory = array._memory
        if memory is not None and memory.root.dtype == result.dtype and numpy.may_share_memory(memory.root, result):
            return of_memory(result, memory), True
    return result, any(isinstance(one, numpy.ndarray) and numpy.may_share_memory(one, result) for one in given)


def _array_ufunc(_: Any, ufunc: Any, method: str, *inputs: Argument, **options: Argument) -> Any:
    return compute(ufunc, method, inputs, options)


def _as_array(name: str) -> Callable[..., Any]:
    """A method of a number that does what an array of this number does."""
    return lambda self, *a, **options: getattr(of_list(self.tracked, self.dtype), name)(*a, **options)


_METHODS = 'sum mean max min prod std var ptp clip ravel flatten reshape repeat cumsum cumprod'
for _name in _METHODS.split():
    for _kind in CLASSES.values():
        setattr(_kind, _name, _as_array(_name))

# They complete the class, as NEP 13 and NEP 18 have it.
_class: Any = TrackedArray
_class.__array_ufunc__ = _array_ufunc
_class.__array_function__ = lambda _, function, types, arguments, options: call(function, arguments, options)
complete(compute, ARRAYS, _array_ufunc)
