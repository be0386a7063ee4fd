"""Launch files as text: other values in their <param> and <arg> tags and in the arguments of nodes, and every other
byte as it is."""

import contextlib
import math
import re
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple
from xml.parsers import expat
from xml.sax.saxutils import escape

from rosslt.files.errors import FileError
from rosslt.files.notation import Scalar, check_replaceable, equal, notations, same
from rosslt.files.python_source import Edit, Standing, digest_of, replaced

#: The ROS parameter in which `rosslt launch` notes which file says a parameter, as JSON: {full name: {'file': ...}}.
ORIGINS = '/rosslt/parameter_origins'

_ATTRIBUTE = re.compile(rb'([\w:.-]+)\s*=\s*("[^"]*"|\'[^\']*\')')

#: A word of the arguments of a node; a substitution may have blanks in it.
_WORD = r'(?:\$\([^)]*\)|[^ \t\r\n])+'

#: The characters that XML reads as a blank within an attribute.
_ESCAPES = {'\n': '&#10;', '\r': '&#13;', '\t': '&#9;'}


class Event(NamedTuple):
    """A part of an XML text.

    Attributes:
        kind: 'begin' or 'end' of a tag, 'text' or 'comment'.
        text: the tag's name, or the text.
        attributes: of a tag that begins.
        start: where it begins, in bytes.
        line: the same, from 1.
    """

    kind: str
    text: str
    attributes: Dict[str, str]
    start: int
    line: int


class AttributeChange(NamedTuple):
    """The change of the value of a <param> or an <arg>, or of a word of a <node>'s arguments.

    Attributes:
        nth, total: which <param>, <arg> or <node> of the file it was when that was loaded, and of how many.
        name: its attribute `name`.
        said: what it said then, and what may have been saved there since.
        value: what it should say.
        read: reads the attribute, or the word, as roslaunch or the node does.
        what: what people call it.
        word: which word of the arguments, from 0; None for a <param> or an <arg>.
        args: the arguments then.
        arg: the attribute of an <arg> that gives the value, `value` or `default`; '' for others.
    """

    nth: int
    total: int
    name: str
    said: Sequence[Scalar]
    value: Scalar
    read: Callable[[str], object]
    what: str
    word: Optional[int] = None
    args: str = ''
    arg: str = ''

    @property
    def tag(self) -> str:
        if self.arg:
            return 'arg'
        return 'param' if self.word is None else 'node'

    @property
    def attribute(self) -> str:
        if self.arg:
            return self.arg
        return 'value' if self.word is None else 'args'

    def may_be(self, tag: Event) -> bool:
        """Return whether a tag may be the one meant: it has the name and, but for numbers, the words of then."""
        if tag.attributes.get('name') != self.name or (self.arg and self.arg not in tag.attributes):
            return False
        return self.word is None or _but_numbers(tag.attributes.get('args', '')) == _but_numbers(self.args)

    def text_in(self, tag: Event) -> str:
        """What the tag says now; '' if it does not say it."""
        text = tag.attributes.get(self.attribute, '')
        return text if self.word is None else ''.join(words(text)[self.word : self.word + 1])


def words(text: str) -> List[str]:
    """The words of the arguments of a node."""
    return re.findall(_WORD, text)


def _but_numbers(text: str) -> List[str]:
    """The words of the arguments of a node, each number empty."""
    found = words(text)
    for index, word in enumerate(found):
        with contextlib.suppress(ValueError):
            found[index] = '' if math.isfinite(float(word)) else word
    return found


def events_of(file: str, content: bytes) -> List[Event]:
    """The tags, texts and comments of XML, in their order.

    Raises:
        FileError: it is no XML.
    """
    parser = expat.ParserCreate()
    found: List[Event] = []

    def add(kind: str, text: str, attributes: Dict[str, str]) -> None:
        if kind == 'text' and found and found[-1].kind == kind:
            found[-1] = found[-1]._replace(text=found[-1].text + text)
        else:
            found.append(Event(kind, text, attributes, parser.CurrentByteIndex, parser.CurrentLineNumber))

    parser.StartElementHandler = lambda name, attributes: add('begin', name, attributes)
    parser.EndElementHandler = lambda name: add('end', name, {})
    parser.CharacterDataHandler = lambda text: add('text', text, {})
    parser.CommentHandler = lambda text: add('comment', text, {})
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise FileError(file, error.lineno, error.offset + 1, expat.ErrorString(error.code)) from None
    return found


def tags_in(events: Sequence[Event], name: str) -> List[int]:
    """The indices of the events at which tags of a name begin."""
    return [index for index, event in enumerate(events) if (event.kind, event.text) == ('begin', name)]


def becomes(content: bytes, edit: Edit, events: Sequence[Event]) -> bool:
    """Return whether an edit makes XML of a content that says just the same as these events."""
    try:
        after = events_of(edit.file, replaced(content, [edit]))
    except FileError:
        return False
    return [event[:3] for event in after] == [event[:3] for event in events]


def attribute_edits(
    file: str, content: bytes, changes: Sequence[AttributeChange]
) -> Tuple[List[Edit], List[Tuple[str, str]]]:
    """Make the edits that give <param> and <arg> tags, and arguments of nodes, other values.

    Returns:
        (edits, [(what a change is called, why it cannot be made), ...]).

    Raises:
        FileError: the file is no XML.
    """
    events = events_of(file, content)
    edits, left = [], []
    for change in changes:
        try:
            index = _index_of_tag(events, change, file)
            old, place = change.text_in(events[index]), f'{file}:{events[index].line}'
            present = _read(change, old)
            if equal(present, change.value):
                continue
            check_replaceable(place, old, present, change.said, change.value)
            edits.append(_edit(file, content, events, index, change))
        except ValueError as error:
            left.append((change.what, str(error)))
    return edits, left


def attribute_text(file: str, content: bytes, change: AttributeChange) -> str:
    """What the attribute, or the word, of a change says now, whatever it should say; '' if there is none.

    Raises:
        FileError: the file is no XML.
        ValueError: it is not certain which tag it is.
    """
    events = events_of(file, content)
    return change.text_in(events[_index_of_tag(events, change, file)])


def attribute_places(file: str, content: bytes, changes: Sequence[AttributeChange]) -> List[Optional[Standing]]:
    """Find where the values of <param> and <arg> tags, and of arguments of nodes, stand.

    Returns:
        Where that of each change stands; None if that is not certain.

    Raises:
        FileError: the file is no XML.
    """
    events = events_of(file, content)
    found: List[Optional[Standing]] = []
    for change in changes:
        try:
            tag = events[_index_of_tag(events, change, file)]
            found.append(Standing(*_range_of_value(file, content, tag, change), _read(change, change.text_in(tag))))
        except ValueError:
            found.append(None)
    return found


def _index_of_tag(events: Sequence[Event], change: AttributeChange, file: str) -> int:
    """The index of the event at which the tag of a change begins; ValueError if it is not certain."""
    tags = tags_in(events, change.tag)
    found = [index for index in tags if change.may_be(events[index])]
    # After an edit, a different <param> with that name may be the nth, or have the value that this one had.
    if len(tags) == change.total and tags[change.nth] in found:
        return tags[change.nth]
    if len(found) != 1:
        which = f'<{change.tag} name="{change.name}">'
        raise ValueError(f'it is not certain which {which} of {file} it is since that was edited')
    return found[0]


def _read(change: AttributeChange, text: str) -> object:
    """The value of an attribute as roslaunch reads it; None if it does not."""
    try:
        return change.read(text)
    except ValueError:
        return None


def _edit(file: str, content: bytes, events: List[Event], index: int, change: AttributeChange) -> Edit:
    """The edit that writes a value in an attribute of a tag.

    Raises:
        ValueError: nothing reads back to exactly that value.
    """
    tag = events[index]
    start, _ = _range_of_attribute(content, tag, change.attribute)
    quote, text, first, last = content[start - 1 : start].decode(), tag.attributes[change.attribute], 0, None
    if change.word is not None:
        first, last = [*re.finditer(_WORD, text)][change.word].span()
    start, end = _range_of_value(file, content, tag, change)
    old = content[start:end]
    old.decode('utf-8')  # as whoever prints the edit does
    for word in notations(change.text_in(tag).strip(), change.value):
        if not same(_read(change, word), change.value):
            continue
        whole = text[:first] + word + text[last:] if last is not None else word
        attributes = {**tag.attributes, change.attribute: whole}
        said = [*events[:index], tag._replace(attributes=attributes), *events[index + 1 :]]
        escaped = escape(word, {**_ESCAPES, quote: '&quot;' if quote == '"' else '&apos;'})
        for new in (escaped.encode('utf-8', 'surrogatepass'), escaped.encode('ascii', 'xmlcharrefreplace')):
            edit = Edit(file, digest_of(content), start, end, old, new, change.what)
            if becomes(content, edit, said):
                return edit
    raise ValueError(f'{change.value!r} cannot be written in {file}:{tag.line} so that roslaunch reads just that')


def _range_of_value(file: str, content: bytes, tag: Event, change: AttributeChange) -> Tuple[int, int]:
    """Find the range of the attribute of a tag, or of the word in it, that a change is about.

    Raises:
        ValueError: there is none.
    """
    start, end = _range_of_attribute(content, tag, change.attribute)
    if change.word is None:
        return start, end
    raw = [*re.finditer(_WORD.encode(), content[start:end])]
    if change.word >= len(raw):
        raise ValueError(f'the blanks in the arguments of {file}:{tag.line} are written as entities')
    return start + raw[change.word].start(), start + raw[change.word].end()


def _range_of_attribute(content: bytes, tag: Event, name: str) -> Tuple[int, int]:
    """Find the range of an attribute of a tag, without its quotes."""
    place = tag.start + len('<' + tag.text)
    while True:
        match = _ATTRIBUTE.search(content, place)
        if match is None or b'>' in content[place : match.start()]:
            raise ValueError(f'the <{tag.text}> in line {tag.line} has no {name}')
        if match.group(1) == name.encode():
            return match.start(2) + 1, match.end(2) - 1
        place = match.end()
