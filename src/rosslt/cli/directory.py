"""What the owners of locations tell of them, and how the command calls a location: NODE/LOCATION."""

from rosslt.cli.failure import Failure
from rosslt.cli.master import full_name, tracked_nodes
from rosslt.node import Directory

__all__ = ['TIMEOUT', 'Directory', 'find', 'locations_of', 'split_location', 'tracked_node']

#: How long owners may take to answer, in seconds.
TIMEOUT = 2.0


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
