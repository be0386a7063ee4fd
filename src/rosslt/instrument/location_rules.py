"""Decides from the source text which number literals of a program are locations, by the rules in `RULES`.

A literal gets the verdict of the first rule that applies to its position, from the literal outwards. The verdict says
whether the number is a location, and at which rank a drag changes it.
"""

import ast
import sys
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Set, Tuple

from rosslt.instrument.callees import (
    CLOCKS,
    COUNT_ATTRIBUTES,
    ENUMERATIONS,
    FIELDS,
    MODULES_OF_NUMBERS,
    PASSING_ON,
    PLAIN_CALLS,
    PLAIN_KEYWORDS,
    PLAIN_MODULES,
    SHAPE_CALLS,
    STRICT_DECORATORS,
    TURN_CALLS,
    TURNS,
    UNITS,
    WAVES,
)
from rosslt.instrument.lifetimes import FUNCTIONS, bound_arguments, own_functions
from rosslt.instrument.states import States, dotted, find_states, reads_parameters

NUMBER, WHOLE, FORM, PLAIN = 'number', 'whole', 'form', 'plain'

#: The smallest int that counts as an offset when it is added to an index, as the 50 in `x = i - 50`.
OFFSET = 10


class Rule(NamedTuple):
    """A row of the table.

    Attributes:
        name: what the other parts call it.
        verdict: what it says of a literal.
        reason: why.
        example: a line of code in which the literal `7` (or `7.0`) is judged by it.
    """

    name: str
    verdict: str
    reason: str
    example: str


RULES = {
    rule.name: rule
    for rule in (
        Rule('named', NUMBER, 'the value of a name, or of a table: what a person would change first', 'speed = 7.0'),
        Rule('parameter', NUMBER, 'the value of a parameter that is left out in a call', 'def f(x=7.0): pass'),
        Rule('value', NUMBER, 'a value of its own', 'send(7.0)'),
        Rule('term', NUMBER, 'a term or a factor of a formula', 'x = 7.0 * y'),
        Rule('counting name', WHOLE, 'it names, selects, counts or limits a count: it stays an int', 'marker.id = 7'),
        Rule('enumeration', WHOLE, 'one of several names for whole numbers', 'class Mode:\n    MANUAL = 7'),
        Rule('used as a count', WHOLE, 'its name is used as a count or a size', 'n = 7\nfor i in range(n): pass'),
        Rule('divisor', FORM, 'what is divided by is a unit or a count', 'x = y / 7.0'),
        Rule('turn', FORM, 'a part of a turn', 'x = 7 * math.pi * y'),
        Rule('phase', FORM, 'how a wave depends on its time', 'x = math.cos(t * 7.0)'),
        Rule(
            'no turn',
            FORM,
            'a 0 beside an angle that is computed: it turns about that axis alone',
            'q = quaternion_from_euler(0.0, 0, yaw)',
        ),
        Rule('unit', FORM, 'a conversion of units', 'x = y * 1000'),
        Rule('sign', FORM, 'a change of the sign', 'x = -1 * y'),
        Rule('clock', FORM, 'how a clock runs', 'x = rospy.get_time() * 7.0'),
        Rule(
            'neighbour',
            FORM,
            'the next or the last one of those counted, less than ten away',
            'for i in range(n):\n    x = i + 7',
        ),
        Rule('step', FORM, 'the step of a state', 'while True:\n    t += 7.0\n    rate.sleep()'),
        Rule(
            'state',
            PLAIN,
            'where a state starts',
            'class A:\n    def f(self):\n        self.n = 7\n    def g(self):\n        self.n = self.n * 2',
        ),
        Rule('count', PLAIN, 'a count, a rate, a time or a size', 'for i in range(7): pass'),
        Rule('option', PLAIN, 'an option of a call', "rospy.Publisher('a', A, queue_size=7)"),
        Rule('default of a parameter', PLAIN, 'the parameter is the location', "x = rospy.get_param('~x', 7.0)"),
        Rule('system', PLAIN, 'for the system or a device, not for a message', 'os.nice(7)'),
        Rule('index', PLAIN, 'an index or a slice', 'x = y[7]'),
        Rule('used as an index', PLAIN, 'its name is used as an index', 'k = 7\nx = y[k]'),
        Rule('comparison', PLAIN, 'what is compared gives no number', 'x = y < 7'),
        Rule('condition', PLAIN, 'a condition gives no number', 'while 7: break'),
        Rule('bits', PLAIN, 'a pattern of bits', 'x = y & 7'),
        Rule('bit notation', PLAIN, 'written as bits', 'x = 0x7'),
        Rule('exponent', PLAIN, 'an exponent makes another formula', 'x = y ** 7'),
        Rule('modulus', PLAIN, 'the modulus of whole numbers', 'x = y % 7'),
        Rule('repetition', PLAIN, 'how often something is repeated', 'x = [y] * 7'),
        Rule('text', PLAIN, 'what is formatted becomes a text', "x = f'{7}'"),
        Rule('decorator', PLAIN, 'belongs to the definition', '@retry(7)\ndef f(): pass'),
        Rule('default', PLAIN, 'of a lambda, of a count, or part of a formula', 'f = lambda x=7.0: x'),
        Rule('annotation', PLAIN, 'belongs to the definition', 'def f(x: limited(7)): pass'),
        Rule('pattern', PLAIN, 'a pattern must stay a constant', 'match x:\n    case 7: pass'),
        Rule('key', PLAIN, 'the key of a dictionary', 'x = {7: y}'),
        Rule('statement', PLAIN, 'nothing is done with it', '7'),
        Rule(
            'strict', PLAIN, 'code that is compiled, or that asks for the exact type', '@njit\ndef f():\n    return 7.0'
        ),
        Rule('not finite', PLAIN, 'no location holds what is not finite', 'x = 7e999'),
        Rule('skip', PLAIN, '`# rosslt: skip` stands there', 'x = 7.0  # rosslt: skip'),
    )
}

_BITS = (ast.LShift, ast.RShift, ast.BitAnd, ast.BitOr, ast.BitXor)
_MATCH_CASE = getattr(ast, 'match_case', ())
_Literal = Tuple[ast.expr, ast.Constant]


class Judgement(NamedTuple):
    """The decision about one literal.

    Attributes:
        node: the expression, with a sign in front of the number.
        value: its number.
        rule: the row of the table that speaks for it.
        name: the variable that it is the value of (`speed`, `pose.x`), None if it is part of something else.
    """

    node: ast.expr
    value: float
    rule: Rule
    name: Optional[str]


def judge(tree: ast.Module, text_of: Callable[[ast.AST], str], states: Optional[States] = None) -> Iterator[Judgement]:
    """Judge all number literals of a program, in their order in the tree.

    Args:
        tree: of the program.
        text_of: the text of a node, as it is written.
        states: those of the program, if they are known already.
    """
    judge_one = _Judge(tree, states or find_states(tree), text_of)
    for node, constant in _number_literals(tree):
        yield judge_one(node, constant)


def _number_literals(tree: ast.AST) -> Iterator[_Literal]:
    """The numbers, each with the sign in front of it."""
    signed = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)) and _is_number(node.operand):
            signed[id(node.operand)] = node
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and _is_number(node):
            yield signed.get(id(node), node), node


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


class _Judge:
    def __init__(self, tree: ast.Module, states: States, text_of: Callable[[ast.AST], str]) -> None:
        self._parents: Dict[int, Tuple[ast.AST, str]] = {}
        for parent in ast.walk(tree):
            for field, value in ast.iter_fields(parent):
                for child in value if isinstance(value, list) else [value]:
                    if isinstance(child, ast.AST):
                        self._parents[id(child)] = parent, field
        self._states = states
        self._text_of = text_of
        self._functions, self._reads_parameter = own_functions(tree), reads_parameters(tree)
        self._counts, self._indices = _uses(tree, self._functions)
        self._count_fields = COUNT_ATTRIBUTES | {one.split('.')[-1].lower() for one in self._counts if '.' in one}
        self._limits = _limits_of_counters(tree)
        self._strict = {id(node) for part in ast.walk(tree) if _is_strict(part) for node in ast.walk(part)}

    def __call__(self, node: ast.expr, constant: ast.Constant) -> Judgement:
        value = constant.value
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            value = -value
        name, rule = self._name_and_rule(node, constant, value)
        return Judgement(node, value, RULES[rule], name)

    def _name_and_rule(self, node: ast.expr, constant: ast.Constant, value: float) -> Tuple[Optional[str], str]:
        if not -sys.float_info.max <= value <= sys.float_info.max:
            return None, 'not finite'
        is_whole = type(constant.value) is int
        if is_whole and self._text_of(constant)[:2].lower() in ('0x', '0o', '0b'):
            return None, 'bit notation'
        if id(node) in self._strict:
            return None, 'strict'
        found, in_formula, name = None, False, None
        formula: Optional[ast.AST] = None
        in_container = False  # what a list is extended by is not a number that is carried on
        is_element = True  # of nested containers, and of nothing else
        child: ast.AST = node
        while id(child) in self._parents:
            parent, field = self._parents[id(child)]
            parameter = self._parameter(parent, field, child, is_whole)
            if parameter:
                return (parameter if child is node else None), 'parameter'
            rule = self._outright(parent, field, child, node, is_whole)
            if rule and not (rule == 'step' and in_container):
                return None, rule
            is_container = isinstance(parent, (ast.List, ast.Tuple, ast.Dict, ast.Set))
            in_container = in_container or is_container
            if isinstance(parent, ast.BinOp):
                formula = parent
                if found is None:
                    found = self._in_formula(parent, field, child is node, value)
                in_formula = True
            elif isinstance(parent, ast.Call) and child is node and value == 0 and _is_turn_about_one_axis(parent):
                found = 'no turn'
            elif isinstance(parent, ast.Call) and in_formula and found is None and _last(parent.func) in WAVES:
                found = 'phase'
            elif isinstance(parent, ast.stmt):
                if child is node:
                    name = _assigned(parent)
                if found or in_formula:
                    is_added_turn = found == 'turn' and isinstance(parent, ast.AugAssign)
                    return None, found if found and (is_added_turn or not _is_constant(formula)) else 'term'
                rule = self._of_value(parent, node, child is node, name, is_whole)
                return name, 'named' if rule == 'value' and is_element and _assigned(parent) else rule
            elif isinstance(parent, ast.keyword) and is_whole and parent.arg in self._count_fields and not in_formula:
                return parent.arg, 'counting name'
            child, is_element = parent, is_element and is_container
        return None, found or 'value'

    def _parameter(self, parent: ast.AST, field: str, value: ast.AST, is_whole: bool) -> Optional[str]:
        """The parameter of which a literal is the default, if it is the value of something."""
        if field not in ('defaults', 'kw_defaults') or not isinstance(parent, ast.arguments):
            return None
        if not isinstance(value, (ast.Constant, ast.UnaryOp, ast.Tuple, ast.List)):
            return None
        if isinstance(self._parents[id(parent)][0], ast.Lambda):
            return None
        with_default = parent.kwonlyargs
        defaults: List[Optional[ast.expr]] = list(parent.kw_defaults)
        if field == 'defaults':
            defaults = list(parent.defaults)
            with_default = [*getattr(parent, 'posonlyargs', ()), *parent.args][-len(defaults) :]
        name = next(arg.arg for arg, default in zip(with_default, defaults) if default is value)
        if name in PLAIN_KEYWORDS or (is_whole and name.lower() in COUNT_ATTRIBUTES | self._counts | self._indices):
            return None
        return name

    def _is_field(self, keyword: ast.keyword) -> bool:
        """Return whether a keyword may be a field of a message constructor, as in `Joy(axes=[0.5])`."""
        call = self._parents[id(keyword)][0]
        return keyword.arg in FIELDS and isinstance(call, ast.Call) and _last(call.func)[:1].isupper()

    def _outright(self, parent: ast.AST, field: str, child: ast.AST, node: ast.AST, is_whole: bool) -> Optional[str]:
        """The rule that speaks for all below a field of a node, whatever else they are."""
        if field == 'slice' or isinstance(parent, ast.Slice):
            return 'index'
        if isinstance(parent, (ast.JoinedStr, ast.FormattedValue)):
            return 'text'
        if field == 'decorator_list':
            return 'decorator'
        if field in ('defaults', 'kw_defaults'):
            return 'default'
        if field in ('annotation', 'returns'):
            return 'annotation'
        if isinstance(parent, _MATCH_CASE) and field == 'pattern':
            return 'pattern'
        if isinstance(parent, ast.Dict) and field == 'keys':
            return 'key'
        if isinstance(parent, ast.Compare):
            return 'comparison'
        if field == 'test' or isinstance(parent, (ast.Assert, ast.Raise)):
            return 'condition'
        if isinstance(parent, ast.Expr) and child is node:
            return 'statement'
        if isinstance(parent, ast.Call):
            return self._of_argument(parent, child, field, is_whole)
        if isinstance(parent, ast.keyword) and parent.arg in PLAIN_KEYWORDS and not self._is_field(parent):
            return 'option'
        if isinstance(parent, ast.BinOp) or (isinstance(parent, ast.AugAssign) and field == 'value'):
            rule = _of_operator(parent, field, child, is_whole and child is node)
            if rule:
                return rule
        if isinstance(parent, ast.UnaryOp) and isinstance(parent.op, ast.Invert):
            return 'bits'
        if self._states.steps.get(parent) == []:
            return 'step'
        if parent in self._states.starts and child is node:
            return 'state'
        return None

    def _of_argument(self, call: ast.Call, child: ast.AST, field: str, is_whole: bool) -> Optional[str]:
        if field == 'func':
            return None
        callee = dotted(call.func) or _last(call)
        first, last = callee.split('.')[0], callee.split('.')[-1]
        if callee in self._functions or (first == 'self' and last in self._functions):
            return self._of_parameters(call, child) if is_whole else None
        if self._reads_parameter(call):
            return 'default of a parameter'
        if first in PLAIN_MODULES and '.' in callee:
            return 'system'
        if last in PLAIN_CALLS or (last in PASSING_ON and field == 'keywords'):
            return 'count'
        if last in SHAPE_CALLS and field == 'args' and call.args.index(child) >= SHAPE_CALLS[last]:  # type: ignore
            return 'count'
        if last == 'format' and isinstance(call.func, ast.Attribute):
            return 'text'
        return None

    def _of_parameters(self, call: ast.Call, child: ast.AST) -> Optional[str]:
        """The rule for an argument of one of the program's own functions."""
        argument = child.value if isinstance(child, ast.keyword) else child
        for function in self._functions[_last(call)]:
            for name, value in bound_arguments(function, call):
                if value is argument and name in self._indices | self._counts:
                    return 'used as an index' if name in self._indices else 'used as a count'
        return None

    def _in_formula(self, parent: ast.BinOp, field: str, is_operand: bool, value: float) -> Optional[str]:
        other = parent.right if field == 'left' else parent.left
        if isinstance(parent.op, (ast.Div, ast.FloorDiv)) and field == 'right':
            return 'divisor'
        if is_operand and _last(other) in CLOCKS and isinstance(other, ast.Call):
            return 'clock'
        if isinstance(parent.op, (ast.Mult, ast.Div)) and is_operand:
            if abs(value) == 1:
                return 'sign'
            if abs(value) in UNITS:
                return 'unit'
            if _last(other) in TURNS or (isinstance(other, ast.BinOp) and _last(other.left) in TURNS):
                return 'turn' if type(value) is int or (value.is_integer() and abs(value) <= 4) else None
        is_shift = isinstance(parent.op, (ast.Add, ast.Sub)) and is_operand and type(value) is int
        is_near = is_shift and abs(value) < OFFSET
        return 'neighbour' if is_near and dotted(other) in self._counts | self._indices else None

    def _of_value(self, statement: ast.AST, node: ast.AST, is_all: bool, name: Optional[str], is_whole: bool) -> str:
        targets = _targets(statement, node)
        if is_all and isinstance(statement, ast.AugAssign):
            return 'term'
        if is_whole and (is_all or targets):
            if targets & (self._indices | self._counts):
                return 'used as an index' if targets & self._indices else 'used as a count'
            is_counting = bool(self._count_fields & {target.split('.')[-1].lower() for target in targets})
            if is_counting or targets & self._limits or dotted(getattr(statement, 'annotation', None)) == 'int':
                return 'counting name'
            owner = self._parents.get(id(statement), (None, ''))[0]
            if isinstance(owner, ast.ClassDef) and targets and all(target.isupper() for target in targets):
                return 'enumeration'
        return 'named' if is_all and name else 'value'


def _is_turn_about_one_axis(call: ast.Call) -> bool:
    angles = call.args[:3]
    computed = [angle for angle in angles if not isinstance(angle, ast.Constant) and not _is_constant(angle)]
    return _last(call.func) in TURN_CALLS and len(angles) == 3 and len(computed) == 1


def _is_strict(node: ast.AST) -> bool:
    """Return whether a definition needs plain numbers: an enumeration, or a function for another compiler."""
    if isinstance(node, ast.ClassDef):
        return any(_last(base) in ENUMERATIONS for base in node.bases)
    return isinstance(node, FUNCTIONS) and any(
        _last(decorator) in STRICT_DECORATORS for decorator in getattr(node, 'decorator_list', ())
    )


def _of_operator(parent: ast.AST, field: str, child: ast.AST, is_whole: bool) -> Optional[str]:
    """The rule of an operator that gives no number to move, or no number at all."""
    operator = parent.op  # type: ignore[attr-defined]
    left, right = (parent.left, parent.right) if isinstance(parent, ast.BinOp) else (None, parent.value)  # type: ignore
    if isinstance(operator, _BITS):
        return 'bits'
    if isinstance(operator, ast.Pow) and child is right:
        return 'exponent'
    if isinstance(operator, ast.Mod):
        if _is_text(left):
            return 'text'
        if child is right and is_whole:
            return 'modulus'
    if isinstance(operator, ast.Mult) and is_whole:
        other = left if child is right else right
        if _is_text(other) or isinstance(other, (ast.List, ast.Tuple, ast.ListComp)):
            return 'repetition'
    return None


def _is_constant(formula: Optional[ast.AST]) -> bool:
    """Return whether a formula is a constant written in parts, as `3 * math.pi / 2`: its literals are its value."""
    called = {id(node.func) for node in ast.walk(formula) if isinstance(node, ast.Call)} if formula else set()
    return formula is not None and all(
        isinstance(node, ast.Constant) or id(node) in called or _last(node) in TURNS
        for node in ast.walk(formula)
        if isinstance(node, (ast.Constant, ast.Attribute, ast.Subscript))
        or (isinstance(node, ast.Name) and node.id not in MODULES_OF_NUMBERS)
    )


def _is_text(node: Optional[ast.AST]) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, (str, bytes)))


def _last(node: ast.AST) -> str:
    """The last part of the name of a function or variable: `cos` of `math.cos`."""
    if isinstance(node, ast.Call):
        node = node.func
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, 'id', '')


def _targets(statement: ast.AST, node: ast.AST) -> Set[str]:
    nodes: List[ast.AST] = []
    if isinstance(statement, ast.Assign):
        nodes = list(statement.targets)
        if node is not statement.value:  # `index, mode = 0, 'go'`
            pairs = [zip(getattr(one, 'elts', ()), getattr(statement.value, 'elts', ())) for one in nodes]
            nodes = [target for pair in pairs for target, value in pair if value is node]
    elif isinstance(statement, (ast.AnnAssign, ast.AugAssign)):
        nodes = [statement.target]
    return {target for target in map(dotted, nodes) if target}


def _assigned(statement: ast.AST) -> Optional[str]:
    targets = getattr(statement, 'targets', None) or [getattr(statement, 'target', None)]
    targets = [part for target in targets for part in getattr(target, 'elts', [target])]
    return None if isinstance(statement, ast.AugAssign) else next(filter(None, map(dotted, targets)), None)


def _uses(tree: ast.AST, functions: Dict[str, List[ast.AST]]) -> Tuple[Set[str], Set[str]]:
    """The names that are used as counts, and those that are used as indices, also by way of other names."""
    counts: Set[str] = set()
    indices: Set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript):
            indices |= set(filter(None, map(dotted, _operands(node.slice))))
        elif isinstance(node, ast.Call):
            last = _last(node.func)
            if last in ('range', 'xrange') or last in SHAPE_CALLS or last in ('Rate', 'randint'):
                counts |= {name for argument in node.args for name in map(dotted, _operands(argument)) if name}
        elif isinstance(node, ast.For) and _last(node.iter) in ('range', 'xrange', 'enumerate'):
            target = node.target.elts[0] if isinstance(node.target, ast.Tuple) and node.target.elts else node.target
            counts |= {name for name in [dotted(target)] if name}
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
            for one, other in ((node.left, node.right), (node.right, node.left)):
                if _is_text(one) or isinstance(one, (ast.List, ast.Tuple)):
                    counts |= {name for name in [dotted(other)] if name}
    handed_on = list(_handed_on(tree, functions))
    for names in (counts, indices):
        before = -1
        while before < len(names):  # until no name is added
            before = len(names)
            for given, made_of in handed_on:
                if given in names:
                    names |= made_of
    return counts, indices


def _limits_of_counters(tree: ast.AST) -> Set[str]:
    """The names that are compared with a counter: with what is increased or decreased by whole numbers."""
    counters = {
        dotted(node.target)
        for node in ast.walk(tree)
        if isinstance(node, ast.AugAssign)
        and isinstance(node.op, (ast.Add, ast.Sub))
        and type(getattr(node.value, 'value', None)) is int
    }
    comparisons = [[node.left, *node.comparators] for node in ast.walk(tree) if isinstance(node, ast.Compare)]
    compared = [{name for name in map(dotted, sides) if name} for sides in comparisons]
    return {name for names in compared if names & counters for name in names - counters}


def _handed_on(tree: ast.AST, functions: Dict[str, List[ast.AST]]) -> Iterator[Tuple[str, Set[str]]]:
    """(a name that gets a value, the names that the value is made of), of all assignments and calls."""
    for node in ast.walk(tree):
        given: List[Tuple[str, ast.AST]] = []
        if isinstance(node, (ast.Assign, ast.AnnAssign, ast.AugAssign)) and node.value is not None:
            given = [(target, node.value) for target in _targets(node, node.value)]
        elif isinstance(node, ast.Call):
            given = [pair for function in functions.get(_last(node), ()) for pair in bound_arguments(function, node)]
        for name, value in given:
            yield name, set(filter(None, map(dotted, _operands(value))))


def _operands(node: ast.AST) -> Iterator[ast.AST]:
    """The names in an index or a count: `i` and `n` in `(i + 1) % n` and `min(i, n)`, but not in other calls."""
    waiting = [node]
    while waiting:
        part = waiting.pop()
        if isinstance(part, (ast.Name, ast.Attribute)):
            yield part
        elif isinstance(part, ast.Call) and _last(part) in ('min', 'max', 'abs'):
            waiting.extend(part.args)
        elif isinstance(part, (ast.BinOp, ast.IfExp, ast.UnaryOp, ast.Slice, ast.Tuple)) or (
            hasattr(ast, 'Index') and isinstance(part, ast.Index)
        ):
            waiting.extend(ast.iter_child_nodes(part))
