"""Other nodes that read a parameter as a source: they may refuse a change of it, and would then set it back.

Their locks and accepted requesters are parameters. So whoever is to change a parameter finds them at the master,
without asking nodes that refuse nothing.
"""

import contextlib
from typing import Dict

from rosslt import srv
from rosslt.node.change.locks import ACCEPT_FROM, LOCKS, Access
from rosslt.node.json_scalars import Refused
from rosslt.node.no_master import NO_MASTER
from rosslt.node.parameters.server import ParameterServer
from rosslt.node.service_calls import ask_all, has_ended

#: The requester's name for a change that came by setting a parameter.
REQUESTER = 'parameter server'

#: The time that other nodes have to say whether they read a parameter, in seconds.
TIMEOUT = 0.5


def check_readers(server: ParameterServer, own_name: str, ids: Dict[str, int]) -> None:
    """Check that all other nodes that read parameters let them be changed.

    Args:
        own_name: the full name of this node, which is not asked.
        ids: {full name of a parameter: id of its location, the same in all nodes}.

    Raises:
        Refused: one of them does not; the text says which one, and why.
    """
    refusals: Dict[str, Dict[int, str]] = {}
    with contextlib.suppress(*NO_MASTER):  # if nobody keeps settings, nobody refuses
        for node, access in _settings_of_others(server, own_name).items():
            for name, location_id in ids.items():
                try:
                    access.check(name, REQUESTER)
                except Refused as refused:
                    refusals.setdefault(node, {})[location_id] = f'{name} is also read by {node}: {refused}'
    requests = {node: srv.ListLocationsRequest(location_ids=list(reasons)) for node, reasons in refusals.items()}
    answers, silent = ask_all('list_locations', srv.ListLocations, requests, TIMEOUT)
    for node, reasons in refusals.items():
        if node in answers:
            read = [location.id for location in answers[node].locations]
        else:  # one that hangs will set it back once it goes on
            read = [] if has_ended(silent[node]) else list(reasons)
        for location_id in read:
            raise Refused(reasons[location_id])


def _settings_of_others(server: ParameterServer, own_name: str) -> Dict[str, Access]:
    """{full name of a node: who may change what there}, of the nodes that have such settings."""
    found: Dict[str, Access] = {}
    for key in server.names():
        for setting in (ACCEPT_FROM, LOCKS):
            node, end, rest = key.rpartition(f'/rosslt/{setting}')
            if not end or rest or node == own_name:
                continue
            if node not in found:
                found[node] = Access()
                found[node].start(node)
            value = server.get(key)
            with contextlib.suppress(Refused):  # what is not a list of locks locks nothing there either
                found[node].set(setting, {} if value is None else value)
    return found
