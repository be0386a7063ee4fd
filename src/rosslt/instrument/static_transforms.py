"""Has a static transform publisher of a launch file send its transform with provenance.

`static_transform_publisher` of tf and of tf2_ros gets its numbers as arguments. A node of this package does the same
with parameters, which can be changed: it takes the place of theirs, under its name, and the arguments are where these
parameters are given.
"""

import math
import re
from typing import Any, List, Optional, Tuple

import roslaunch.core
from rosgraph.names import ns_join

from rosslt import files
from rosslt.instrument.parameter_origins import NotingLoader

#: The packages that have such a node, and whether its last argument is a period in milliseconds.
_PACKAGES = {'tf': True, 'tf2_ros': False}

_POSITION = ['x', 'y', 'z']
#: What slt_static_transform calls the numbers of a rotation, and their names.
_ROTATIONS = {'angles': ['yaw', 'pitch', 'roll'], 'quaternion': ['qx', 'qy', 'qz', 'qw']}

#: A number that Python and C read alike.
_NUMBER = re.compile(r'[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?', re.ASCII | re.IGNORECASE)


def keep_provenance(one: roslaunch.core.Node, config: Any, loader: NotingLoader) -> None:
    """Have a node of a launch file keep the provenance of its numbers, if it is a static transform publisher whose
    arguments are right and which runs on this machine; leave it as it is if not.

    Args:
        one: the node; it is changed.
        config: roslaunch's, which gets the parameters.
        loader: has loaded the launch file.
    """
    has_period = _PACKAGES.get(one.package) if one.type == 'static_transform_publisher' else None
    if has_period is None or not (one.machine is None or roslaunch.core.is_machine_local(one.machine)):
        return
    words = files.words(one.args)
    read = _read([word for word in words if ':=' not in word], has_period)
    node = ns_join(one.namespace, one.name)
    if read is None or any(ns_join(node, name) in config.params for name, _ in read[0]):
        return
    numbers, others = read
    indices = [index for index, word in enumerate(words) if ':=' not in word]
    for index, (name, value) in zip(indices, numbers):
        parameter = ns_join(node, name)
        config.add_param(roslaunch.core.Param(parameter, value), verbose=False)
        loader.note_argument(one, index, parameter, value)
    one.package, one.type = 'rosslt', 'slt_static_transform'
    one.args = ' '.join([*others, *(word for word in words if ':=' in word)])


def _read(words: List[str], has_period: bool) -> Optional[Tuple[List[Tuple[str, float]], List[str]]]:
    """([(name, number), ...], the other arguments); None if they are not those of a static transform publisher."""
    count = len(words) - 2 - has_period
    texts, frames = [*words[:count], *words[count + 2 :]], words[count : count + 2]
    if not all(map(_NUMBER.fullmatch, texts)) or len(set(frames)) < len(frames):
        return None
    numbers = [float(text) for text in texts]
    if not all(map(math.isfinite, numbers)) or not all(period > 0 for period in numbers[count:]):
        return None
    for rotation, names in _ROTATIONS.items():
        if count == len(_POSITION) + len(names):
            return list(zip([*_POSITION, *names], numbers)), [rotation, *words[count:]]
    return None
