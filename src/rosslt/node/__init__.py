"""The room of rospy: this node's locations, how they are read and changed, and messages that carry
provenance.

It may import the rooms `messages`, `files` and `values`, and rospy. Its door is this module: the names mirror rospy's,
so that a node becomes tracked by changing the names of a few calls.
"""

from rosslt.node.api import (
    add_literal,
    add_location,
    directory,
    explain,
    get_param,
    init_node,
    is_started,
    limits,
    location,
    look_at_files_with,
    make_all_known_with,
    read_at,
    read_parameter,
    remove_location,
    reread,
    start,
)
from rosslt.node.call_sites import CallSite, call_site
from rosslt.node.change_lock import CHANGE_LOCK
from rosslt.node.client import (
    Change,
    ChangeRejected,
    Requester,
    SourceUnreachable,
    Undone,
    force_value,
    reevaluate,
    request_values,
    undo,
    undo_request,
)
from rosslt.node.closed_loop import ClosedLoop, Observation, observe
from rosslt.node.directory import SHAPE_RANK, Directory, Place
from rosslt.node.forcing import Forcing, NotReached, Outcome, force_field
from rosslt.node.history import new_request_id
from rosslt.node.json_scalars import from_json, to_json
from rosslt.node.leaving import leave
from rosslt.node.listening import Heard, Listener
from rosslt.node.literal_identities import identities
from rosslt.node.locations import HeldLocation, LiteralLocation
from rosslt.node.master_watch import MASTER_WATCH
from rosslt.node.memory import MEMORY
from rosslt.node.no_master import NO_MASTER
from rosslt.node.node_errors import NodeErrors
from rosslt.node.own_code import include_file, is_own_file
from rosslt.node.program_parameters import is_whole_parameter, parameter_was_set, serve_parameter, take_fractions
from rosslt.node.robot_description import Joint, check_joint_limits, description_for, joints_in
from rosslt.node.rospy_internals import args_kwds_to_message, connected_publishers, is_initialized
from rosslt.node.rounds import begins_round
from rosslt.node.saving import Unsaved, changes_to_save, tell_saved
from rosslt.node.service_calls import NO_ANSWER, ask_all
from rosslt.node.services import Service, ServiceProxy
from rosslt.node.source_files import SOURCE_FILES
from rosslt.node.tf import counterparts as tf_counterparts
from rosslt.node.tf import functions as tf_functions
from rosslt.node.tf.quaternions import rotated
from rosslt.node.topics import Publisher, Subscriber, wait_for_message
from rosslt.node.undoing import histories, last_change, taking_part, values_in_code
