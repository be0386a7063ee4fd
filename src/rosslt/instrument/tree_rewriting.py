"""Rewrites the syntax tree of a node: a number literal becomes the reading of a location, imported functions become
ones that keep provenance, and a state is cut off from its past. Lines and columns stay those of the file.
"""

import ast
import copy
from typing import Any, Dict, List, NamedTuple, Optional, Set, Tuple, Union

from rosslt import files
from rosslt.instrument.callees import CHANCE
from rosslt.instrument.lifetimes import bound_arguments, own_functions
from rosslt.instrument.literals import Literal, SourceText, find_literals
from rosslt.instrument.plain_readings import plain_readings
from rosslt.instrument.set_up_names import Way, names_of_set_up, reaches_other_modules
from rosslt.instrument.states import States, find_states, reads_parameters

#: The name of its cells in a module that runs rewritten.
CELLS = '__rosslt_cells__'
#: The names that rewritten code finds among Python's own, whatever its globals are.
ROUTE, ROUTE_ALL, PLAIN, PLAIN_PARTS, CUT_OFF, OBJECT, SAME, TAKEN = (
    '__rosslt_route__',
    '__rosslt_route_all__',
    '__rosslt_plain__',
    '__rosslt_plain_parts__',
    '__rosslt_cut_off__',
    '__rosslt_object__',
    '__rosslt_same__',
    '__rosslt_taken__',
)
#: Conversions of which the argument may be tracked.
CONVERSIONS = {
    'float': '__rosslt_float__',
    'int': '__rosslt_int__',
    'sum': '__rosslt_sum__',
    'type': '__rosslt_type__',
}
#: The names of NumPy's numbers, which are called as conversions, and of what calls them.
NUMPY_CONVERSIONS, CONVERT = {'float32', 'float64', 'int64'}, '__rosslt_convert__'
#: Operators of which a plain float, or NumPy's, on the left would take no notice of the provenance on the right.
OPERATORS = {
    ast.Add: '__rosslt_add__',
    ast.Sub: '__rosslt_sub__',
    ast.Mult: '__rosslt_mul__',
    ast.Div: '__rosslt_truediv__',
}


def name_of_cells(path: str, digest: str) -> str:
    """The name by which the code of a file finds its cells; it differs for each content of the file.

    Args:
        path: the real path of the file.
        digest: the hash of its content.
    """
    # It ends with underscores, as Python mangles names in classes that do not.
    return f'{CELLS}{files.digest_of(path.encode("utf-8", "surrogateescape"))}{digest}__'


def in_place(operator: str) -> str:
    """Return the name of the augmented operator (`iadd`) for the name of a plain one (`add`)."""
    return operator.replace('__rosslt_', '__rosslt_i')


_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)

#: Methods of which Python takes a number of the very class that it asks for, and warns of any other.
_EXACT = ('__complex__', '__float__', '__index__', '__int__')


class Rewritten(NamedTuple):
    """A rewritten file.

    Attributes:
        code: its code object.
        literals: its locations, in the order of their cells.
        digest: the hash of the content of the file that was read.
        set_up: the names that are read in the set-up alone if it is the program, as `names_of_set_up` finds them.
        reaches_others: as `reaches_other_modules` says.
    """

    code: Any
    literals: List[Literal]
    digest: str
    set_up: Dict[str, List[Way]]
    reaches_others: bool


def rewrite(content: bytes, path: str, named: str) -> Rewritten:
    """Rewrite a source file.

    Args:
        content: of the file.
        path: where it is.
        named: what its code object calls the file, as in tracebacks.

    Raises:
        SyntaxError: as in `compile`.
    """
    source = SourceText(path, content)
    tree = ast.parse(content, named)
    states = find_states(tree)
    found = find_literals(tree, source, states)
    literals = [literal for _, literal in found]
    cells = {id(node): (number, literal) for number, (node, literal) in enumerate(found)}
    name = name_of_cells(source.path, source.digest)
    bound = bound_names(tree)
    taken = plain_readings(tree, bound)
    whole = _Hidden(tree, cells, (int,))
    hidden = _Hidden(tree, cells, (int, float)) if _uses_numpy(tree) else whole
    rewriter = _Rewriter(name, cells, states, bound, taken, _shared_names(tree), hidden, whole)
    set_up, reaches_others = names_of_set_up(tree), reaches_other_modules(tree)
    tree = ast.fix_missing_locations(rewriter.visit(tree))
    code = compile(tree, named, 'exec', dont_inherit=True)
    return Rewritten(code, literals, source.digest, set_up, reaches_others)


def bound_names(tree: ast.AST) -> Set[str]:
    """The names that the program itself gives a meaning, anywhere."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            names.add(node.id)
        elif isinstance(node, (*_FUNCTIONS, ast.ClassDef)):
            names.add(node.name)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
        elif isinstance(node, ast.alias):
            names.add((node.asname or node.name).split('.')[0])
    return names


def _shared_names(tree: ast.AST) -> Set[str]:
    """Names declared global or nonlocal in a function: a call may change their values."""
    return {name for node in ast.walk(tree) if isinstance(node, (ast.Global, ast.Nonlocal)) for name in node.names}


class _Hidden:
    """Finds right operands whose provenance a plain number on the left would ignore.

    Attributes:
        kinds: the classes of such numbers: ints, and if the left one may be NumPy's, floats too.
        names: the names, without what they are attributes of, that may stand for them.
    """

    def __init__(self, tree: ast.AST, cells: Any, kinds: Tuple[type, ...]) -> None:
        self._cells, self._reads_parameter = cells, reads_parameters(tree)
        self.kinds = kinds
        self.names: Set[str] = set()
        functions = own_functions(tree)
        before = -1
        while before < len(self.names):  # until no name is added
            before = len(self.names)
            for node in ast.walk(tree):
                self.names |= _given(node, functions, self)
                self.names.discard('')

    def make(self, node: Optional[ast.AST]) -> bool:
        """Return whether an expression makes such a number from a literal, a parameter or a name for one of these."""
        if node is None:
            return False
        if isinstance(node, (ast.Name, ast.Attribute, ast.Subscript)):
            return _last_name(node) in self.names
        # Results of arithmetic on ints are mostly floats, which are looked for only if there is NumPy.
        has_floats = float in self.kinds
        elements = [one for one in getattr(node, 'elts', [node]) if has_floats or not _is_fraction(one)]
        return any(
            (id(part) in self._cells and type(self._cells[id(part)][1].value) in self.kinds)
            or (isinstance(part, ast.Call) and self._reads_parameter(part))
            or (has_floats and isinstance(part, (ast.Name, ast.Attribute)) and _last_name(part) in self.names)
            for element in elements
            for part in ast.walk(element)
        )

    def may_be(self, node: ast.AST) -> bool:
        """Return whether an operand may be such a number."""
        if id(node) in self._cells:
            return type(self._cells[id(node)][1].value) in self.kinds
        if isinstance(node, ast.BinOp):
            return (float in self.kinds or not _is_fraction(node)) and (
                self.may_be(node.left) or self.may_be(node.right)
            )
        if isinstance(node, ast.UnaryOp):
            return self.may_be(node.operand)
        if isinstance(node, ast.Call):
            # With NumPy, any function of such numbers may give one; else only those that give ints, and parameters.
            is_of_hidden = float in self.kinds and any(map(self.may_be, node.args))
            return (
                is_of_hidden or _last_name(node.func) in {'int', 'round', 'len', 'abs'} or self._reads_parameter(node)
            )
        name = _last_name(node)
        # Constants of other modules are called so.
        return name in self.names or (float in self.kinds and name.isupper())


def _is_fraction(node: ast.AST) -> bool:
    """Return whether numbers give a float in any case: a division, a float literal, or arithmetic with one of these."""
    if isinstance(node, ast.Constant):
        return type(node.value) is float
    if isinstance(node, ast.UnaryOp):
        return _is_fraction(node.operand)
    if not isinstance(node, ast.BinOp):
        return False
    return isinstance(node.op, ast.Div) or (
        isinstance(node.op, (ast.Add, ast.Sub, ast.Mult)) and (_is_fraction(node.left) or _is_fraction(node.right))
    )


def _given(node: ast.AST, functions: Dict[str, List[ast.AST]], makers: _Hidden) -> Set[str]:
    """The names that a statement, a call or a definition gives such numbers."""
    if isinstance(node, (ast.Assign, ast.AnnAssign)) and makers.make(node.value):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        return {_last_name(part) for target in targets for part in getattr(target, 'elts', [target])}
    if isinstance(node, (ast.For, ast.comprehension)) and makers.make(node.iter):
        return {_last_name(part) for part in getattr(node.target, 'elts', [node.target])}
    if isinstance(node, ast.arguments):
        positional = [*getattr(node, 'posonlyargs', ()), *node.args]
        pairs = [*zip(positional[len(positional) - len(node.defaults) :], node.defaults)]
        pairs += [(arg, default) for arg, default in zip(node.kwonlyargs, node.kw_defaults) if default is not None]
        return {arg.arg for arg, default in pairs if makers.make(default)}
    if isinstance(node, ast.Call):
        names = {keyword.arg for keyword in node.keywords if keyword.arg and makers.make(keyword.value)}
        for function in functions.get(_last_name(node.func), ()):
            names |= {name for name, value in bound_arguments(function, node) if makers.make(value)}
        return names
    return set()


def _uses_numpy(tree: ast.AST) -> bool:
    return any(
        (isinstance(node, ast.Import) and any(alias.name.split('.')[0] in _OF_NUMPY for alias in node.names))
        or (isinstance(node, ast.ImportFrom) and (node.module or '').split('.')[0] in _OF_NUMPY)
        for node in ast.walk(tree)
    )


#: Modules of which functions give numbers of NumPy.
_OF_NUMPY = ('numpy', 'scipy', 'tf', 'tf_conversions')


def _last_name(node: ast.AST) -> str:
    if isinstance(node, ast.Subscript):
        node = node.value
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, 'id', '')


class _Rewriter(ast.NodeTransformer):
    def __init__(
        self,
        name: str,
        cells: Any,
        states: States,
        bound: Set[str],
        taken: Dict[int, str],
        shared: Set[str],
        hidden: _Hidden,
        whole: _Hidden,
    ) -> None:
        self._name_of_cells = name
        self._cells = cells
        self._steps, self._parts = states.steps, states.parts
        self._bound = bound
        self._taken = taken
        self._chance = CHANCE - bound
        self._shared = shared
        self._hidden, self._whole = hidden, whole
        self._is_exact = False  # whether what is visited is in a method of `_EXACT`
        self._class = ''  # the innermost one around what is visited

    def visit(self, node: ast.AST) -> Any:
        cell = self._cells.get(id(node))
        if cell is not None:
            return self._reading(node, *cell)
        taker = self._taken.get(id(node))
        made = super().visit(node)
        if taker is not None:
            made = _call(TAKEN, [_text(taker, node), made], node)
        return _call(PLAIN, [made], made) if node in self._parts else made

    def _reading(self, node: Any, number: int, literal: Literal) -> ast.AST:
        where = ast.copy_location(ast.Constant(value=number), node)
        index: Any = where if _HAS_PLAIN_INDEX else ast.copy_location(ast.Index(value=where), node)
        cells: Any = _name(self._name_of_cells, node)
        if literal.rule == 'step':
            cells = ast.copy_location(ast.Attribute(value=cells, attr='steps', ctx=ast.Load()), node)
        reading = ast.Subscript(value=cells, slice=index, ctx=ast.Load())
        return ast.copy_location(reading, node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        around, self._is_exact = self._is_exact, node.name in _EXACT
        self.generic_visit(node)
        self._is_exact = around
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        around, self._class = self._class, node.name
        self.generic_visit(node)
        self._class = around
        return node

    def visit_Return(self, node: ast.Return) -> ast.AST:
        self.generic_visit(node)
        if self._is_exact and node.value is not None:
            node.value = _call(PLAIN, [node.value], node.value)
        return node

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.AST:
        return node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        conversion = CONVERSIONS.get(getattr(node.func, 'id', ''))
        name = getattr(node.func, 'id', '')
        is_simple = len(node.args) in ((1, 2) if name == 'sum' else (1,)) and not node.keywords
        is_simple = is_simple and not any(isinstance(argument, ast.Starred) for argument in node.args)
        if conversion and is_simple:
            if not self._bound.isdisjoint(('*', name)):  # the node may use that name for something else
                return _call(CONVERT, [node.func, *node.args], node)
            node.func = _name(conversion, node.func)
        elif is_simple and _last_name(node.func) in NUMPY_CONVERSIONS:
            return _call(CONVERT, [node.func, *node.args], node)
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        operator = OPERATORS.get(type(node.op))
        # A float that is no location, as in `1.0 / rate`, hides ints alone.
        is_float = type(getattr(node.left, 'value', None)) is float and id(node.left) not in self._cells
        hidden = self._whole if is_float else self._hidden
        is_needed = operator is not None and (is_float or not self._is_known(node.left)) and hidden.may_be(node.right)
        self.generic_visit(node)
        return _call(operator, [node.left, node.right], node) if operator and is_needed else node

    def _is_known(self, node: ast.AST) -> bool:
        """Return whether a left operand keeps its own provenance, is not a number, or comes from a random function."""
        return (
            id(node) in self._cells
            or isinstance(node, (ast.Constant, ast.JoinedStr, ast.List, ast.Tuple, ast.Dict, ast.ListComp))
            or any(isinstance(part, ast.Call) and _last_name(part.func) in self._chance for part in ast.walk(node))
        )

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        has_literals = any(isinstance(operand, ast.Constant) for operand in (node.left, *node.comparators))
        self.generic_visit(node)
        if not all(isinstance(operator, (ast.Is, ast.IsNot)) for operator in node.ops):
            return node
        operands = [node.left, *node.comparators]
        if any(isinstance(operand, ast.Constant) and operand.value is None for operand in operands):
            return node
        # One number must be one object, as it is without provenance.
        if len(operands) == 2 and not has_literals:
            same = _call(SAME, operands, node)
            return same if isinstance(node.ops[0], ast.Is) else ast.copy_location(ast.UnaryOp(ast.Not(), same), node)
        made: List[ast.expr] = [
            operand if isinstance(operand, ast.Constant) else _call(OBJECT, [operand], operand) for operand in operands
        ]
        node.left, node.comparators = made[0], made[1:]
        return node

    def visit_Import(self, node: ast.Import) -> Union[ast.AST, List[ast.stmt]]:
        return [
            node,
            *(_routed(alias.asname or alias.name.split('.')[0], node, _text(alias.name, node)) for alias in node.names),
        ]

    def visit_ImportFrom(self, node: ast.ImportFrom) -> Union[ast.AST, List[ast.stmt]]:
        if node.module == '__future__':
            return node
        if any(alias.name == '*' for alias in node.names):
            call = _call(ROUTE_ALL, [_call('globals', [], node), *_origin(node)], node)
            return [node, ast.copy_location(ast.Expr(value=call), node)]
        return [node, *(_routed(alias.asname or alias.name, node, *_origin(node)) for alias in node.names)]

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        others = self._steps.get(node)
        self.generic_visit(node)
        if others is not None:
            indices = [ast.copy_location(ast.Constant(value=index, kind=None), node.value) for index in others]
            node.value = _call(PLAIN_PARTS if others else PLAIN, [node.value, *indices], node.value)
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        is_step = node in self._steps and node.value is not None
        self.generic_visit(node)
        if is_step and node.value is not None:
            node.value = _call(PLAIN, [node.value], node.value)
        return node

    def _is_same_twice(self, target: ast.AST, value: ast.AST) -> bool:
        """Return whether a target may be evaluated both before and after a value, with the same result.

        This holds for a name, and for an attribute of a name that the value does not rebind. Other targets may have
        side effects, or give another object.
        """
        if isinstance(target, ast.Name):
            return True
        owner = getattr(getattr(target, 'value', None), 'id', None)
        if not isinstance(target, ast.Attribute) or owner is None or owner in self._shared:
            return False
        return owner not in bound_names(value)

    def _key(self, target: Union[ast.Attribute, ast.Subscript]) -> Optional[ast.expr]:
        """The key of a target, as `starts.cut_off` takes it; None if it must not be evaluated twice."""
        if isinstance(target, ast.Attribute):
            is_private = self._class.strip('_') and target.attr[:2] == '__' != target.attr[-2:]
            return _text(f'_{self._class.lstrip("_")}{target.attr}' if is_private else target.attr, target)
        index: Any = getattr(target.slice, 'value', None) if type(target.slice).__name__ == 'Index' else target.slice
        if not all(isinstance(part, _INDEXING) for part in ast.walk(index)):
            return None
        return ast.copy_location(ast.Tuple(elts=[copy.deepcopy(index)], ctx=ast.Load()), target)

    def visit_AugAssign(self, node: ast.AugAssign) -> Union[ast.AST, List[ast.stmt]]:
        is_step = node in self._steps
        operator = OPERATORS.get(type(node.op))
        is_needed = (
            operator is not None and self._is_same_twice(node.target, node.value) and self._hidden.may_be(node.value)
        )
        is_plain = id(node.value) in self._cells and self._cells[id(node.value)][1].rule == 'step'
        self.generic_visit(node)
        if not is_step and is_needed:
            read = _loaded(node.target)
            value = _call(in_place(OPERATORS[type(node.op)]), [read, node.value], node)
            return ast.copy_location(ast.Assign(targets=[node.target], value=value), node)
        if not is_step:
            return node
        if not is_plain:
            node.value = _call(PLAIN, [node.value], node.value)
        if isinstance(node.target, (ast.Attribute, ast.Subscript)):
            key = self._key(node.target)
            if key is not None:
                node.target.value = _call(CUT_OFF, [node.target.value, key], node.target.value)
            return node
        read = ast.copy_location(ast.Name(id=node.target.id, ctx=ast.Load()), node.target)
        again = ast.Assign(targets=[copy.copy(node.target)], value=_call(PLAIN, [read], node))
        return [node, ast.copy_location(again, node)]


_INDEXING = (ast.Name, ast.Constant, ast.Tuple, ast.UnaryOp, ast.USub, ast.Load)
"""The nodes of indices that are the same each time they are evaluated, and do nothing else."""

_HAS_PLAIN_INDEX = not hasattr(ast, 'Index') or not isinstance(
    ast.parse('a[0]').body[0].value.slice,  # type: ignore[attr-defined]
    getattr(ast, 'Index', ()),
)


def _name(name: str, where: ast.AST) -> ast.Name:
    return ast.copy_location(ast.Name(id=name, ctx=ast.Load()), where)


def _loaded(target: Any) -> Any:
    """A name, or an attribute of one, that is read where it was assigned."""
    read = copy.copy(target)
    read.ctx = ast.Load()
    return read


def _origin(node: ast.ImportFrom) -> List[ast.expr]:
    """The module that is imported from, as an argument; none for one that is relative to the file's own."""
    return [] if node.level or not node.module else [_text(node.module, node)]


def _text(text: str, where: ast.AST) -> ast.expr:
    return ast.copy_location(ast.Constant(value=text, kind=None), where)


def _call(function: str, arguments: List[ast.expr], where: ast.AST) -> ast.Call:
    return ast.copy_location(ast.Call(func=_name(function, where), args=arguments, keywords=[]), where)


def _routed(name: str, where: ast.stmt, *origin: ast.expr) -> ast.stmt:
    target = ast.copy_location(ast.Name(id=name, ctx=ast.Store()), where)
    return ast.copy_location(
        ast.Assign(targets=[target], value=_call(ROUTE, [_name(name, where), *origin], where)), where
    )
