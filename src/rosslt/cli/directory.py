"""Nodes and locations by their names, NODE and NODE/LOCATION, and what their owners report about them."""

import itertools
import re
import sys
from typing import Dict, Iterable, List, Mapping, Optional, Tuple

import rosgraph

from rosslt import node, values
from rosslt.cli.failure import Failure, did_it_begin_with, did_you_mean
from rosslt.cli.master import TIMEOUT, full_name, problem_of, system_state, tracked_nodes
from rosslt.cli.output import few
from rosslt.messages import Message, Scalar
from rosslt.node import Directory, Place, listed


def locations_of(master: rosgraph.Master, directory: Directory, name: str) -> List[Place]:
    """Return the locations of one node.

    Raises:
        Failure: it does not answer.
    """
    places, silent = directory.ask([name], TIMEOUT)
    if name not in places:
        raise cannot_reach(master, name, silent[name])
    return places[name]


def call(master: rosgraph.Master, name: str, service: str, service_class: object, request: Message) -> Message:
    """Call a service of one node, `<node>/rosslt/<service>`; returns its response.

    Raises:
        Failure: it does not answer.
    """
    answers, silent = node.ask_all(service, service_class, {name: request}, TIMEOUT)
    if name not in answers:
        raise cannot_reach(master, name, silent[name])
    return answers[name]


def change(
    master: rosgraph.Master, directory: Directory, requester: str, wanted: Mapping[values.Source, Scalar]
) -> Tuple[Dict[values.Source, node.Change], str]:
    """Change sources, all or none.

    Returns:
        ({Source: Change(old, new)}, what still holds results of the former values, as a sentence).

    Raises:
        Failure: a node refuses, does not answer, has taken the change back, as it has raised an exception, or does not
            answer any more.
    """
    request_id = node.new_request_id()
    try:
        changed = node.request_values(wanted, TIMEOUT, request_id, node.Requester(requester, directory))
    except node.ChangeRejected as error:
        reasons = dict.fromkeys(f'{source.node} refuses: {reason}' for source, reason in error.reasons.items())
        raise Failure('; '.join(reasons)) from None
    except node.SourceUnreachable as error:
        raise cannot_reach(master, *next(iter(error.silent.items()))) from None
    nodes = {source.node for source in changed}
    raised, silent = node.raised_after(request_id, nodes, TIMEOUT)
    told = [f'{name} raises {what}; taken back' for name, what in raised.items()]
    for name, reason in silent.items():
        told.append(f'{name} has taken the change, and does not answer since: {problem_of(master, name) or reason}')
    if told:
        raise Failure('; '.join(told))
    return changed, node.outdated_after(request_id, nodes, TIMEOUT)


def cannot_reach(master: rosgraph.Master, name: str, reason: str) -> Failure:
    """The Failure that says why a node does not answer."""
    return Failure(f'cannot reach {name}: {problem_of(master, name) or reason}')


def report_silent(verb: str, master: rosgraph.Master, silent: Mapping[str, str]) -> int:
    """Print which nodes do not answer, and why; returns the exit code."""
    for name, reason in sorted(silent.items()):
        print(f'rosslt {verb}: {cannot_reach(master, name, reason)}', file=sys.stderr)
    return 1 if silent else 0


def sources_called(directory: Directory, sources: Iterable[values.Source], text: str) -> List[values.Source]:
    """Find sources by what people call them: NODE/LOCATION, LOCATION, NODE#ID, or FILE:LINE:COLUMN as `rosslt echo`
    says."""
    found = []
    for source in sources:
        place = directory.of(source)
        names = {str(source), directory.name(source)} | (
            {place.local_name, place.file, place.short_file} if place else set()
        )
        if {text, '/' + text} & names:
            found.append(source)
    return found


def tracked_node(master: rosgraph.Master, text: str) -> str:
    """The full name of a node that has locations.

    Raises:
        Failure: there is none of that name.
    """
    name, state = full_name(text), system_state(master)
    if name in state.tracked_nodes:
        return name
    owned = _owned_for(name, state.tracked_nodes)
    if owned is not None:
        raise Failure(f'the parameters of {name} are locations of {owned[0]}, which has started it: say that')
    if name in state.nodes:
        raise Failure(f'the node {name} has no locations: it is not tracked')
    raise Failure(f'there is no node {name} with locations{did_it_begin_with(name, state.tracked_nodes)}')


def node_to_save(master: rosgraph.Master, text: str) -> Tuple[str, str]:
    """The full name of a node that has locations, and what the names of those that a text means begin with: '' for all,
    as of that node; if it is one that runs as it is, the name of its parameters at the `rosslt launch` that owns them.

    Raises:
        Failure: there is none of that name.
    """
    name, nodes = full_name(text), tracked_nodes(master)
    owned = None if name in nodes else _owned_for(name, nodes)
    return (tracked_node(master, text), '') if owned is None else (owned[0], name + '/')


def split_location(master: rosgraph.Master, text: str) -> Tuple[str, str]:
    """NODE/LOCATION as (the node's full name, what it calls the location).

    Raises:
        Failure: it begins with no node that has locations, or is a node's name alone.
    """
    nodes = tracked_nodes(master)
    found, text = _split(text, nodes)
    if found is None:
        owned = _owned_for(text, nodes)
        if owned is not None:
            return owned[0], text.replace('/~', '/')
        if text in nodes:
            why = problem_of(master, text)
            raise Failure(
                f'cannot reach {text}: {why}' if why else f'{text} is a node; rosslt list {text} has its locations'
            )
        meant = did_it_begin_with(text, nodes)
        known = _kept_of(master, text) or _parameter_of(master, text) or 'see rosslt list'
        raise Failure(f'{text} begins with no node that has locations{meant}; {known}')
    return found, text[len(found) + 1 :]


def _split(text: str, nodes: Iterable[str]) -> Tuple[Optional[str], str]:
    """The node that NODE/LOCATION or NODE#ID begins with, None if it is none of these, and the whole in full."""
    text = text if text.startswith('/') else full_name('x')[:-1] + text
    begun = [name for name in nodes if text.startswith((name + '/', name + '#'))]
    return max(begun, key=len) if begun else None, text


def _owned_for(text: str, nodes: Iterable[str]) -> Optional[Tuple[str, List[Place]]]:
    """The `rosslt launch` that owns parameters of a node which runs as it is, and those of which the full names are or
    begin with a text; None if none does.

    Args:
        text: NODE, NODE/NAME or NODE/~NAME, in full.
        nodes: those that have locations.
    """
    places, _ = Directory().ask([name for name in nodes if f'/{node.LAUNCH}_' in name], TIMEOUT)
    wanted = text.replace('/~', '/')
    for name, found in places.items():
        begun = [one for one in found if f'{one.location.name}/'.startswith(wanted + '/')]
        if begun:
            return name, begun
    return None


def _kept_of(master: rosgraph.Master, text: str) -> str:
    """Say what value of a literal, named as NODE/LOCATION, the last run of a node has left, and how to drop it; '' if
    none."""
    for slash in re.finditer('(?<=[^/])/(?=[^/])', text):
        name, literal = text[: slash.start()], text[slash.end() :]
        kept = node.kept_of(master, name, literal)
        if kept is not None:
            said, value = kept
            return (
                f'{name} has ended, and begins with {literal} = {value!r} where its code says {said!r}: '
                f'`rosparam delete {name}/rosslt/{literal}` has it begin with {said!r}'
            )
    return ''


def _parameter_of(master: rosgraph.Master, text: str) -> str:
    """Say how to set the ROS parameter called NODE/~NAME or NODE/NAME without its node; '' if there is none."""
    name = text.replace('/~', '/')
    try:
        value = master.getParam(name)
    except rosgraph.MasterException:
        return ''
    is_scalar = not isinstance(value, (dict, list))
    return f'{name} is a ROS parameter, now {value!r}: `rosparam set {name} VALUE` changes it' if is_scalar else ''


def find_node_or_locations(
    master: rosgraph.Master, directory: Directory, text: str
) -> Tuple[str, Optional[List[Place]]]:
    """Return the node that has locations, and those that the text names; None for all of them, if it is a NODE. With
    NODE/LOCATION or NODE#ID, it is that one; if there is none, those of which the names begin with that, as the numbers
    of a list do with its name.

    Raises:
        Failure: there is no such node, or no such location in it.
    """
    state = system_state(master)
    owned = None if full_name(text) in state.tracked_nodes else _owned_for(full_name(text), state.tracked_nodes)
    if owned is not None:
        return owned
    if full_name(text) in state.nodes or not _split(text, state.tracked_nodes)[0]:
        return tracked_node(master, text), None
    name, wanted = split_location(master, text)
    places = locations_of(master, directory, name)
    called = any(place.local_name == wanted or place.is_called(wanted) for place in places)
    begun = [] if called else _begun_by(wanted, places)
    return name, begun or [find(master, directory, text)]


def instead_of_topic(master: rosgraph.Master, text: str) -> str:
    """What else than a topic a text names, and which verb is for that, as the end of a sentence: a node that has
    locations, or a location. If the node does not answer, why; '' if it names neither."""
    nodes = tracked_nodes(master)
    name, text = _split(text, nodes)
    if text in nodes:
        return f'; {text} is a node: `rosslt list {text}` has its locations'
    if name is None:
        return ''
    try:
        places = locations_of(master, Directory(), name)
    except Failure as failure:
        return f'; {failure}'
    wanted = text[len(name) + 1 :]
    if not any(wanted == place.local_name or place.is_called(wanted) for place in places):
        return ''
    return f'; {text} is a location: `rosslt get {text}` has its value, and `rosslt graph` the fields that it reaches'


def find(master: rosgraph.Master, directory: Directory, text: str) -> Place:
    """Return the location named by NODE/LOCATION or NODE#ID.

    Raises:
        Failure: there is none, or more than one.
    """
    name, wanted = split_location(master, text)
    places = locations_of(master, directory, name)
    called = [place for place in places if place.local_name == wanted] or [
        place for place in places if place.is_called(wanted)
    ]
    if not called:
        shown = listed({name: places}, shows_all=True)[name]
        parts = _of_table(wanted, shown) or [place.local_name for place in _begun_by(wanted, shown)]
        one_of = f' (did you mean {"one of " * (len(parts) > 1)}{few(parts)}?)' if parts else ''
        meant = one_of or did_you_mean(wanted, [place.local_name for place in places])
        raise Failure(f'{name} has no location {wanted}{meant}; see rosslt list {name}')
    if len(called) > 1:
        raise Failure('{} is ambiguous: it may be {}'.format(text, ' or '.join(str(place.source) for place in called)))
    return called[0]


def find_in_row(master: rosgraph.Master, directory: Directory, text: str) -> Tuple[Place, List[Place]]:
    """Return a location, and all of the row of a table that it is in, itself among them; the first one of a row if
    the text is what the names of its numbers begin with, as `/patrol/WAYPOINTS_2`.

    Raises:
        Failure: as in `find`.
    """
    name, wanted = split_location(master, text)
    places = locations_of(master, directory, name)
    begun = _begun_by(wanted, places)
    rows = {place.location.row for place in begun}
    is_known = any(place.local_name == wanted for place in places)
    is_row = not is_known and len(rows) == 1 and '' not in rows
    if is_row:
        place = min(begun, key=lambda one: (one.location.line, one.location.column))
    else:
        place = find(master, directory, text)
    return place, node.in_row(place, places)


def _begun_by(text: str, places: Iterable[Place]) -> List[Place]:
    """The locations of which the names begin with a whole name: that of a list or dict, or of a part of one."""
    begins = tuple(one + end for one in (text, '~' + text) for end in '_/')
    return [place for place in places if place.local_name.startswith(begins)]


def _of_table(text: str, places: Iterable[Place]) -> List[str]:
    """The locations of the row that a text means if it begins with the name of a table, `SHELVES[2].x`; those of all
    rows if it has no such row."""
    wanted = _words(text)
    found: Dict[int, List[str]] = {}  # by how many words are the same
    for place in places:
        words = _words(place.local_name)
        same = len([*itertools.takewhile(lambda both: both[0] == both[1], zip(words, wanted))])
        if place.location.row and same >= len([*itertools.takewhile(str.isalpha, words)]):
            found.setdefault(same, []).append(place.local_name)
    return found[max(found)] if found else []


def _words(name: str) -> List[str]:
    return re.findall('[a-z]+|[0-9]+', name.lower())
