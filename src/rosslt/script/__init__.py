"""The room of live scripts: number literals in a text file as locations, written back (paper, section I-A).

The paper's `interactive_script`. It may import the rooms `node`, `files` and `values`, and rospy. From the bottom up:
`execution` makes steps of a text, and `live` keeps the text in force, with a location for each number. `player` goes
through the steps in time, and `nodes` is what makes a node of it. `parameters` does the same for waypoints in ROS
parameters.
"""

from rosslt.script.live import LiveScript, ScriptError, Settings
from rosslt.script.nodes import run, run_parameters
