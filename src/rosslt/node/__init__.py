"""The room of rospy: this node's locations, how they are read and changed, and messages that carry
provenance.

It may import the rooms `messages`, `files` and `values`, and rospy. Its door is this module: the names mirror rospy's,
so that a node becomes tracked by changing the names of a few calls.
"""

from rosslt.node.api import (
    add_literal,
    add_location,
    bound_anew,
    directory,
    explain,
    get_param,
    has_kept,
    identify,
    init_node,
    is_late,
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
from rosslt.node.callbacks import Callbacks
from rosslt.node.change.change_request import ChangeRequest, Shown
from rosslt.node.change.client import (
    Change,
    ChangeRejected,
    Requester,
    SourceUnreachable,
    Undone,
    force_value,
    outdated_after,
    raised_after,
    reevaluate,
    request_values,
    undo,
    undo_request,
)
from rosslt.node.change.closed_loop import ClosedLoop
from rosslt.node.change.effects import solve_by_effect
from rosslt.node.change.forcing import Forcing, NotReached, Outcome, force_field
from rosslt.node.change.history import new_request_id
from rosslt.node.change.last_change import histories, last_change, taking_part, values_in_code
from rosslt.node.change.matching import Aim, Matching
from rosslt.node.change.node_errors import NodeErrors
from rosslt.node.change.observation import Expression, Observation, comes_from, observe
from rosslt.node.json_scalars import from_json, to_json
from rosslt.node.learned_files import age_text, is_any_learned, learned_folder
from rosslt.node.leaving import leave
from rosslt.node.location_server import SUSPECT
from rosslt.node.locations.call_sites import CallSite, call_site
from rosslt.node.locations.directory import SHAPE_RANK, Directory, Place, listed
from rosslt.node.locations.literal_identities import identities
from rosslt.node.locations.location import LiteralLocation, Location, location_id
from rosslt.node.locations.mutex import CHANGE_LOCK
from rosslt.node.locations.others_parameter import Reader
from rosslt.node.locations.robot_files import origin_of
from rosslt.node.locations.row_edits import (
    SCRIPT_TEXT,
    edit_row,
    in_row,
    is_in_script,
    row_additions,
    row_edit,
    when_rows_are_read,
)
from rosslt.node.locations.row_journal import RowRecord, last_row_record, numbers_of_rows, take_row_back
from rosslt.node.locations.saving import (
    changes_to_save,
    differing_in,
    parameter_places,
    tell_saved,
    why_not_written,
    why_whole,
)
from rosslt.node.locations.source_files import SOURCE_FILES
from rosslt.node.locations.uses import Uses, shared_in, tracked_of_thing
from rosslt.node.master_watch import MASTER_WATCH
from rosslt.node.memory.own_code import include_file, is_own_file
from rosslt.node.memory.plain_copies import taken
from rosslt.node.memory.remembered import MEMORY
from rosslt.node.memory.rounds import begins_round
from rosslt.node.namesake import where_it_runs
from rosslt.node.no_master import NO_MASTER
from rosslt.node.parameters.mirror import kept_of
from rosslt.node.parameters.others import LAUNCH, is_set, own_parameter_of
from rosslt.node.parameters.program import is_whole_parameter, parameter_was_set, serve_parameter, take_fractions
from rosslt.node.reconfigure import reconfigure_parameter
from rosslt.node.robot_description import NAME as ROBOT_DESCRIPTION
from rosslt.node.robot_description import (
    NO_ROBOT,
    Joint,
    Robot,
    Shape,
    check_joint_limits,
    check_number,
    description_for,
    robot_in,
)
from rosslt.node.rospy_internals import args_kwds_to_message, is_initialized
from rosslt.node.service_calls import NO_ANSWER, ask_all
from rosslt.node.slave_api import pid_of, published_types, sent_types
from rosslt.node.tf import counterparts as tf_counterparts
from rosslt.node.tf import functions as tf_functions
from rosslt.node.topics.listening import Heard, Listener, TopicReader
from rosslt.node.topics.services import Service, ServiceProxy
from rosslt.node.topics.topics import Publisher, Subscriber, has_its_provenance, wait_for_message
