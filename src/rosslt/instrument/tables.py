"""The tables of a program: lists, tuples and dictionaries of several rows that are alike, as waypoints.

What is computed from a single row of a table is one of several things, and the row has what is its own.
"""

import ast
from typing import Any, Dict, List, Tuple

_Shape = Tuple[Any, ...]

#: The shape of what is no row: a number, a text, a name, or a formula of these.
_LEAF: _Shape = ('leaf',)


def rows_of_literals(tree: ast.AST) -> Dict[int, str]:
    """{id of a number literal: the row that it is in}, `12:9[1]` for row 1 of the table at line 12 and column 9.

    A row is a list, a tuple, a dictionary or a call; its numbers may stand in formulas, and names may stand for other
    rows. Of tables of tables, the rows are those of the inner ones. Literals in no table are left out.
    """
    found: Dict[int, str] = {}
    for node in ast.walk(tree):  # from the outside inward
        for number, row in enumerate(_rows(node)):
            where = f'{node.lineno}:{node.col_offset + 1}[{number}]'  # type: ignore[attr-defined]
            found.update({id(part): where for part in ast.walk(row)})
    return found


def _rows(node: ast.AST) -> List[ast.expr]:
    """The rows of a table; none if it is anything else."""
    if isinstance(node, (ast.List, ast.Tuple)):
        rows = node.elts
    elif isinstance(node, ast.Dict):
        rows = node.values
    else:
        return []
    shapes = [_shape(row) for row in rows if not isinstance(row, (ast.Name, ast.Attribute, ast.Subscript))]
    is_table = len(shapes) > 1 and len(set(shapes)) == 1 and shapes[0] != _LEAF and any(map(_has_number, rows))
    return rows if is_table else []


def _shape(node: ast.AST) -> _Shape:
    """Return the key that rows of the same shape share."""
    if isinstance(node, (ast.List, ast.Tuple)):
        return ('list', *map(_shape, node.elts))
    if isinstance(node, ast.Dict):
        keys = tuple([getattr(key, 'value', None) for key in node.keys])
        return ('dict', keys, *map(_shape, node.values))
    if isinstance(node, ast.Call):
        keywords = [(keyword.arg, _shape(keyword.value)) for keyword in node.keywords]
        return ('call', ast.dump(node.func), *map(_shape, node.args), *keywords)
    return _LEAF


def _has_number(row: ast.AST) -> bool:
    return any(isinstance(part, ast.Constant) and type(part.value) in (int, float) for part in ast.walk(row))
