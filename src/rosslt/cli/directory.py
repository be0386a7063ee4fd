"""What the owners of locations tell of them, and how the command calls a location: NODE/LOCATION."""

import time
from collections import namedtuple

from rosslt import node, srv, values
from rosslt.cli.failure import Failure
from rosslt.cli.master import full_name, is_below, tracked_nodes

#: How long owners may take to answer, in seconds.
TIMEOUT = 2.0

#: How long to go without asking again who did not answer, in seconds: a node may just have been busy.
PATIENCE = 10.0


class Place(namedtuple('Place', 'node location')):
    """A location of a node: the node's full name, and its rosslt/Location.

    What a location is called: `/talker/radius`, `/talker/~parking/0` for a private parameter and `/talker//height` for
    a parameter elsewhere.
    """

    @property
    def local_name(self):
        """Its name in its node: `radius`, `~parking/0`, `/height`."""
        return (
            self.location.name.replace(self.node + '/', '~', 1)
            if is_below(self.location.name, self.node)
            else self.location.name
        )

    @property
    def name(self):
        """NODE/LOCATION, as every verb takes it."""
        return f'{self.node}/{self.local_name}'

    @property
    def source(self):
        """It, as a Source."""
        return values.Source(self.node, self.location.id)

    @property
    def file(self):
        """`/home/me/src/talker.py:12:9`."""
        return '{0.file}:{0.line}:{0.column}'.format(self.location)

    @property
    def short_file(self):
        """`talker.py:12:9`, as `explain` says it."""
        return self.file.rsplit('/', 1)[-1]

    @property
    def value(self):
        """Its plain value."""
        return node.from_json(self.location.value)

    def is_called(self, text):
        """Whether people may mean this one by `text`, which is what follows the node's name and a /."""
        return text in (self.local_name, self.location.name.lstrip('/'), str(self.location.id))


class Directory:
    """Remembers what owners tell of their locations; stands in for the facts that a node has."""

    def __init__(self):
        self._known = {}  # Source -> Place
        self._ask_again = {}  # node -> a time, where it did not answer

    def of(self, source):
        """The Place of a source; None where its owner is not there, or does not know it."""
        return self._known.get(source)

    def short_file(self, source):
        """Where a source stands, None where that is not known."""
        place = self.of(source)
        return place and place.short_file

    def name(self, source):
        """What a source is called, in any case."""
        place = self.of(source)
        return place.name if place else str(source)

    def ordered(self, sources):
        """Sources by node, and in the order in which the node lists them."""
        order = {source: index for index, source in enumerate(self._known)}
        return sorted(sources, key=lambda source: (source.node, order.get(source, len(order)), source.location_id))

    def learn(self, sources, timeout=TIMEOUT):
        """Ask the owners of sources that are not known yet."""
        now = time.monotonic()
        unknown = {source.node for source in sources if source not in self._known}
        self.ask([name for name in unknown if self._ask_again.get(name, 0.0) <= now], timeout)
        self._ask_again.update(dict.fromkeys(unknown, now + PATIENCE))

    def ask(self, nodes, timeout=TIMEOUT):
        """All locations of nodes.

        Returns:
            ({node: [Place, ...]}, {node: why it does not answer}).
        """
        answers, silent = node.ask_all(
            'list_locations', srv.ListLocations, {name: srv.ListLocationsRequest() for name in nodes}, timeout
        )
        places = {name: [Place(name, location) for location in answer.locations] for name, answer in answers.items()}
        for found in places.values():
            self._known.update((place.source, place) for place in found)
        return places, silent

    def limits(self, sources, timeout):
        """What `solve` has to know of sources: its arguments `bounds`, `read_only` and `rank`."""
        self.learn(sources, timeout)
        known = [place for place in map(self.of, sources) if place]
        return {
            'bounds': {
                place.source: tuple(
                    node.from_json(text) if text else None for text in (place.location.minimum, place.location.maximum)
                )
                for place in known
            },
            'read_only': [place.source for place in known if place.location.read_only],
            'rank': {place.source: place.location.rank for place in known if place.location.rank},
        }

    def forget(self, sources):
        """Ask anew the next time."""
        for source in sources:
            self._known.pop(source, None)
            self._ask_again.pop(source.node, None)


def locations_of(directory, name, timeout=TIMEOUT):
    """The Places of one node.

    Raises:
        Failure: it does not answer.
    """
    places, silent = directory.ask([name], timeout)
    if name not in places:
        raise Failure(f'cannot reach {name}: {silent[name]}')
    return places[name]


def tracked_node(master, text):
    """The full name of a node that has locations.

    Raises:
        Failure: there is none of that name.
    """
    name = full_name(text)
    if name not in tracked_nodes(master):
        raise Failure(f'there is no node {name} with locations')
    return name


def split_location(master, text):
    """NODE/LOCATION as (the node's full name, what it calls the location).

    Raises:
        Failure: it begins with no node that has locations, or is a node's name alone.
    """
    text = text if text.startswith('/') else full_name('x')[:-1] + text
    nodes = tracked_nodes(master)
    found = max((name for name in nodes if text.startswith((name + '/', name + '#'))), key=len, default=None)
    if found is None:
        raise Failure(
            f'{text} names no location of the node; see rosslt list {text}'
            if text in nodes
            else f'{text} begins with no node that has locations; see rosslt list'
        )
    return found, text[len(found) + 1 :]


def find(master, directory, text):
    """The Place that NODE/LOCATION, or NODE#ID, names.

    Raises:
        Failure: there is none, or more than one.
    """
    name, wanted = split_location(master, text)
    places = locations_of(directory, name)
    called = [place for place in places if place.local_name == wanted] or [
        place for place in places if place.is_called(wanted)
    ]
    if not called:
        raise Failure(f'{name} has no location {wanted}; see rosslt list {name}')
    if len(called) > 1:
        raise Failure('{} may be {}'.format(text, ' or '.join(str(place.source) for place in called)))
    return called[0]
