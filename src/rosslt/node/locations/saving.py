"""Changed values of a node, and where in files they stand."""

import contextlib
import copy
import functools
import json
from typing import Any, Collection, Dict, List, NamedTuple, Optional, Sequence, Tuple

import rosgraph
import rospy

from rosslt import files, srv, values
from rosslt.messages import Message
from rosslt.node.change.client import SourceUnreachable
from rosslt.node.json_scalars import from_json, to_json
from rosslt.node.locations.directory import Directory, Place
from rosslt.node.locations.robot_files import beside, origin_of, robot_edits, said_for_another_robot
from rosslt.node.locations.row_journal import follow_save, origins_of
from rosslt.node.parameters.server import element_of
from rosslt.node.service_calls import ask_all

#: The maximal number of remembered values of a parameter that a save offered to write.
_MOST_OFFERED = 20

#: A parameter, and where it is given, as `rosslt launch` has noted it.
_Given = Tuple[Place, Dict[str, Any]]


class Unsaved(NamedTuple):
    """A changed value that cannot be written back: what it is called, and why."""

    name: str
    reason: str


def changes_to_save(node: str, timeout: float) -> Tuple[List[files.Edit], List[Unsaved]]:
    """Make the edits that write a node's changed values back to the files that they were read from.

    Args:
        node: its full name.
        timeout: how long it may take to answer each question, in seconds.

    Raises:
        SourceUnreachable: it does not answer; the message is the reason alone.
    """
    answer = list_edits(node, timeout)
    # Its locations are asked for afterwards, so that each edit has its name, also if the node is just starting.
    listed, silent = Directory().ask([node], timeout)
    if node not in listed:
        raise SourceUnreachable(silent[node], silent)
    places = listed[node]
    edits, unsaved = _in_sources(answer, places)
    history: Message = _call(node, 'get_history', srv.GetHistory, srv.GetHistoryRequest(), timeout)
    in_files, others = _in_parameter_files(history, places, answer.read_ids)
    return edits + in_files, unsaved + others


def tell_saved(node: str, edits: Sequence[files.Edit], timeout: float) -> None:
    """Have a node read its files just after a save, so that any later writing counts as an edit, and what was done with
    rows of them be taken back beside the save.

    Args:
        node: its full name.
        edits: what was written, perhaps for other nodes as well.
        timeout: how long it may take to answer, in seconds.
    """
    follow_save(node, edits)
    ask_all('list_edits', srv.ListEdits, {node: srv.ListEditsRequest()}, timeout)


def untaken_in(node: str, timeout: float) -> str:
    """Have a node read its files, and say which numbers there it does not take, `/patrol does not take 1.5 from
    patrol.py:5:6 (WAYPOINTS_0_0 stays 1)`, for those that have no other change; '' if there is none, or if the node
    does not answer.

    Args:
        node: its full name.
        timeout: how long it may take to answer each question, in seconds.
    """
    with contextlib.suppress(SourceUnreachable):
        return _untaken(node, list_edits(node, timeout), timeout)
    return ''


def stale_in(node: str, timeout: float) -> Optional[str]:
    """Have a node read its files, and say what is another there than in the node, besides numbers, and why.

    `patrol.py: lines 5, 6 stand in another order, which needs a restart of the node`; '' if nothing is, None if the
    node does not follow its files, or does not answer.

    Args:
        node: its full name.
        timeout: how long it may take to answer, in seconds.
    """
    with contextlib.suppress(SourceUnreachable):
        answer = list_edits(node, timeout)
        return '; '.join(answer.stale) if answer.follows_files else None
    return None


def differing_in(node: str, timeout: float) -> str:
    """Say how the files of a node differ from it: what `untaken_in` and `stale_in` say, as one text."""
    with contextlib.suppress(SourceUnreachable):
        answer = list_edits(node, timeout)
        return '; '.join(filter(None, [_untaken(node, answer, timeout), *answer.stale]))
    return ''


def _untaken(node: str, answer: Message, timeout: float) -> str:
    if not answer.untaken_ids:
        return ''
    listed, _ = Directory().ask([node], timeout)
    by_id = {place.location.id: place for place in listed.get(node, ())}
    stands = dict(zip(answer.read_ids, zip(answer.lines, answer.columns)))
    told = [
        '{} from {}:{}:{} ({} stays {})'.format(
            said, by_id[one].location.file, *stands[one], by_id[one].local_name, by_id[one].location.value
        )
        for one, said in sorted(zip(answer.untaken_ids, answer.said), key=lambda pair: stands[pair[0]])
        if one in by_id
    ]
    return f'{node} does not take ' + ', '.join(told)


def list_edits(node: str, timeout: float) -> Message:
    """Ask a node by its service `list_edits`.

    Raises:
        SourceUnreachable: it does not answer; the message is the reason alone.
    """
    return _call(node, 'list_edits', srv.ListEdits, srv.ListEditsRequest(), timeout)


def _call(node: str, service: str, service_class: object, request: Message, timeout: float) -> Message:
    answers, silent = ask_all(service, service_class, {node: request}, timeout)
    if node not in answers:
        raise SourceUnreachable(silent[node], silent)
    return answers[node]


def _in_sources(answer: Message, places: List[Place]) -> Tuple[List[files.Edit], List[Unsaved]]:
    """Convert the node's answer to edits of its source files, and the values that it cannot save."""
    by_id = {place.location.id: place for place in places}

    def name(location_id: int) -> str:
        return by_id[location_id].local_name if location_id in by_id else str(location_id)

    edits = [
        files.Edit(
            edit.file, edit.digest, edit.start, edit.end, edit.old.encode(), edit.new.encode(), name(edit.location_id)
        )
        for edit in answer.edits
    ]
    return edits, [Unsaved(name(one), reason) for one, reason in zip(answer.left_ids, answer.reasons)]


def _in_parameter_files(
    history: Message, places: List[Place], in_sources: Collection[int]
) -> Tuple[List[files.Edit], List[Unsaved]]:
    """Make the edits that write changed parameters into the YAML and launch files that they were loaded from.

    Args:
        history: the node's.
        in_sources: the ids of the locations that are read from source files.
    """
    past: Dict[int, List[Any]] = {}  # what a changed one was, from the beginning
    for one in history.changes:
        values = past.setdefault(one.change.location_id, [from_json(one.change.old_value)])
        values.append(from_json(one.change.new_value))
    parameters = [
        place for place in places if place.location.name.startswith('/') and place.location.id not in in_sources
    ]
    if not parameters:
        return [], []
    master = rosgraph.Master(rospy.get_name())
    origins = origins_of(master)
    before = copy.deepcopy(origins)
    by_file: Dict[str, List[Tuple[Place, Dict[str, Any]]]] = {}
    unsaved: List[Unsaved] = []
    changed_back = set()
    for place in parameters:
        origin, values = origin_of(place.location.name, origins), past.get(place.location.id, [])
        if not values and not _was_changed_earlier(place, origin):
            continue
        if values and files.equal(place.value, values[0]) and not (origin or {}).get('offered'):
            changed_back.add(place.local_name)
        reason = why_not_written(place, origin) or _said_for_another(place, origins, master) or _why_not_given(origin)
        if reason:
            unsaved.append(Unsaved(place.local_name, reason))
        else:
            # A value that was changed back may have been saved in between, also by an earlier run of the node.
            said = [one for one in (origin['said'], *values, *origin.get('offered', ())) if files.is_scalar(one)]
            more = {'beside': beside(origin, places, past)} if 'robot' in origin else {}
            by_file.setdefault(origin['file'], []).append((place, {**origin, **more, 'said': said}))
    edits: List[files.Edit] = []
    for file, those in by_file.items():
        try:
            made, left = edits_of(file, those)
        except files.FileError as error:
            unsaved += [Unsaved(place.local_name, str(error)) for place, _ in those]
        else:
            edits += made
            unsaved += [Unsaved(name, reason) for name, reason in left]
            written = {edit.what for edit in made}
            _offer(origins, [place for place, _ in those if place.local_name in written])
    if origins != before:
        master.setParam(files.ORIGINS, json.dumps(origins))
    return edits, [one for one in unsaved if one.name not in changed_back]


def why_whole(place: Place) -> str:
    """Why a location takes whole numbers only, and what to do, if it is a parameter that was given as one; '' for
    others: `it is given as 0 in pid.yaml:3; if the node takes fractions, write 0.0 there`."""
    location = place.location
    if location.type != 'int' or not location.name.startswith('/'):
        return ''
    origin = origins_of(rosgraph.Master(rospy.get_name())).get(location.name)
    if origin and type(origin['said']) is int:
        said, where = origin['said'], f'in {_given_at(place, origin)}'
    else:
        said, where = place.value, f'where {place.file} reads it from'
    return f'it is given as {said} {where}; if the node takes fractions, write {said}.0 there'


def _given_at(place: Place, origin: Dict[str, Any]) -> str:
    """FILE:LINE of the text that gives a parameter; FILE if that has been edited since."""
    other = copy.copy(place.location)
    other.value = to_json(place.value + 1)
    try:
        edits, _ = edits_of(origin['file'], [(Place(place.node, other), {**origin, 'said': [origin['said']]})])
        lines = [files.read_bytes(edit.file)[: edit.start].count(b'\n') + 1 for edit in edits]
    except files.FileError:
        lines = []
    return ':'.join(map(str, [origin['file'], *lines]))


def _offer(origins: Any, places: List[Place]) -> None:
    """Note the values about to be written beside the place of their parameters: the node may be started again, without
    its history, or be changed back to the value that the file had at first."""
    for place in places:
        if place.location.name not in origins:
            continue  # of a robot, whose text the next launch sets
        offered = origins[place.location.name].setdefault('offered', [])
        if not any(files.equal(place.value, one) for one in offered):
            offered.append(place.value)
            del offered[:-_MOST_OFFERED]


def _was_changed_earlier(place: Place, origin: Any) -> bool:
    """Return whether a node that ran earlier, and whose history is gone, may have changed a parameter.

    Its value differs from the one in the file that it was loaded from, or a save was offered before.
    """
    if (origin or {}).get('offered'):
        return True
    said = (origin or {}).get('said')
    if type(said) is str:
        said = said.replace('\r\n', '\n').replace('\r', '\n')  # as XML carries it to the parameter server
    return files.is_scalar(said) and files.is_scalar(place.value) and not files.equal(said, place.value)


def why_not_written(place: Place, origin: Any) -> str:
    """Why a parameter cannot be written back; '' if it can."""
    if not origin:
        return 'no file is known that it was read from; rosslt launch notes them'
    if origin.get('is_gone'):
        return f'its row was deleted from {origin["file"]}'
    if origin.get('is_substituted'):
        why = f': {origin["why"]}' if 'why' in origin else ''
        return f'it stands in {origin["file"]} through a substitution{why}'
    return ''


def _why_not_given(origin: Dict[str, Any]) -> str:
    """Why the <arg> that gave a parameter may not give it now: what led there was edited; '' if it gives it."""
    for step in origin.get('through', ()):
        (nth, total), word, file = step['tag'], step.get('word'), step['file']
        expected = step['text'] if word is None else files.words(step['text'])[word]
        change = files.AttributeChange(
            nth, total, step['name'], [], '', str, '', word, step['text'], step.get('arg', '')
        )
        try:
            text = files.attribute_text(file, files.read_bytes(file), change)
        except (files.FileError, ValueError) as error:
            return str(error)
        if text != expected:
            return f'it was edited since it was loaded: {file} says {text} instead of {expected}'
    return ''


def _said_for_another(place: Place, origins: Any, master: rosgraph.Master) -> str:
    """Why the place that sets a parameter must not be written: it also sets a parameter with a different value; ''
    if it may. Launch files are included several times, YAML files loaded in several namespaces, and an <arg> gives
    several parameters."""
    origin = origin_of(place.location.name, origins)
    if 'robot' in origin:
        return said_for_another_robot(place, origin, origins, master)
    own = _where(origin)
    others = [name for name, one in origins.items() if name != place.location.name and _where(one) == own]
    if not others:
        return ''
    parameters = master.getParam('/')
    for name in others:
        value = element_of(parameters, name)
        if value is not None and not files.equal(value, place.value):
            return f'{own["file"]} says it for {name} as well, which is {value!r}'
    return ''


def _where(origin: Dict[str, object]) -> Dict[str, Any]:
    """Return the position of a parameter in its file; equal for parameters that were read from the same text."""
    keys = ['file', 'tag', 'name', 'text', 'rosparam', 'path', 'word', 'arg']
    if 'arg' not in origin:  # the text of an <arg> is a number for one parameter, and a text for another one
        keys.append('said')
    return {key: origin.get(key) for key in keys}


def edits_of(file: str, those: List[_Given]) -> Tuple[List[files.Edit], List[Tuple[str, str]]]:
    """Make the edits that write parameters into a file, and list those that cannot be saved."""
    content = files.read_bytes(file)
    in_yaml, in_attributes = _sorted_by_tag(those)
    in_robot = [one for one in those if 'robot' in one[1]]
    edits, left = robot_edits(file, content, in_robot) if in_robot else ([], [])
    for tag, alike in in_yaml.items():
        changes = [
            files.YamlChange(origin['path'], origin['said'], place.value, place.local_name) for place, origin in alike
        ]
        if tag is None:
            made, unmade = files.yaml_edits(file, content, changes)
        else:
            made, unmade = files.inline_edits(file, content, *tag, changes)
        edits, left = edits + made, left + unmade
    if in_attributes:
        made, unmade = files.attribute_edits(file, content, [_attribute_change(*one) for one in in_attributes])
        edits, left = edits + made, left + unmade
    return edits, left


def parameter_places(file: str, content: bytes, those: List[_Given]) -> Dict[values.Source, files.Standing]:
    """Find where the values of parameters stand in a YAML or launch file, or in a URDF.

    Args:
        file: its path.
        content: what it says now.
        those: the parameters, each with where it is given, as `rosslt launch` has noted it.

    Returns:
        {source: where its value stands}, if that is certain, and if it is the value that was there when the file was
        loaded, one that may have been saved since, or the value in force.

    Raises:
        FileError: the file cannot be read.
    """
    in_yaml, in_attributes = _sorted_by_tag(those)
    in_robot = [one for one in those if 'robot' in one[1]]
    stands: List[Tuple[_Given, Optional[files.Standing]]] = []
    if in_robot:
        stands += zip(in_robot, files.urdf_places(file, content, [origin['number'] for _, origin in in_robot]))
    for tag, alike in in_yaml.items():
        paths = [origin['path'] for _, origin in alike]
        if tag is None:
            stands += zip(alike, files.yaml_places(file, content, paths))
        else:
            stands += zip(alike, files.inline_places(file, content, *tag, paths))
    if in_attributes:
        changes = [_attribute_change(*one) for one in in_attributes]
        stands += zip(in_attributes, files.attribute_places(file, content, changes))
    return {
        place.source: one
        for (place, origin), one in stands
        if one is not None
        and (
            'robot' in origin
            or any(files.equal(one.value, said) for said in (origin['said'], *origin.get('offered', ()), place.value))
        )
    }


def _sorted_by_tag(those: List[_Given]) -> Tuple[Dict[Optional[Tuple[int, int]], List[_Given]], List[_Given]]:
    """Parameters of a file by what they stand in.

    Returns:
        ({index of the <rosparam>, and how many there are, or None if the file is YAML itself: those in its YAML},
        those in attributes).
    """
    import rosparam  # noqa: F401 - teaches yaml to read angles

    in_yaml: Dict[Optional[Tuple[int, int]], List[_Given]] = {}
    for place, origin in those:
        if 'path' in origin:
            nth, count = origin.get('rosparam', (None, None))
            in_yaml.setdefault(None if nth is None else (nth, count), []).append((place, origin))
    return in_yaml, [one for one in those if not {'path', 'robot'}.intersection(one[1])]


def _attribute_change(place: Place, origin: Dict[str, Any]) -> files.AttributeChange:
    """The change of an attribute of a launch file that gives a parameter."""
    from roslaunch.loader import convert_value

    return files.AttributeChange(
        origin['tag'][0],
        origin['tag'][1],
        origin['name'],
        origin['said'],
        place.value,
        float if 'type' not in origin else functools.partial(_read_param, convert_value, origin['type']),
        place.local_name,
        origin.get('word'),
        origin['text'],
        origin.get('arg', ''),
    )


def _read_param(convert_value: Any, kind: str, text: str) -> Any:
    import yaml

    if '$(' in text:
        raise ValueError('roslaunch would take $( for a substitution')
    try:
        return convert_value(text.strip(), kind)
    except yaml.YAMLError as error:  # of type="yaml"
        raise ValueError(str(error)) from None
