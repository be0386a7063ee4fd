"""Find the code of a program that runs once, by its text; the names of its module that are read there alone; and
whether each of those readings is over.

    START_X = -1.0                            class Robot:
    robot = Robot()                               def __init__(self):
    while not rospy.is_shutdown():                    self.x = START_X
        robot.step()

The module holds the number of `START_X` for as long as the node runs, but nobody looks at it there again.
"""

import ast
import builtins
import itertools
import re
import sys
import threading
import types
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Set, Tuple

from rosslt import node
from rosslt.instrument.lifetimes import FUNCTIONS
from rosslt.instrument.states import dotted

#: A function by its name and its line, as its code object has them.
Code = Tuple[str, int]
MODULE: Code = ('<module>', 0)

#: By these, code gets at a module that it does not name.
_MODULES = {
    *('__main__', '__import__', 'import_module', 'modules', 'getmodule', '__globals__', 'f_globals', 'f_locals'),
    *('builtins', '__builtins__'),
}
#: By these, it gets at variables, functions and classes that it does not name.
_INDIRECT = {*_MODULES, 'globals', 'locals', 'vars', 'eval', 'exec', 'type', 'cls', '__class__', '__subclasses__'}

_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
_SUSPENDING = (ast.Yield, ast.YieldFrom, ast.Await)


class Place(NamedTuple):
    """A statement that runs once, or the head of one.

    Attributes:
        code: the function that it is in, or the module.
        first, last: its lines.
        then: if it makes an object: the method of that which it calls next, as `run` in `Robot().run()`; or ''.
    """

    code: Code
    first: int
    last: int
    then: str = ''


#: A way to a reading: the places of the calls that lead there, from the module inward, and its own.
Way = Tuple[Place, ...]


def code_run_once(tree: ast.Module) -> Tuple[Dict[int, Place], Dict[Code, List[Way]]]:
    """({id of a node: its place}, {function: the ways to it}) of what runs once, or once for each of several calls.

    That is the module itself, and the functions of which each mention is a call in such code. There are no ways to what
    others may run again, as a method of an object that they are given, or to what is called twice in one statement.
    """
    places = dict(_places(tree.body, MODULE))
    nodes = list(ast.walk(tree))
    bases = {dotted(base) or '' for one in nodes if isinstance(one, ast.ClassDef) for base in one.bases}
    if not _INDIRECT.isdisjoint(_mentioned(tree)) or any(_initializes_again(one, bases) for one in nodes):
        return places, {}
    mentions: Dict[str, List[ast.AST]] = {}
    for one in nodes:
        name = getattr(one, 'id', getattr(one, 'attr', getattr(one, 'value', None)))
        if isinstance(one, (ast.Name, ast.Attribute, ast.Constant)) and isinstance(name, str):
            mentions.setdefault(name, []).append(one)
    several = {id(part) for one in nodes if isinstance(one, _COMPREHENSIONS) for part in ast.walk(one)}
    called = {id(one.func) for one in nodes if isinstance(one, ast.Call)} - several
    next_methods = dict(_next_methods(tree))
    ways: Dict[Code, List[Way]] = {MODULE: [()]}
    waiting = _functions(tree)
    while True:
        once = called & places.keys()
        begun = [name for name in waiting if name in mentions and {id(one) for one in mentions[name]} <= once]
        if not begun:
            return places, ways
        for name in begun:
            calls = [places[id(one)]._replace(then=next_methods.get(id(one), '')) for one in mentions[name]]
            is_apart = not any(_overlap(one, other) for one, other in itertools.combinations(calls, 2))
            for function, is_method in waiting.pop(name):
                code = _code_of(function)
                if isinstance(function, ast.FunctionDef):
                    places.update(_places(function.body, code))
                # nothing of a dataclass runs that could be in the middle of one of several calls
                is_told_apart = is_apart or isinstance(function, ast.ClassDef)
                if is_told_apart and not is_method and all(call.code in ways for call in calls):
                    ways[code] = [(*way, call) for call in calls for way in ways[call.code]]


def key_of(code: Code) -> str:
    """A function in the ways that `names_of_set_up` finds: `main:12`, which no name is."""
    return f'{code[0]}:{code[1]}'


def key_of_elements(name: str) -> str:
    """The elements of the dict or list of a name, in the ways that `names_of_set_up` finds: `HOME[]`."""
    return f'{name}[]'


def names_of_set_up(tree: ast.Module) -> Dict[str, List[Way]]:
    """{name of the module: the ways to all readings of it}, of the names that are read in code alone that runs once;
    {`key_of_elements` of such a name: the same}, if nothing else gets at its dict or list; and {`key_of` a function:
    the ways to it}, of that code."""
    places, ways = code_run_once(tree)
    bound = {
        one.id
        for one in ast.walk(tree)
        if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store) and id(one) in places
    }
    unknown = {word for one in _texts(tree) for word in re.findall(r'\w+', one)}
    unknown.update(one.attr for one in ast.walk(tree) if isinstance(one, ast.Attribute))
    found: Dict[str, List[Way]] = {}
    for one in _readings(tree):
        place = places.get(id(one))
        if place is None or place.code not in ways:
            unknown.add(one.id)
        else:
            found.setdefault(one.id, []).extend((*way, place) for way in ways[place.code])
    names = {name: found[name] for name in bound.intersection(found) - unknown}
    elements = {key_of_elements(name): names[name] for name in _names_of_containers(tree).intersection(names)}
    return {**names, **elements, **{key_of(code): list(to_it) for code, to_it in ways.items()}}


def _names_of_containers(tree: ast.Module) -> Set[str]:
    """The names that always are a dict or list of their own, from which no reading takes more than the elements:
    `HOME['x']`, `x, y = HOME`, `*HOME` and `**HOME`."""
    nodes = list(ast.walk(tree))
    # what names something otherwise than by a store: an import, a function or class, `except`, `match`
    others = {name for one in nodes for name in map(vars(one).get, ('name', 'asname', 'rest')) if isinstance(name, str)}
    stored = [one for one in nodes if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)]
    if '*' in others or 'dict' in {*others, *(one.id for one in stored)}:
        return set()
    made: Set[int] = set()
    taken: Set[int] = set()
    for one in nodes:
        value: Any = getattr(one, 'value', None)
        targets = getattr(one, 'targets', [getattr(one, 'target', None)])
        if isinstance(one, (ast.Assign, ast.AnnAssign)) and len(targets) == 1 and _is_container(value):
            made.update(id(target) for target in targets)
        is_unpacked = isinstance(one, ast.Assign) and all(isinstance(part, (ast.Tuple, ast.List)) for part in targets)
        if is_unpacked or isinstance(one, (ast.Subscript, ast.Starred)) or getattr(one, 'arg', '') is None:
            taken.add(id(value))
    others.update(one.id for one in _readings(tree) if id(one) not in taken)
    others.update(one.id for one in stored if id(one) not in made)
    return {one.id for one in stored} - others


def _is_container(value: Optional[ast.expr]) -> bool:
    """Return whether an expression makes a dict or list that nobody else has: `{'x': 1.0}`, `dict(x=1.0)`, `[1.0]`."""
    return isinstance(value, (ast.Dict, ast.List)) or (isinstance(value, ast.Call) and dotted(value.func) == 'dict')


def _readings(tree: ast.AST) -> Iterator[ast.Name]:
    for one in ast.walk(tree):
        if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Load):
            yield one
        elif isinstance(one, ast.AugAssign) and isinstance(one.target, ast.Name):
            yield one.target


def reaches_other_modules(tree: ast.AST) -> bool:
    """Return whether a module gets at others that it does not name, as at the program."""
    return not _MODULES.isdisjoint(_mentioned(tree))


def _mentioned(tree: ast.AST) -> Iterator[str]:
    for one in ast.walk(tree):
        if isinstance(one, ast.Name):
            yield one.id
        elif isinstance(one, ast.Attribute) and one.attr not in vars(builtins):
            yield one.attr
        elif isinstance(one, (ast.alias, ast.ImportFrom)):
            yield from (getattr(one, 'name', None) or getattr(one, 'module', None) or '').split('.')


def _initializes_again(one: ast.AST, bases: Set[str]) -> bool:
    """Return whether an expression may call the `__init__` of an object that there is: `self.__init__()`."""
    return (
        isinstance(one, ast.Attribute)
        and one.attr == '__init__'
        and dotted(one.value) not in bases
        and not (isinstance(one.value, ast.Call) and getattr(one.value.func, 'id', '') == 'super')
    )


def _texts(tree: ast.AST) -> Iterator[str]:
    """The texts of a program, without those that stand alone, as docstrings."""
    alone = {id(one.value) for one in ast.walk(tree) if isinstance(one, ast.Expr)}
    for one in ast.walk(tree):
        if isinstance(one, ast.Constant) and isinstance(one.value, str) and id(one) not in alone:
            yield one.value


def _places(body: List[ast.stmt], code: Code) -> Iterator[Tuple[int, Place]]:
    """(id of a node, its place) of what runs once if the statements of a function run once."""
    again = {id(part) for one in body for inner in ast.walk(one) for part in _repeated(inner)}
    waiting: List[Tuple[ast.AST, Place]] = [(one, Place(code, 0, 0)) for one in body]
    while waiting:
        one, place = waiting.pop()
        inner: Any = getattr(one, 'body', None)
        if isinstance(inner, list):  # what stands in its head is over after the first line in it
            first = min(part.lineno for part in [one, *getattr(one, 'decorator_list', ()), inner[0]] if _has_line(part))
            place = Place(code, first, inner[0].lineno)
        elif isinstance(one, ast.stmt):
            place = Place(code, one.lineno, one.end_lineno or one.lineno)
        yield id(one), place
        waiting += [(part, place) for part in ast.iter_child_nodes(one) if id(part) not in again]


def _has_line(one: ast.AST) -> bool:
    return hasattr(one, 'lineno')


def _repeated(one: ast.AST) -> Iterator[ast.AST]:
    """The parts of a node that do not run as often as it does itself."""
    if isinstance(one, ast.Lambda):
        yield one.body
    elif isinstance(one, ast.While):
        yield one.test
        yield from one.body
    elif isinstance(one, (*FUNCTIONS[:2], ast.For)):
        yield from one.body
    elif isinstance(one, ast.GeneratorExp):
        yield one.elt
        yield from one.generators[0].ifs
        yield from one.generators[1:]


def _functions(tree: ast.Module) -> Dict[str, List[Tuple[Any, bool]]]:
    """{name: (a function, or the `__init__` of a class; whether it is another method) of what is called by it alone}.

    A base class, a metaclass or a decorator may call it, too; a generator runs later than it is called.
    """
    owners = {id(part): one for one in ast.walk(tree) if isinstance(one, ast.ClassDef) for part in one.body}
    found: Dict[str, List[Tuple[Any, bool]]] = {}
    for one in ast.walk(tree):
        owner: Any = owners.get(id(one))
        name = owner.name if owner and getattr(one, 'name', '') == '__init__' else getattr(one, 'name', '')
        if (
            isinstance(one, ast.FunctionDef)
            and not (one.decorator_list or name[:2] == name[-2:] == '__')
            and not (owner and (owner.decorator_list or owner.keywords or {*map(dotted, owner.bases)} - {'object'}))
            and not any(isinstance(part, _SUSPENDING) for part in ast.walk(one))
        ):
            found.setdefault(name, []).append((one, bool(owner) and name == one.name))
        elif _is_dataclass(one):
            found.setdefault(name, []).append((one, False))
    return found


def _is_dataclass(one: ast.AST) -> bool:
    """Return whether a dataclass is defined that inherits nothing: its `__init__` has the defaults of its body."""
    if not isinstance(one, ast.ClassDef) or one.bases or one.keywords:
        return False
    decorators = [dotted(getattr(part, 'func', part)) for part in one.decorator_list]
    is_made = bool(decorators) and {*decorators} <= {'dataclass', 'dataclasses.dataclass'}
    return is_made and not any(getattr(part, 'name', '') in _MADE_ANEW for part in one.body)


_MADE_ANEW = {'__init__', '__post_init__', '__new__'}
"""Methods by which the objects of a dataclass are made in another way."""


def _code_of(function: Any) -> Code:
    """A function, or the `__init__` of a dataclass, as it is found by the class."""
    return (f'class {function.name}', 0) if isinstance(function, ast.ClassDef) else (function.name, function.lineno)


def _overlap(one: Place, other: Place) -> bool:
    return one.code == other.code and one.first <= other.last and other.first <= one.last


def _next_methods(tree: ast.AST) -> Iterator[Tuple[int, str]]:
    """(id of the name of a class, the method that the same statement calls next), as in `Robot(RATE).run()`."""
    for one in ast.walk(tree):
        method: Any = getattr(getattr(one, 'value', None), 'func', None) if isinstance(one, ast.Expr) else None
        made = getattr(method, 'value', None)
        if isinstance(made, ast.Call):
            given = [*made.args, *(keyword.value for keyword in made.keywords)]
            if all(isinstance(part, (ast.Name, ast.Constant)) for part in given):
                yield id(made.func), method.attr


class SetUp:
    """The names of the program that are read in its set-up alone."""

    def __init__(self) -> None:
        self._names: Optional[Dict[str, Any]] = None
        self._ways: Dict[str, List[Way]] = {}

    def begin(self, names: Dict[str, Any], ways: Dict[str, List[Way]]) -> None:
        """The program begins.

        Args:
            names: of its module.
            ways: as `names_of_set_up` finds them.
        """
        self._names, self._ways = names, ways
        node.MEMORY.is_over = self._is_over

    def forget(self) -> None:
        """Forget all names: another module may read any of them."""
        self._ways = {}

    def is_to_come(self, code: str, first: int, last: int) -> bool:
        """Return whether lines of a function of the program, that `key_of` gives, may run yet."""
        if code not in self._ways:  # they were forgotten
            return code != key_of(MODULE)
        name, _, line = code.rpartition(':')
        place, running = Place((name, int(line)), first, last), self._running()
        return any(_is_ahead((*way, place), running) for way in self._ways[code])

    def _is_over(self, owner: Any, key: object) -> bool:
        if type(owner) is types.FunctionType and key == '__defaults__' and owner.__globals__ is self._names:
            code, made_for = owner.__code__, owner.__qualname__.rpartition('.')[0]
            is_made = code.co_filename == '<string>'  # by `dataclass`
            key = key_of((f'class {made_for}', 0) if is_made else (code.co_name, code.co_firstlineno))
        elif type(owner) is type and self._names and self._names.get(owner.__name__) is owner:
            key = key_of((f'class {owner.__name__}', 0))
        elif type(owner) in (dict, list) and owner is not self._names:
            names = self._names or {}
            key = next((key for key in self._ways if key[-2:] == '[]' and names.get(key[:-2]) is owner), '')
        elif owner is not self._names:
            return False
        if key not in self._ways:
            return False
        running = self._running()
        return not any(_is_ahead(way, running) for way in self._ways[str(key)])

    def _running(self) -> List[Tuple[Code, Optional[int]]]:
        """The functions of the program that the main thread is in, from the module inward, each with its line."""
        found: List[Tuple[Code, Optional[int]]] = []
        frame: Optional[types.FrameType] = sys._current_frames().get(threading.main_thread().ident or 0)
        while frame is not None:
            if frame.f_globals is self._names:
                code = frame.f_code
                is_module = code.co_name == MODULE[0]
                found.append((MODULE if is_module else (code.co_name, code.co_firstlineno), frame.f_lineno))
            frame = frame.f_back
        return found[::-1]


def _is_ahead(way: Way, running: List[Tuple[Code, Optional[int]]]) -> bool:
    """Return whether a reading may come yet: true unless it is known to be over."""
    codes = [code for code, _ in running]
    entered, called_next = '', ''
    for place in way:
        if place.code not in codes:
            # What was made before in the same statement was made if the statement has come to its method.
            return not called_next or entered != called_next
        at = codes.index(place.code)
        line = running[at][1]
        if line is None or line < place.first:
            return True
        if line > place.last:
            return False
        entered, called_next = ''.join(name for name, _ in codes[at + 1 : at + 2]), place.then
    return True


SET_UP = SetUp()
"""Those of this process."""
