"""The room of models: what nodes do that nobody tracks, known or learned by trying.

It may import the rooms `flow`, `script`, `instrument`, `node`, `messages`, `files` and `values`, rospy, NumPy and
SciPy.
"""

from rosslt.models.learned import Dependency, Learned
from rosslt.models.trials import learn
