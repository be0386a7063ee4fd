"""The numbers of robots (URDF) in the files that `rosslt launch` has read them from."""

from typing import Any, Dict, List, Mapping, Sequence, Tuple

import rosgraph

from rosslt import files
from rosslt.messages import Scalar
from rosslt.node.locations.directory import Place
from rosslt.node.parameters.robots import numbers_in
from rosslt.node.parameters.server import element_of

#: Where something is given, as `rosslt launch` has noted it, and more.
_Origin = Dict[str, Any]


def origin_of(name: str, origins: Mapping[str, Any]) -> Any:
    """Where a parameter, or a number of a robot in one, is given; None if that is not known.

    Args:
        name: its full name.
        origins: {full name of a parameter: where it is given}.
    """
    key = name
    while key:
        origin = origins.get(key)
        if origin and key == name:
            return origin
        if origin and origin.get('text_of'):
            file, number = origin['text_of'], name[len(key) + 1 :]
            return {'file': file, 'said': None, 'robot': key, 'number': number}
        key = key.rpartition('/')[0]
    return None


def robot_edits(
    file: str, content: bytes, those: Sequence[Tuple[Place, _Origin]]
) -> Tuple[List[files.Edit], List[Tuple[str, str]]]:
    """Make the edits that write numbers of a robot into its file, and list those that cannot be saved.

    Args:
        file: the file.
        content: of it.
        those: each place, with where it is given, and what may be there.

    Raises:
        FileError: it is no URDF that can be changed.
    """
    changes = [
        files.UrdfChange(origin['number'], origin['said'], place.value, place.local_name, origin.get('beside', {}))
        for place, origin in those
    ]
    return files.urdf_edits(file, content, changes)


def beside(origin: _Origin, places: Sequence[Place], past: Mapping[int, Sequence[Scalar]]) -> Dict[str, List[Scalar]]:
    """{name: what it may be} of the numbers that tell which element of a robot a number is in.

    Args:
        origin: where that one is given.
        places: of its node.
        past: {id of a location: what it was}.
    """
    begin = origin['robot'] + '/'
    there = {one.location.name[len(begin) :]: one for one in places if one.location.name.startswith(begin)}
    return {
        name: [there[name].value, *past.get(there[name].location.id, ())]
        for name in files.alike_beside(origin['number'], list(there))
    }


def said_for_another_robot(place: Place, origin: _Origin, origins: Mapping[str, Any], master: rosgraph.Master) -> str:
    """Why the file of a robot must not be written: it also gives a robot that has another number there; '' if it
    may."""
    others = [name for name, one in origins.items() if one.get('text_of') == origin['file'] and name != origin['robot']]
    parameters = master.getParam('/') if others else {}
    for name in others:
        value = numbers_in(element_of(parameters, name)).get(origin['number'])
        if value is not None and value != place.value:
            return f'{origin["file"]} says it for {name} as well, which is {value!r}'
    return ''
