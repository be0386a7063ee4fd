"""The room of rospy: this node's locations, how they are read and changed, and messages that carry
provenance.

It may import the rooms `messages` and `values`, and rospy. Its door is this module: the names mirror rospy's,
so that a node becomes tracked by changing the names of a few calls.
"""

from rosslt.node.calls import ask_all
from rosslt.node.locations import CallSite, HeldLocation, from_json, to_json
from rosslt.node.message_statistics import main as show_message_statistics
from rosslt.node.nodes import (
    add_literal,
    add_location,
    force_value,
    get_param,
    init_node,
    is_started,
    location,
    marshal_tracked_values,
    read_parameter,
    reevaluate,
    remove_location,
    start,
    undo,
)
from rosslt.node.requests import Change, ChangeRejected, SourceUnreachable
from rosslt.node.requests import force_value as force_value_as
from rosslt.node.services import Service, ServiceProxy
from rosslt.node.tf import counterparts as tf_counterparts
from rosslt.node.tf.quaternions import rotated
from rosslt.node.topics import Publisher, Subscriber, wait_for_message

__all__ = [
    'CallSite',
    'Change',
    'ChangeRejected',
    'HeldLocation',
    'Publisher',
    'Service',
    'ServiceProxy',
    'SourceUnreachable',
    'Subscriber',
    'add_literal',
    'add_location',
    'ask_all',
    'force_value',
    'force_value_as',
    'from_json',
    'get_param',
    'init_node',
    'is_started',
    'location',
    'marshal_tracked_values',
    'read_parameter',
    'reevaluate',
    'remove_location',
    'rotated',
    'show_message_statistics',
    'start',
    'tf_counterparts',
    'to_json',
    'undo',
    'wait_for_message',
]
