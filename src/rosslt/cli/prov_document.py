"""Provenance of locations as a W3C PROV document, for tools that read PROV-JSON.

Agents are nodes, and whoever asked for changes. Entities are locations, the values that they had (each a specialization
of its location), and the fields of topics that are derived from them. Activities are the requests that changed
locations: a request used the values before it and generated those after it.
"""

from datetime import datetime, timezone
from typing import Any, Callable, Dict, List, NamedTuple, Sequence
from urllib.parse import quote

from rosslt import node, values
from rosslt.cli.failure import Failure
from rosslt.cli.history import Recorded
from rosslt.flow import ProvenanceMap
from rosslt.node import Directory

#: The kinds of things: each is a namespace of its own, and identifiers are `location:/talker/radius` and the like.
_KINDS = ('node', 'requester', 'location', 'value', 'change', 'field')


#: PROV names everything by URIs.
_URI = 'urn:rosslt:'


def prov_json(
    directory: Directory, sources: Sequence[values.Source], found: ProvenanceMap, changes: Sequence[Recorded]
) -> str:
    """A PROV document as PROV-JSON.

    It describes these sources, and those in `found` and in the changes, the oldest of which is the first.

    Raises:
        Failure: the Python package prov is not installed.
    """
    try:
        from prov.model import ProvDocument
    except ImportError:
        raise Failure('found no Python package prov: install python3-prov') from None
    document = ProvDocument()
    document.add_namespace('rosslt', _URI)
    for kind in _KINDS:
        document.add_namespace(kind, f'{_URI}{kind}:')
    things = _Things(document, directory)
    for source in sources:
        things.location(source, directory.name(source))
    things.add_changes(changes)
    things.add_fields(found)
    return str(document.serialize(format='json', indent=1))


class _Value(NamedTuple):
    """A value that a location had: as JSON, and as an entity."""

    text: str
    entity: Any


class _Things:
    """Puts agents, entities and activities into a document, each once."""

    def __init__(self, document: Any, directory: Directory) -> None:
        self._document = document
        self._directory = directory
        self._made: Dict[str, Any] = {}
        self._values: Dict[values.Source, _Value] = {}  # the latest one of each location
        self._counts: Dict[values.Source, int] = {}

    def location(self, source: values.Source, name: str) -> Any:
        """The entity that a location is, attributed to its node."""
        identifier = _identifier('location', name)
        if identifier not in self._made:
            place = self._directory.of(source)
            described: Dict[str, object] = {'prov:type': 'rosslt:Location', 'rosslt:id': source.location_id}
            if place is not None:
                described.update(
                    {
                        'prov:value': place.value,
                        'prov:location': place.file,
                        'rosslt:type': place.location.type,
                        'rosslt:minimum': place.minimum,
                        'rosslt:maximum': place.maximum,
                        'rosslt:read_only': place.read_only,
                    }
                )
                if place.location.literal:
                    described['rosslt:literal'] = node.from_json(place.location.literal)
            entity = self._add(self._document.entity, identifier, name, described)
            self._document.wasAttributedTo(entity, self._node(source.node))
        return self._made[identifier]

    def add_changes(self, changes: Sequence[Recorded]) -> None:
        """Add what requests used and generated; from the oldest change on."""
        requests: Dict[str, List[Recorded]] = {}
        for each in changes:
            requests.setdefault(each.recorded.request_id, []).append(each)
        for request_id, parts in requests.items():
            times = [_time(each) for each in parts]
            activity = self._document.activity(
                _identifier('change', request_id),
                min(times),
                max(times),
                {'rosslt:undone': any(each.recorded.undone for each in parts)},
            )
            asking = dict.fromkeys(each.recorded.change.requester for each in parts)
            for agent in [*map(self._requester, asking), *map(self._node, dict.fromkeys(each.node for each in parts))]:
                self._document.wasAssociatedWith(activity, agent)
            for each, time in zip(parts, times):
                self._add_change(activity, each, time)

    def add_fields(self, found: ProvenanceMap) -> None:
        """Add the fields of topics that are derived from locations."""
        for reach, fields in found.fields.items():
            location = self.location(reach.source, self._directory.name(reach.source))
            for field in fields:
                name = f'{reach.topic}/{field}'
                identifier = _identifier('field', name)
                if identifier not in self._made:
                    self._add(self._document.entity, identifier, name, {'prov:type': 'rosslt:Field'})
                self._document.wasDerivedFrom(self._made[identifier], location)
                self._document.wasAttributedTo(self._made[identifier], self._node(reach.publisher))

    def _add_change(self, activity: Any, each: Recorded, time: datetime) -> None:
        change = each.recorded.change
        before = self._values.get(each.source)
        if before is None or before.text != change.old_value:  # the first one, or it has changed by itself
            before = self._value(each, change.old_value)
        after = self._value(each, change.new_value)
        self._document.used(activity, before.entity, time)
        self._document.wasGeneratedBy(after.entity, activity, time)
        self._document.wasDerivedFrom(after.entity, before.entity, activity)
        self._values[each.source] = before if each.recorded.undone else after

    def _value(self, each: Recorded, text: str) -> _Value:
        name = each.name(self._directory)
        count = self._counts[each.source] = self._counts.get(each.source, 0) + 1
        entity = self._add(
            self._document.entity,
            _identifier('value', f'{name}/{count}'),
            f'{name} = {text}',
            {'prov:type': 'rosslt:Value', 'prov:value': node.from_json(text)},
        )
        self._document.specializationOf(entity, self.location(each.source, name))
        return _Value(text, entity)

    def _node(self, name: str) -> Any:
        return self._agent('node', name, 'prov:SoftwareAgent')

    def _requester(self, name: str) -> Any:
        """Return the agent that requested a change: a node, or another requester such as the parameter server."""
        return self._node(name) if name.startswith('/') else self._agent('requester', name or 'somebody', 'prov:Agent')

    def _agent(self, kind: str, name: str, prov_type: str) -> Any:
        identifier = _identifier(kind, name)
        if identifier not in self._made:
            self._add(self._document.agent, identifier, name, {'prov:type': prov_type})
        return self._made[identifier]

    def _add(self, make: Callable[..., Any], identifier: str, label: str, attributes: Dict[str, object]) -> Any:
        given = {name: value for name, value in attributes.items() if value is not None}
        self._made[identifier] = make(identifier, other_attributes={'prov:label': label, **given})
        return self._made[identifier]


def _identifier(kind: str, name: str) -> str:
    return f'{kind}:{quote(name, safe="/~[]*.#")}'


def _time(each: Recorded) -> datetime:
    """When a change was applied; of simulated time, so many seconds after 1970."""
    return datetime.fromtimestamp(each.recorded.change.stamp.to_sec(), timezone.utc)
