"""The room of messages: which fields of a message are tracked, and how does their provenance travel?

It may import `values`, genpy, genmsg and rospkg. Its door is this module. A message type is known once, as code
compiled for it (`walkers`); `wire` writes the wire format that docs/wire_format.md describes, `received` reads it.
"""

from rosslt.messages.columns import BadHeader
from rosslt.messages.definitions import UnknownType
from rosslt.messages.generator import main as generate_tracked_msgs
from rosslt.messages.inband import MAGIC, append_provenance, finder, plain_check, split_provenance
from rosslt.messages.leaves import tracked_leaves, with_leaves
from rosslt.messages.paper_header import LocationHeader, PaperIds
from rosslt.messages.paper_reading import from_paper_header
from rosslt.messages.paper_writing import to_paper_header
from rosslt.messages.received import attach
from rosslt.messages.tracked_types import is_tracked_type, plain_type, tracked_type, unwrap, wrap
from rosslt.messages.walkers import tracked_fields
from rosslt.messages.wire import encode

__all__ = [
    'MAGIC',
    'BadHeader',
    'LocationHeader',
    'PaperIds',
    'UnknownType',
    'append_provenance',
    'attach',
    'encode',
    'finder',
    'from_paper_header',
    'generate_tracked_msgs',
    'is_tracked_type',
    'plain_check',
    'plain_type',
    'split_provenance',
    'to_paper_header',
    'tracked_fields',
    'tracked_leaves',
    'tracked_type',
    'unwrap',
    'with_leaves',
    'wrap',
]
