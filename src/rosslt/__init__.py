"""rosslt: values that remember where they came from and what was done to them, across ROS nodes.

The names mirror rospy's, so that a node becomes tracked by changing the names of a few calls. What needs ROS
is loaded when it is first asked for: `Source`, `track`, `solve` and their like work without ROS.
"""

import importlib
import importlib.util
from typing import Any, List

from . import math, serializers
from .values import (
    UNKNOWN,
    Error,
    Fit,
    NotInvertible,
    NotTracked,
    Source,
    evaluate,
    fit,
    is_tracked,
    operation,
    solve,
    sources,
    to_bool,
    to_float,
    to_int,
    track,
    untracked,
)

serializers.register()

_NEED_ROS = {
    'actions': ['SimpleActionClient', 'SimpleActionServer'],
    'messages': ['BadHeader', 'UnknownType', 'tracked_type'],
    'tf': ['StaticTransformBroadcaster', 'TransformBroadcaster'],
    'node': [
        'Change',
        'ChangeRejected',
        'NotReached',
        'Outcome',
        'Publisher',
        'Service',
        'ServiceProxy',
        'SourceUnreachable',
        'Subscriber',
        'explain',
        'force_field',
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
    'UNKNOWN',
    'Error',
    'Fit',
    'NotInvertible',
    'NotTracked',
    'Source',
    'evaluate',
    'explain',
    'fit',
    'is_tracked',
    'math',
    'operation',
    'solve',
    'sources',
    'to_bool',
    'to_float',
    'to_int',
    'track',
    'untracked',
]


def _has_ros() -> bool:
    """Return whether rospy and this package's built messages can be imported, as in a sourced workspace."""
    try:
        return all(importlib.util.find_spec(name) is not None for name in ('rospy', __name__ + '.srv'))
    except ImportError:
        return False


if _has_ros():
    # `from rosslt import *` takes what there is.
    __all__ += ['tf']
    __all__ += [name for name in _ROOMS if name not in __all__]
else:
    _ROOMS['explain'] = 'values'


def __getattr__(name: str) -> Any:
    if name == '__version__':
        value = importlib.import_module(__name__ + '.version').find_version(__path__)
    elif name in ('numpy', 'tf'):
        return importlib.import_module(__name__ + '.' + name)
    elif name in _ROOMS:
        value = getattr(importlib.import_module('%s.%s' % (__name__, _ROOMS[name])), name)
    else:
        raise AttributeError('module %r has no attribute %r' % (__name__, name))
    globals()[name] = value
    return value


def __dir__() -> List[str]:
    return sorted({*globals(), *__all__, *_ROOMS, '__version__', 'numpy', 'tf'})
