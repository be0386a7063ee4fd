"""rosslt: values that remember where they came from and what was done to them, across ROS nodes.

The names mirror rospy's, so that a node becomes tracked by changing the names of a few calls. What needs ROS
is loaded when it is first asked for: `Source`, `track`, `solve` and their like work without ROS.
"""

import importlib

from . import math
from .values import (
    Error,
    NotInvertible,
    NotTracked,
    Source,
    evaluate,
    explain,
    is_tracked,
    solve,
    sources,
    to_bool,
    to_float,
    to_int,
    track,
    untracked,
)

__version__ = '0.1.0'

_NEED_ROS = {
    'actions': ['SimpleActionClient', 'SimpleActionServer'],
    'messages': ['tracked_type'],
    'tf': ['StaticTransformBroadcaster', 'TransformBroadcaster'],
    'node': [
        'Change',
        'ChangeRejected',
        'Publisher',
        'Service',
        'ServiceProxy',
        'SourceUnreachable',
        'Subscriber',
        'force_value',
        'get_param',
        'init_node',
        'location',
        'reevaluate',
        'undo',
        'wait_for_message',
    ],
}
_ROOMS = {name: room for room, names in _NEED_ROS.items() for name in names}

__all__ = [
    'Error',
    'NotInvertible',
    'NotTracked',
    'Source',
    'evaluate',
    'explain',
    'is_tracked',
    'math',
    'solve',
    'sources',
    'to_bool',
    'to_float',
    'to_int',
    'track',
    'untracked',
    'tf',
]
__all__ += list(_ROOMS)


def __getattr__(name):
    if name == 'tf':
        return importlib.import_module('rosslt.tf')
    if name not in _ROOMS:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(importlib.import_module(f'{__name__}.{_ROOMS[name]}'), name)
    globals()[name] = value
    return value


def __dir__():
    return sorted({*globals(), *__all__})
