"""The `.msg` files of message types: where they lie, and the generator that writes those of tracked types."""

from rosslt.messages.msg_files.definitions import MessagePath
from rosslt.messages.msg_files.generator import plan_files, select_types, tracked_names, write_files
