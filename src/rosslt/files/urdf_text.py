"""The numbers of a URDF as text: where each stands, and another one in its place, with every other byte as it is."""

import math
import re
from collections import Counter
from typing import Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple
from xml.parsers import expat

from rosslt.files.errors import FileError
from rosslt.files.notation import Scalar, check_replaceable, equal, notations
from rosslt.files.python_source import Edit, Standing, digest_of

#: A number that C++ and Python read alike.
_NUMBER = re.compile(r'[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?', re.ASCII | re.IGNORECASE)

_WORD = re.compile(rb'[^ \t\r\n]+')
_ATTRIBUTE = re.compile(rb'[ \t\r\n]+([^ \t\r\n=<>/"\']+)[ \t\r\n]*=[ \t\r\n]*("[^"<]*"|\'[^\'<]*\')')

#: {attribute: how many numbers it has, 0 for one that is no list}.
_ORIGIN = {'xyz': 3, 'rpy': 3}
_RGBA = {'rgba': 4}
_SIZES = {'box': {'size': 3}, 'cylinder': {'radius': 0, 'length': 0}, 'sphere': {'radius': 0}}

#: {the elements from the root to one, without the root: what their part of the name is, and its attributes}.
_ATTRIBUTES: Dict[Tuple[str, ...], Tuple[str, Dict[str, int]]] = {
    ('joint', 'origin'): ('', _ORIGIN),
    ('joint', 'limit'): ('limit', {'lower': 0, 'upper': 0, 'effort': 0, 'velocity': 0}),
    ('link', 'inertial', 'origin'): ('inertial', _ORIGIN),
    ('link', 'visual', 'material', 'color'): ('visual', _RGBA),
    ('material', 'color'): ('', _RGBA),
    **{('link', part, 'origin'): (part, _ORIGIN) for part in ('visual', 'collision')},
    **{
        ('link', part, 'geometry', shape): (part, sizes)
        for part in ('visual', 'collision')
        for shape, sizes in _SIZES.items()
    },
}

#: The parts of a link that there may be several of.
_PARTS = ('visual', 'collision')


class UrdfNumber(NamedTuple):
    """A number of a URDF.

    Attributes:
        name: `camera_joint/xyz/0`, `elbow/limit/lower`, `camera/visual/size/2`, `camera/visual/1/radius` if there are
            several `<visual>`.
        value: what it is.
        start, end: where it stands, in bytes.
    """

    name: str
    value: float
    start: int
    end: int


class UrdfChange(NamedTuple):
    """The change of a number of a URDF.

    Attributes:
        name: of the number.
        said: what it was when the file was read, and what may have been saved there since.
        value: what it should be.
        what: what people call it.
        beside: {name: what it may be} of the numbers that tell which element is meant, if there are several alike.
    """

    name: str
    said: Sequence[Scalar]
    value: Scalar
    what: str
    beside: Mapping[str, Sequence[Scalar]]


class _Element(NamedTuple):
    path: Tuple[str, ...]  # without the root
    owner: str  # the name of the joint, link or material
    nth: int  # visual or collision of its link
    start: int
    attributes: Dict[str, str]


def urdf_numbers(content: bytes) -> List[UrdfNumber]:
    """The numbers of a URDF, in the order of the text: places, limits, sizes and colours.

    A number is left out if it is not certain how a change of it is written or what it is called: if there is an entity
    in its attribute, if the attribute has other numbers than it should, if two have one name, or if its joint, link or
    material has no name or one with a `/` or a blank.

    Raises:
        ValueError: none of it can be changed, as the text says why.
    """
    elements = _elements(content)
    several = Counter((one.owner, one.path[1], one.nth) for one in elements if one.path[1:2] and one.path[1] in _PARTS)
    parts = Counter((owner, part) for owner, part, _ in several)
    found: List[UrdfNumber] = []
    for one in elements:
        words, counts = _ATTRIBUTES.get(one.path, ('', {}))
        if not counts or not re.fullmatch(r'[^\s/]+', one.owner):
            continue
        index = str(one.nth) if words in _PARTS and parts[one.owner, words] > 1 else ''
        found += _in_tag(content, one, '/'.join(filter(None, [one.owner, words, index])), counts)
    names = Counter(one.name for one in found)
    return sorted((one for one in found if names[one.name] == 1), key=lambda one: one.start)


def _elements(content: bytes) -> List[_Element]:
    """The elements of a URDF that may have numbers, and all that tell which of several alike they are in."""
    try:
        content.decode('utf-8')
    except UnicodeDecodeError:
        raise ValueError('it is not in UTF-8') from None
    parser = expat.ParserCreate()
    found: List[_Element] = []
    stack: List[str] = []
    counts: Counter = Counter()
    owner = ''

    def begin(name: str, attributes: Dict[str, str]) -> None:
        nonlocal owner
        stack.append(name)
        if len(stack) == 1 and name != 'robot':
            raise ValueError(f'it is a <{name}> instead of a <robot>')
        if len(stack) == 2:
            owner = attributes.get('name', '')
            counts.clear()
        if len(stack) == 3:
            counts[name] += 1
        path = tuple(stack[1:])
        if path in _ATTRIBUTES or (len(path) == 2 and path[1] in _PARTS):
            nth = counts[path[1]] - 1
            found.append(_Element(path, owner, nth, parser.CurrentByteIndex, attributes))

    def end(_name: str) -> None:
        stack.pop()

    def declare(_version: str, encoding: Optional[str], _standalone: int) -> None:
        if encoding is not None and encoding.lower() not in ('utf-8', 'us-ascii', 'ascii'):
            raise ValueError(f'its encoding is {encoding} instead of UTF-8')

    def refuse(*_: object) -> None:
        raise ValueError('it has a <!DOCTYPE>')

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.XmlDeclHandler, parser.StartDoctypeDeclHandler = declare, refuse
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise ValueError(f'it is no XML: {expat.ErrorString(error.code)} in line {error.lineno}') from None
    return found


def _in_tag(content: bytes, element: _Element, name: str, counts: Dict[str, int]) -> Iterator[UrdfNumber]:
    """The numbers in the attributes of a tag."""
    tag = b'<' + element.path[-1].encode()
    place = element.start + len(tag)
    if not content.startswith(tag, element.start):
        return
    while True:
        match = _ATTRIBUTE.match(content, place)
        if match is None:
            return
        place, attribute = match.end(), match[1].decode()
        if attribute in counts:
            yield from _in_attribute(
                content, match.start(2) + 1, match.end(2) - 1, f'{name}/{attribute}', counts[attribute]
            )


def _in_attribute(content: bytes, start: int, end: int, name: str, count: int) -> List[UrdfNumber]:
    """The numbers in the value of an attribute, which is at these bytes; none if they are not as many as they should
    be."""
    found = []
    for index, word in enumerate(_WORD.finditer(content, start, end)):
        text = word[0].decode()
        if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
            return []
        found.append(UrdfNumber(f'{name}/{index}' if count else name, float(text), *word.span()))
    return found if len(found) == (count or 1) else []


def with_numbers(content: bytes, values: Mapping[str, Scalar]) -> bytes:
    """A URDF with other numbers, each in the place and in the manner of the one before; those that it does not have are
    left out.

    Args:
        content: it.
        values: {name: number}.

    Raises:
        ValueError: as of `urdf_numbers`.
    """
    parts, last = [], 0
    for one in urdf_numbers(content):
        value = values.get(one.name)
        if value is not None and value != one.value:
            parts += [content[last : one.start], _written(content, one, float(value))]
            last = one.end
    return b''.join([*parts, content[last:]])


def _written(content: bytes, number: UrdfNumber, value: float) -> bytes:
    """Another number in the manner of one."""
    old = content[number.start : number.end].decode()
    ways = (way for way in notations(old, value) if _NUMBER.fullmatch(way))
    return next((way for way in ways if repr(float(way)) == repr(value)), repr(value)).encode()


def urdf_edits(file: str, content: bytes, changes: Sequence[UrdfChange]) -> Tuple[List[Edit], List[Tuple[str, str]]]:
    """Make the edits that give a URDF other numbers, and leave every other byte as it is.

    Returns:
        (edits, [(what a change is called, why it cannot be made), ...]).

    Raises:
        FileError: its numbers cannot be changed.
    """
    numbers = _numbers_of(file, content)
    edits, left = [], []
    for change in changes:
        number = numbers.get(change.name)
        try:
            if number is None:
                raise ValueError(f'{file} has no such number, or not in one place, since it was edited')
            if equal(number.value, change.value):
                continue
            old = content[number.start : number.end]
            check_replaceable(file, old.decode(), number.value, change.said, change.value)
            _check_beside(file, numbers, change.beside)
        except ValueError as error:
            left.append((change.what, str(error)))
            continue
        new = _written(content, number, float(change.value))
        edits.append(Edit(file, digest_of(content), number.start, number.end, old, new, change.what))
    return edits, left


def _check_beside(file: str, numbers: Mapping[str, UrdfNumber], beside: Mapping[str, Sequence[Scalar]]) -> None:
    """Raise ValueError if numbers are others than they may be."""
    for name, said in beside.items():
        if name not in numbers or not any(equal(numbers[name].value, one) for one in said):
            raise ValueError(f'it is not certain which of several alike it is, as {name} of {file} was edited')


def urdf_places(file: str, content: bytes, names: Sequence[str]) -> List[Optional[Standing]]:
    """Find where numbers stand in a URDF; None for those that it does not have.

    Raises:
        FileError: its numbers cannot be changed.
    """
    numbers = _numbers_of(file, content)
    found = (numbers.get(name) for name in names)
    return [None if one is None else Standing(one.start, one.end, one.value) for one in found]


def _numbers_of(file: str, content: bytes) -> Dict[str, UrdfNumber]:
    """{name: number} of a file; FileError if there is none that can be changed."""
    try:
        return {one.name: one for one in urdf_numbers(content)}
    except ValueError as error:
        raise FileError(file, None, None, str(error)) from None


def alike_beside(name: str, names: Sequence[str]) -> List[str]:
    """Of some names of numbers, those that tell which element is meant by the name of another one: those of the same
    link, if that has several such parts."""
    words = name.split('/')
    if len(words) < 3 or words[1] not in _PARTS or not words[2].isdigit():
        return []
    begin = f'{words[0]}/{words[1]}/'
    return [one for one in names if one.startswith(begin) and one != name]
