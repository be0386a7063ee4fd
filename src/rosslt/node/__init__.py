"""The room of rospy: this node's locations, how they are read and changed, and messages that carry
provenance.

It may import the rooms `messages` and `values`, and rospy. Its door is this module: the names mirror rospy's,
so that a node becomes tracked by changing the names of a few calls.
"""

from rosslt.node.api import (
    add_location,
    directory,
    force_value,
    get_param,
    init_node,
    location,
    reevaluate,
    remove_location,
    serve_locations,
    undo,
)
from rosslt.node.call_sites import CallSite
from rosslt.node.client import Change, ChangeRejected, SourceUnreachable
from rosslt.node.client import force_value as force_value_as
from rosslt.node.directory import Directory, Place
from rosslt.node.json_scalars import from_json, to_json
from rosslt.node.service_calls import ask_all
from rosslt.node.services import Service, ServiceProxy
from rosslt.node.topics import Publisher, Subscriber, wait_for_message

__all__ = [
    'CallSite',
    'Change',
    'ChangeRejected',
    'Directory',
    'Place',
    'Publisher',
    'Service',
    'ServiceProxy',
    'SourceUnreachable',
    'Subscriber',
    'add_location',
    'ask_all',
    'directory',
    'force_value',
    'force_value_as',
    'from_json',
    'get_param',
    'init_node',
    'location',
    'reevaluate',
    'remove_location',
    'serve_locations',
    'to_json',
    'undo',
    'wait_for_message',
]
