"""The room of flows: which location reaches which field of which topic, through which nodes.

It may import the rooms `node`, `messages` and `values`, and rospy. The command prints a flow, the page shows it live.
"""

from rosslt.flow.drawing import NotDrawn, dot, svg
from rosslt.flow.flow import Flow, Step
from rosslt.flow.provenance_map import ProvenanceMap, brief
