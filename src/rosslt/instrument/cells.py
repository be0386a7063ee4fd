"""The present values of a file's number literals, which its rewritten code reads, and the locations behind them.

A cell holds a tracked number from the start, long before there is a node. What it comes from is looked up when somebody
wants to know it for the first time: when it is in a message that is sent. Only then its location is made known, so that
literals that reach nothing cost nothing; one that an earlier run has changed is known from the start.
"""

import functools
import linecache
import os
import re
import threading
from typing import Any, Callable, Collection, Dict, Iterable, List, Optional, Set, Tuple

import rospy

from rosslt import files, node, values
from rosslt.instrument.literals import Literal
from rosslt.instrument.location_rules import NUMBER, WHOLE
from rosslt.instrument.set_up_names import SET_UP

_files: Dict[str, 'Cells'] = {}
_by_source: Dict[values.Source, 'CellLocation'] = {}
#: Each class of tracked values that is made of a class of plain ones. A tracked bool is an int, as in its class.
_PLAIN_CLASSES: Dict[Any, Any] = {kind: kind.__base__ for kind in values.TRACKED_CLASSES}
_undecided: List['CellLocation'] = []
_kept: Set['CellLocation'] = set()
_lock = threading.RLock()


def plain_object(value: Any) -> Any:
    """Return the object that `is` compares.

    This is the plain number or text of a tracked one, the plain class for the class of tracked numbers
    (`x.__class__ is float`), and any other object itself.
    """
    try:
        if type(value) not in values.TRACKED_CLASSES:
            return _PLAIN_CLASSES.get(value, value) if isinstance(value, type) else value
    except TypeError:  # a class of which the metaclass has no hash, or an object of it
        return value
    plain = value._plain
    if type(plain) not in (float, int):
        return plain
    # The compiled core makes a float anew whenever it is asked for one.
    return _one_object(plain, str(plain)) if plain == plain else value


def is_same(one: Any, other: object) -> bool:
    """Evaluate `one is other` for operands that are not literals.

    Two tracked numbers are two objects as plain ones are. Python has but one object of each truth value, text that is
    written in a file, and small int.
    """
    try:
        if type(one) in values.TRACKED_CLASSES and type(other) in values.TRACKED_CLASSES:
            plain = one._plain
            if type(plain) is float or (type(plain) is int and not -5 <= plain <= 256):
                return one is other
        return plain_object(one) is plain_object(other)
    except TypeError:  # as above
        return one is other


@functools.lru_cache(maxsize=4096)
def _one_object(number: object, _: str) -> Any:
    """Return one object for equal numbers; the text distinguishes 0.0 from -0.0 and from 0."""
    return number


#: A number in a list with an expression of at least this size is taken for a state that is carried on.
LONG = 256

#: The most numbers of a list that is looked through for those.
MOST_IN_STATE = 256


@values.stripper
def plain(value: Any) -> Any:
    """A value without its provenance, to carry a state on.

    Elements that were put into a list keep their provenance. Elements computed from earlier ones, such as the
    covariance of a filter, have expressions that grow from step to step; they lose their provenance once it is long.
    """
    kind = type(value)
    strip = _stripped_by.get(kind)
    if strip is not None:
        return strip(value)
    if kind in values.TRACKED_CLASSES:
        return value._plain
    if kind is tuple:
        return tuple([plain(part) for part in value])
    if kind is list:
        _cut_long(value)
    return value


def plain_parts(parts: Any, *others: int) -> Any:
    """Return the parts that a statement unpacks to several targets; those for states are made `plain`.

    Args:
        others: the indices of the targets that are no states.
    """
    if type(parts) is not tuple:
        return plain(parts)
    return tuple([part if index in others else plain(part) for index, part in enumerate(parts)])


def _cut_long(numbers: List[Any], depth: int = 2) -> None:
    if len(numbers) > MOST_IN_STATE:
        return
    for place, one in enumerate(numbers):
        if type(one) in values.TRACKED_CLASSES:
            if one._size > LONG:
                numbers[place] = plain(one)
        elif type(one) is list and depth:
            _cut_long(one, depth - 1)


_stripped_by: Dict[type, Callable[[Any], Any]] = {}


def strip_by(kind: type, strip: Callable[[Any], Any]) -> None:
    """Have `plain` take the provenance from values of another class.

    Args:
        kind: the class.
        strip: gives a value of it without provenance.
    """
    _stripped_by[kind] = strip


def cells_of(path: str, literals: List[Literal], digest: str, is_program: bool = False) -> 'Cells':
    """The cells of a file: the same ones, however often the file is loaded.

    Args:
        path: the real path of the file.
        literals: its literals, in the order of their cells.
        digest: the hash of the content that was read.
        is_program: whether the file runs as the program, so that no other module calls what is in it.
    """
    with _lock:
        known = _files.get(path)
        if known is None:
            known = _files[path] = Cells(path, literals, digest, is_program=is_program)
        # A file that was edited and is loaded again is plain: the locations are those of the first loading.
        return known if known.digest == digest else Cells(path, literals, digest, is_plain=True)


def loaded_files() -> List['Cells']:
    """The cells of all files that run rewritten in this process."""
    with _lock:
        return list(_files.values())


class Cells(list):
    """The numbers of a file, each in its cell.

    Args:
        path, literals, digest, is_program: as in `cells_of`.
        is_plain: whether the numbers are not locations.

    Attributes:
        path, literals, digest, is_program: the same.
        locations: {number of the cell: its CellLocation}, of those that are known.
        steps: the plain numbers in cells, to carry states on.
    """

    def __init__(
        self, path: str, literals: List[Literal], digest: str, is_plain: bool = False, is_program: bool = False
    ) -> None:
        super().__init__()
        self.path = path
        self.literals = literals
        self.digest = digest
        self.is_program = is_program
        self.locations: Dict[int, CellLocation] = {}
        self.steps = _Steps(self)
        self._is_plain = is_plain
        self._too_early = False
        self.extend(self._reading(number) for number in range(len(literals)))

    def renew(self) -> None:
        """Make the readings anew that were looked into before there was a node, once there is one."""
        with _lock:
            if self._too_early:
                self._too_early = False
                for number in range(len(self)):
                    if number not in self.locations:
                        self[number] = self._reading(number)

    def take_over(self) -> None:
        """Make those known that begin with what an earlier run has left, if there is a node.

        It is done before the code goes on: the first message has what was left.
        """
        for number, literal in enumerate(self.literals if node.is_started() else []):
            if node.has_kept(_names(literal), literal.identity):
                self.location(number)

    def make_known(self, verdicts: Collection[str] = (NUMBER, WHOLE)) -> None:
        """Make the locations of numbers known: those that a person would change, or those with other verdicts."""
        for number, literal in enumerate(self.literals):
            if literal.verdict in verdicts:
                self.location(number)

    def _reading(self, number: int) -> Any:
        if self._is_plain:
            return self.literals[number].value
        (reading,) = values.lazy([self.literals[number].value], [lambda value: self._origin(number, value)])
        return reading

    def _origin(self, number: int, value: object) -> Any:
        """Return the origin of the number in a cell, for `values.lazy`."""
        location = self.location(number)
        return () if location is None else location.origin(value)

    def location(self, number: int) -> 'Optional[CellLocation]':
        """The location of a cell, made known if it is not; None if there is no node."""
        found = self.locations.get(number)
        if self._is_plain or (found is not None and found.is_known):
            return found
        if not node.is_started():
            with _lock:
                if not node.is_initialized():
                    self._too_early = True
                    return None
            node.start()
        # Changing a value takes this lock and looks into readings: no lock of this module is held here.
        with node.CHANGE_LOCK:
            found = self.locations.get(number)
            if found is None:
                found = self.locations[number] = CellLocation(self, number)
                found.make_known()
                _by_source[found.source] = found
                found.is_known = True
            return found


def location_of(source: values.Source) -> 'Optional[CellLocation]':
    """The location of a literal of this node that is known by that source."""
    return _by_source.get(source)


def decide_shapes(leaves: Iterable[object]) -> None:
    """Stop tracking shape literals if another source suffices.

    Expressions then stay affine in the other sources, and cost a fraction. A leaf that has only shape literals keeps
    one of those that move it: the one of the lowest rank.

    Args:
        leaves: of a message.
    """
    with _lock:
        undecided, _undecided[:] = list(_undecided), []
        if not undecided:
            return
        alone = []
        for leaf in leaves:
            locations = [_by_source.get(source) for source in values.sources(leaf)]
            shapes = [location for location in locations if location is not None and location.is_shape]
            if shapes and len(shapes) == len(locations):
                slopes = values.slopes([leaf])
                alone.append([shape for shape in shapes if any(slopes.get(shape.source, ()))] or shapes)
        # Leaves with one shape have no choice; the shape that they keep may suffice for leaves with several.
        for shapes in sorted(alone, key=len):
            if _kept.isdisjoint(shapes):
                _kept.add(min(shapes, key=lambda shape: shape.rank))
        for shape in undecided:
            shape.decide(shape in _kept)


class _Steps(Dict[int, Any]):
    """The plain numbers in cells that carry a state on, by the numbers of the cells. One that is read is known by name
    from then on, if there is a node.

    Args:
        cells: of the file.
    """

    def __init__(self, cells: Cells) -> None:
        super().__init__()
        self._cells = cells

    def __missing__(self, number: int) -> Any:
        if node.is_started():
            self._cells.location(number)
            self[number] = plain(self._cells[number])
        return plain(self._cells[number])


class CellLocation(node.LiteralLocation):
    """The location of a literal in the code of a node that was not written for this.

    Attributes:
        cells, number: where its value is read.
        is_shape: whether it gives a formula its shape.
        keeps: whether it is read with its provenance; None while it is not decided yet.
        rank, row: as those of a Location.
        is_known: whether it has been made known.
    """

    __slots__ = ('_lines', '_once_in', 'cells', 'is_known', 'is_shape', 'keeps', 'number', 'rank', 'row')

    def __init__(self, cells: Cells, number: int) -> None:
        literal = cells.literals[number]
        self.cells, self.number, self.rank = cells, number, literal.rank
        self.row = literal.row and f'{literal.file}:{literal.row}'
        self.is_known = False
        self.is_shape = literal.is_shape
        self.keeps: Optional[bool] = None if self.is_shape else True
        site = node.CallSite(literal.file, literal.line, literal.column, linecache.getline(literal.file, literal.line))
        super().__init__(
            literal.identity,
            _names(literal)[0],
            site,
            literal.value,
            minimum=literal.minimum,
            maximum=literal.maximum,
            is_named=literal.name is not None,
        )
        self._once_in = literal.once_in if cells.is_program else ''
        self._lines = literal.line, literal.end_line
        self.is_polled = not (literal.is_read_once or (literal.is_set_up and cells.is_program) or self._once_in)
        if literal.verdict == NUMBER or literal.rule == 'no turn':
            self._retype(float)

    def is_read_again(self) -> bool:
        return super().is_read_again() or (bool(self._once_in) and SET_UP.is_to_come(self._once_in, *self._lines))

    def make_known(self) -> None:
        """Have it listed and changed; if its name is taken, it gets a different one."""
        for name in _names(self.cells.literals[self.number]):
            self.name = name
            try:
                node.add_literal(self)
                return
            except ValueError as error:
                reason = error
        rospy.logwarn_once('%s', reason)

    def put(self, value: Any) -> None:
        if self.tracked is None:
            self._value, self.tracked = value, self.cells[self.number]
            return
        super().put(self.type(value))
        self.cells[self.number] = plain(self.tracked) if self.keeps is False else self.tracked
        if self.number in self.cells.steps:
            self.cells.steps[self.number] = plain(self.tracked)

    def reading_of(self, value: object) -> Any:
        # The code reads the number as it says it: an int if the location takes fractions, too, and this is none.
        is_whole = type(self.literal) is int and type(value) is float and value.is_integer()
        (reading,) = values.lazy([int(value) if is_whole else value], [self.origin])  # type: ignore[call-overload]
        return reading

    def origin(self, value: object) -> Any:
        """Return the origin of the number that the code reads, for `values.lazy`."""
        if self.keeps is None:
            _undecided.append(self)
        source = values.track(self.type(value), self.source)
        # An int that may become a float: its provenance must hold for floats.
        return source if self.type is type(value) else values.widened(source)

    def decide(self, keeps: bool) -> None:
        """Be read with its provenance from now on, or without it."""
        self.keeps = keeps
        if not keeps:
            self.cells[self.number] = plain(self.tracked)

    def find_in(self, source: files.SourceText) -> Optional[int]:
        literal = self.cells.literals[self.number]
        return source.number_at(literal.line, literal.column)

    def keep_whole(self) -> None:
        """Take whole numbers only from now on: it reaches a field that takes no other."""
        if type(self.literal) is int and self.value == int(self.value):
            self._retype(int)

    def _retype(self, kind: type) -> None:
        self.type, self._value = kind, kind(self._value)


def _names(literal: Literal) -> List[str]:
    """Return the names that a literal may get, each if those before are taken."""
    name = '_'.join(_words(literal))
    return [name, f'{name}_{literal.line}_{literal.column}', f'{name}_{node.location_id(literal.identity)}']


def _words(literal: Literal) -> Tuple[str, ...]:
    """Return the words of a literal's name, else its file, line and column."""
    stem = re.sub(r'\W', '_', os.path.splitext(os.path.basename(literal.file))[0], flags=re.ASCII)
    if literal.name:
        words = [word for word in re.split(r'\W', literal.name, flags=re.ASCII) if word and word != 'self']
        words[:1] = [word.lstrip('_') for word in words[:1]]
        if words and words[0][:1].isalpha():
            return tuple(words)
    return (stem if stem[:1].isalpha() else 'l_' + stem, str(literal.line), str(literal.column))
