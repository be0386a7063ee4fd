"""The functions and classes of other libraries that compute from their arguments alone: a node gets ones that keep
provenance."""

import importlib
import sys
import types
from typing import Any, Callable, Dict, Iterable, Set

from rosslt import values
from rosslt.instrument import cells, routing

#: What is known to do so, by module.
TABLE = {
    'scipy.interpolate': 'splev splprep splrep',
    'scipy.linalg': 'expm inv logm pinv polar solve sqrtm svd',
    'scipy.spatial': 'geometric_slerp',
    'scipy.spatial.transform': 'Rotation Slerp',
}

DRAWING = {'Rotation': ('random',)}
"""The methods that draw random numbers, by class: the program draws the next ones."""


def keep_provenance(names: Iterable[str] = ()) -> None:
    """Have nodes get what is in the table, and what is named besides, as ones that keep provenance.

    Args:
        names: `MODULE.NAME` of further functions and classes.
    """
    by_module: Dict[str, Set[str]] = {module: set(known.split()) for module, known in TABLE.items()}
    for name in names:
        module, _, last = name.rpartition('.')
        by_module.setdefault(module, set()).add(last)
    for module, known in by_module.items():
        routing.replace_module(module)(_counterpart_with(known))


def _counterpart_with(names: Set[str]) -> Callable[[types.ModuleType], Any]:
    def make(original: types.ModuleType) -> Any:
        routing.route(importlib.import_module('numpy'))  # arrays with provenance look like its own
        arrays = values.numpy_arrays()
        others = {}
        for name in sorted(names):
            thing, why = getattr(original, name, None), ''
            if isinstance(thing, type) and arrays.can_keep(thing):
                others[name] = arrays.pure_class(thing, DRAWING.get(name, ()))
                cells.strip_by(others[name], arrays.unkept)
            elif callable(thing) and not isinstance(thing, type):
                others[name] = arrays.pure(thing)
            elif thing is None:
                why = 'there is no such name'
            else:
                why = 'its objects cannot be given other numbers'
            if why and name not in TABLE.get(original.__name__, '').split():
                print(f'rosslt run: {original.__name__}.{name} keeps no provenance: {why}', file=sys.stderr)
        for name, other in others.items():
            routing.replace(getattr(original, name), other)
        return routing.Counterpart(original, others)

    return make
