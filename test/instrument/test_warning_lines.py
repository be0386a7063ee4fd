"""What a node is warned of names its own line, in the same words and as often as without tracking."""

import pytest

from support.unmodified import Unmodified

WARNED = """
import warnings
import numpy as np
class Robot:
    def __init__(self):
        self.x, self.none = 1.5, 0.0
        self.spread = np.array([1.0, 2.0])
robot = Robot()
robot.spread = robot.spread * robot.none
for turn in range(3):
    print(np.float64(2) / robot.none)
    print(np.log(robot.none)), print(np.log(robot.spread))
    print(robot.x / robot.spread)
    print(1 / robot.spread)
    print(np.sqrt([-robot.x]))
    print(np.linspace(0, 1, 3) / 0)
    print(np.mean([]))
    warnings.warn('the battery is low')
with warnings.catch_warnings():
    warnings.simplefilter('ignore')
    print(robot.x / robot.spread)
try:
    with np.errstate(divide='raise'):
        print(robot.x / robot.spread)
except FloatingPointError as error:
    print(error)
try:
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        print(robot.x / robot.spread)
except RuntimeWarning as error:
    print(error)
"""


@pytest.mark.parametrize(('setting', 'divisions'), [('default', 5), ('always', 18), ('once', 3), ('ignore', 0)])
def test_warnings_name_the_same_lines_as_without_tracking(tmp_path, setting, divisions):
    plain, tracked = (
        Unmodified(tmp_path, 'warned', WARNED.lstrip(), tracked=is_tracked, PYTHONWARNINGS=setting).end()
        for is_tracked in (False, True)
    )
    assert tracked == plain
    assert plain[0] == 0
    assert plain[2].count('divide by zero') == divisions
