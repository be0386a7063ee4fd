"""The room of messages: which fields of a message are tracked, and how does their provenance travel?

It may import `values`, genpy, genmsg and rospkg. Its door is this module.

- `fields`: what the fields of a message class are; `walkers`: code compiled for the class that walks them.
- `field_path`: parts of messages by the paths that people write, and what they can hold.
- `codec`: provenance as bytes (docs/wire_format.md); `inband` and `tracked_types`: how these travel with a message.
- `sampling`: which messages are whole, and the last provenance of each thing for those between.
- `msg_files`: the generator of tracked message types.
"""

from rosslt.messages.codec import NO_READINGS, SAMPLED, Readings, attach, encode, make_unknown
from rosslt.messages.errors import BadHeader, UnknownType
from rosslt.messages.field_path import (
    NoSuchPart,
    as_held,
    check_range,
    distance,
    is_reached,
    is_sent_as,
    lacks,
    part_at,
    path_steps,
    topic_in,
)
from rosslt.messages.fields import Message, MessageClass, Scalar, kind_of, limits_of, whole_numbers
from rosslt.messages.inband import Found, append_provenance, decode, decoder, read_tracked, split_provenance
from rosslt.messages.leaves import has_tracked_leaf, set_leaves, tracked_fields
from rosslt.messages.msg_files import MessagePath, plan_files, select_types, tracked_names, write_files
from rosslt.messages.numpy_arrays import packed_arrays
from rosslt.messages.sampling import MOST_THINGS, LastProvenance, SampledProvenance, form_of, thing_of
from rosslt.messages.tracked_types import is_tracked_type, plain_type, tracked_type, unwrap, wrap
from rosslt.messages.walkers import has_arrays
