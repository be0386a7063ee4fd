"""The room of models: what nodes do that nobody tracks, known or learned by trying.

It may import the rooms `flow`, `script`, `instrument`, `node`, `messages`, `files` and `values`, rospy, NumPy and
SciPy. Nothing here imports `node`: the process of a twin loads this door without the messages that are built.
"""

from rosslt.models.following import Following, LocalModel, Moment, NotFollowed, followed_things
from rosslt.models.fresh import Fresh, fresh_of
from rosslt.models.kept import File, Kept, Version, version_of
from rosslt.models.kept_files import BadFile, keep, kept_files, kept_of, read_kept
from rosslt.models.learned import Dependency, Learned
from rosslt.models.learning import Answer, NotLearned, learn_node
from rosslt.models.processes import LiveProcess, NotCopied, live_process
from rosslt.models.raw_messages import NotBuilt
from rosslt.models.replays import Number, Recording, record, recorded
from rosslt.models.trials import learn
from rosslt.models.twin import Twin, TwinFailed
