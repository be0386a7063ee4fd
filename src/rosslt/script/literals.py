"""The number literals of a script: where they stand in its text, how one is rewritten, and which is which after
somebody has edited the text.

A script is text in Python syntax. Everything here is about its text alone; nothing is run.
"""

import ast
from decimal import Decimal
from typing import Dict, Iterator, List, NamedTuple, Tuple

from rosslt.files import LITERALS, Number, as_they_read, in_manner_of, numbers_in, respelled, without_numbers
from rosslt.script.errors import ScriptError

__all__ = ['LITERALS', 'Parsed', 'difference', 'followed', 'parse', 'rewritten', 'rounded']


class Parsed(NamedTuple):
    """A script that was taken apart."""

    text: str
    tree: ast.Module
    """Its syntax tree with all literals taken out."""
    literals: List[Number]
    """In the order of the text."""
    skeleton: str
    """The program without its numbers, comments and layout."""


TEXT_LIMIT = 1000000
"""The most characters of a script."""

NUMBER_LIMIT = 10000
"""The most numbers in it: each has a location."""

BYTE_ORDER_MARK = '\ufeff'


def parse(text: str, file: str) -> Parsed:
    """Take a script apart.

    Args:
        text: with its newlines as they are in the file.
        file: its path, for errors.

    Raises:
        ScriptError: the text is not in Python syntax, or too long.
    """
    if len(text) > TEXT_LIMIT:
        raise ScriptError(file, 1, 1, 'it has {} characters, the limit is {}'.format(len(text), TEXT_LIMIT))
    # Some editors begin a file with a byte order mark, which is not in the syntax.
    skipped = len(BYTE_ORDER_MARK) if text.startswith(BYTE_ORDER_MARK) else 0
    source = text[skipped:]
    try:
        tree = ast.parse(source, file)
        found = [
            (Number(place.start + skipped, place.end + skipped, *place[2:]), node)
            for place, node in numbers_in(tree, source)
        ]
        if len(found) > NUMBER_LIMIT:
            beyond = found[NUMBER_LIMIT][0]
            raise ScriptError(
                file, beyond.line, beyond.column, 'it has {} numbers, the limit is {}'.format(len(found), NUMBER_LIMIT)
            )
        tree = without_numbers(tree, [node for _, node in found])
        skeleton = ast.dump(tree)
    except SyntaxError as error:
        raise ScriptError(file, error.lineno or 1, error.offset or 1, error.msg) from None
    except (RecursionError, MemoryError):
        raise ScriptError(file, 1, 1, 'it is nested too deeply') from None
    except ValueError as error:  # Python before 3.12 says so of a null byte
        raise ScriptError(file, 1, 1, str(error)) from None
    return Parsed(text, tree, [place for place, _ in found], skeleton)


def rewritten(parsed: Parsed, index: int, value: float, precision: float, file: str) -> Parsed:
    """The text of a script with another value for one of its literals, and every other character as it is.

    Args:
        parsed: the script.
        index: which of its literals.
        value: a finite number.
        precision: the step that the value is rounded to.
        file: its path, for errors.

    Returns:
        The new script, parsed.

    Raises:
        ScriptError: the literal stands where no other number can.
    """
    literal, wanted = parsed.literals[index], rounded(value, precision)
    if wanted == literal.value:
        return parsed
    if isinstance(literal.value, int) and wanted.is_integer():
        wanted = int(wanted)
    expected = [one.value for one in parsed.literals]
    expected[index] = wanted
    made = parsed

    def reads(spelled: Dict[int, str]) -> bool:
        nonlocal made
        try:
            made = parse(respelled(parsed.text, parsed.literals, spelled), file)
        except ScriptError:
            return False
        return made.skeleton == parsed.skeleton and [one.value for one in made.literals] == expected

    as_they_read(file, parsed.literals, {index: in_manner_of(parsed.text[literal.start : literal.end], wanted)}, reads)
    return made


def rounded(value: float, precision: float) -> float:
    """The multiple of a precision that is nearest to a number."""
    if abs(value) > precision * 2**53:  # there are no digits to round
        return float(value)
    return float(round(value / precision) * Decimal(repr(precision)))


def followed(old: Parsed, new: Parsed, in_whole_lines: bool = True) -> Dict[int, int]:
    """Follow the literals of a text that somebody has edited.

    A literal is followed where that is certain: it stands in the part before, or in the part after the one that
    has changed, and could not as well be another one in a line that reads the same.

    Args:
        old, new: the scripts before and after, parsed.
        in_whole_lines: follow none in a line that has changed in part.

    Returns:
        {index of a literal in the old text: its index in the new one}.
    """
    before, after = _common_ends(old.text, new.text)
    upto, onwards = _whole_lines(old.text, new.text, before, after) if in_whole_lines else (before, after)
    shift = len(new.text) - len(old.text)
    places = {(literal.start, literal.end): index for index, literal in enumerate(new.literals)}
    found = {}
    for index, (start, end, *_) in enumerate(old.literals):
        candidates = set()
        if end <= before:
            candidates.add((start, end))
        if start >= after:
            candidates.add((start + shift, end + shift))
        if len(candidates) == 1 and candidates <= places.keys() and (end <= upto or start >= onwards):
            found[index] = places[candidates.pop()]
    return found


def difference(old: str, new: str) -> int:
    """Measure the stretch that two texts have not in common, in characters."""
    before, after = _common_ends(old, new)
    return max(len(old), len(new)) - min(before + len(old) - after, len(old), len(new))


def _common_ends(old: str, new: str) -> Tuple[int, int]:
    """Return the end of the common start, and the start of the common end, in the old text; these may overlap."""

    def common(pairs: Iterator[Tuple[str, str]]) -> int:
        return next((count for count, (a, b) in enumerate(pairs) if a != b), min(len(old), len(new)))

    return common(zip(old, new)), len(old) - common(zip(reversed(old), reversed(new)))


def _whole_lines(old: str, new: str, before: int, after: int) -> Tuple[int, int]:
    """`_common_ends`, without lines that are equal in part."""
    if old != new:
        before = old.rfind('\n', 0, before) + 1
    if not (_begins_line(old, after) and _begins_line(new, after + len(new) - len(old))):
        after = old.find('\n', after) + 1 or len(old)
    return before, after


def _begins_line(text: str, index: int) -> bool:
    return index == 0 or text[index - 1] == '\n'
