"""The room of what nodes do that nobody tracks: it finds the process of a running node, and plays messages to a copy.

It may import all rooms below it, and rospy. The command learns from a copy how outputs depend on inputs.
"""

from rosslt.models.processes import LiveProcess, NotCopied, live_process
from rosslt.models.twin import Twin, TwinFailed
