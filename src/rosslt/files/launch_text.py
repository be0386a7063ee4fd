"""Launch files as text: other values in their <param> tags, and every other byte as it is."""

import re
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Sequence, Tuple
from xml.parsers import expat
from xml.sax.saxutils import escape

from rosslt.files.errors import FileError
from rosslt.files.notation import Scalar, alike, equal, truths_in_manner_of, written_as
from rosslt.files.source_text import Edit, digest_of

#: The ROS parameter in which `rosslt launch` notes which file says a parameter, as JSON: {full name: {'file': ...}}.
ORIGINS = '/rosslt/parameter_origins'

_ATTRIBUTE = re.compile(rb'([\w:.-]+)\s*=\s*("[^"]*"|\'[^\']*\')')


#: The characters that XML reads as a blank within an attribute.
_ESCAPES = {'\n': '&#10;', '\r': '&#13;', '\t': '&#9;'}


#: What an XML text says: (tag, attributes), an end, text, or a comment.
_Event = Tuple[str, Any]


class ParamTag(NamedTuple):
    """A <param> in a launch file.

    Attributes:
        start: where it begins, in bytes.
        name, value: these attributes as they are written, '' where it has none.
        line: from 1.
        nth: which <param> of the file it is, from 0.
    """

    start: int
    name: str
    value: str
    line: int
    nth: int


class ParamChange(NamedTuple):
    """A <param> that is to have another value.

    Attributes:
        nth, total: which <param> of the file it was when that was loaded, and of how many.
        name, text: its attributes `name` and `value` then, as they were written.
        said: what may have been saved there since.
        value: what it should say.
        read: reads the attribute as roslaunch does.
        what: what people call it.
    """

    nth: int
    total: int
    name: str
    text: str
    said: Sequence[Scalar]
    value: Scalar
    read: Callable[[str], object]
    what: str


def param_tags(file: str, content: bytes) -> List[ParamTag]:
    """All <param> of a launch file, in the order in which they begin.

    Raises:
        FileError: it is no XML.
    """
    parser = expat.ParserCreate()
    found: List[ParamTag] = []

    def begin(name: str, attributes: Dict[str, str]) -> None:
        if name == 'param':
            found.append(
                ParamTag(
                    parser.CurrentByteIndex,
                    attributes.get('name', ''),
                    attributes.get('value', ''),
                    parser.CurrentLineNumber,
                    len(found),
                )
            )

    parser.StartElementHandler = begin
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise FileError(file, error.lineno, error.offset + 1, expat.ErrorString(error.code)) from None
    return found


def param_edits(file: str, content: bytes, changes: Sequence[ParamChange]) -> Tuple[List[Edit], List[Tuple[str, str]]]:
    """Make the edits that give <param> tags other values.

    Returns:
        (edits, [(what a change is called, why it cannot be made), ...]).

    Raises:
        FileError: the file is no XML.
    """
    tags = param_tags(file, content)
    edits, left = [], []
    for change in changes:
        try:
            tag = _tag_of(tags, change, file)
            present = change.read(tag.value)
            if equal(present, change.value):
                continue
            if not alike(present, change.value):
                raise ValueError(f'{change.value!r} is of another kind than {present!r}, which {file}:{tag.line} says')
            start, end = _range_of_value(content, tag)
            if isinstance(change.value, (str, bool)):
                new = _word(content, tag, (start, end), change, file)
            elif content[start:end].decode('ascii', 'replace') != tag.value:
                raise ValueError(f'{file}:{tag.line} has it in a notation of XML that is not rewritten')
            else:
                new = written_as(tag.value, change.value, change.read)
        except ValueError as error:
            left.append((change.what, str(error)))
            continue
        edits.append(Edit(file, digest_of(content), start, end, content[start:end], new.encode(), change.what))
    return edits, left


def _tag_of(tags: List[ParamTag], change: ParamChange, file: str) -> ParamTag:
    """Find the <param> of a change; ValueError where it is not certain."""
    found = [tag for tag in tags if tag.name == change.name]
    # Another one with that name may be the nth by now, or have the value that this one had.
    if len(tags) == change.total and tags[change.nth] in found:
        found = [tags[change.nth]]
    if len(found) != 1:
        raise ValueError(f'it is not certain which <param name="{change.name}"> of {file} it is since that was edited')
    if found[0].value != change.text and not _may_be_saved(change, found[0].value):
        raise ValueError(
            f'it was edited since it was loaded: {file}:{found[0].line} says {found[0].value} instead of {change.text}'
        )
    return found[0]


def _may_be_saved(change: ParamChange, text: str) -> bool:
    """Return whether a text says what is to be saved, or may have been saved before."""
    try:
        return any(equal(change.read(text), one) for one in (change.value, *change.said))
    except ValueError:
        return False


def _word(content: bytes, tag: ParamTag, place: Tuple[int, int], change: ParamChange, file: str) -> str:
    """A text or a truth value as it is written in the attribute `value` of a tag.

    Raises:
        ValueError: nothing reads back to exactly that value.
    """
    start, end = place
    try:
        content[start:end].decode('utf-8')
    except UnicodeDecodeError:
        raise ValueError(f'{file}:{tag.line} has it in another encoding than UTF-8') from None
    quote = content[start - 1 : start].decode()
    before = _said_by(content)
    for word in _words(tag.value, change.value):
        try:
            if not equal(change.read(word), change.value):
                continue
        except ValueError:
            continue
        escaped = escape(word, {**_ESCAPES, quote: '&quot;' if quote == '"' else '&apos;'})
        for spelled in (escaped, escaped.encode('ascii', 'xmlcharrefreplace').decode()):
            try:
                after = _said_by(content[:start] + spelled.encode('utf-8', 'surrogatepass') + content[end:])
            except expat.ExpatError:
                continue
            if after == _with_value(before, tag.nth, word):
                return spelled
    raise ValueError(f'{change.value!r} cannot be written in {file}:{tag.line} so that roslaunch reads just that')


def _words(old: str, value: Scalar) -> Iterator[str]:
    if isinstance(value, bool):
        yield from truths_in_manner_of(old.strip(), value)
    else:
        yield str(value)
        # With type="yaml" some texts need quotes.
        yield "'" + str(value).replace("'", "''") + "'"


def _said_by(content: bytes) -> List[_Event]:
    """List the content of XML, in its order: (tag, attributes), an end, text, or a comment."""
    parser = expat.ParserCreate()
    parser.buffer_text = True
    found: List[_Event] = []
    parser.StartElementHandler = lambda name, attributes: found.append((name, attributes))
    parser.EndElementHandler = lambda name: found.append(('/', name))
    parser.CharacterDataHandler = lambda text: found.append(('text', text))
    parser.CommentHandler = lambda text: found.append(('comment', text))
    parser.Parse(content, True)
    return found


def _with_value(said: List[_Event], nth: int, value: str) -> List[_Event]:
    """Return the list of `_said_by` with another value of the nth <param>."""
    places = [place for place, one in enumerate(said) if one[0] == 'param' and isinstance(one[1], dict)]
    changed = list(said)
    changed[places[nth]] = 'param', {**said[places[nth]][1], 'value': value}
    return changed


def is_in_utf8(content: bytes) -> bool:
    """Return whether XML is in UTF-8, as its first line says or leaves unsaid."""
    parser = expat.ParserCreate()
    named: List[str] = []
    parser.XmlDeclHandler = lambda version, encoding, standalone: named.append(encoding or 'utf-8')
    parser.Parse(content, True)
    return not named or named[0].lower() == 'utf-8'


def _range_of_value(content: bytes, tag: ParamTag) -> Tuple[int, int]:
    """Find the range of the attribute `value` of a tag, without its quotes."""
    place = tag.start + len(b'<param')
    while True:
        match = _ATTRIBUTE.search(content, place)
        if match is None or b'>' in content[place : match.start()]:
            raise ValueError(f'the <param> in line {tag.line} has no value')
        if match.group(1) == b'value':
            return match.start(2) + 1, match.end(2) - 1
        place = match.end()
