"""How often `solve` finds the joints of an arm for a pose within reach, and how long that takes, beside IK solvers.

Run as `./run bench ik [--poses N] [--robot NAME ...] [--seed N]`.

It is measured as the authors of TRAC-IK do (Beeson and Ames, Humanoids 2015): the pose of the tip is computed at random
joint values within the limits, and the search starts from the middle of the limits. A joint without limits has those of
one turn to each side. `solve` is given the forward kinematics as expressions of tracked joints: three positions and
nine elements of the rotation. An answer is right if it misses none of the twelve by more than 1e-5 (metres, or 1) and
is within the limits.

KDL's Newton-Raphson with joint limits and TRAC-IK, if they are installed, are asked for the same poses. Beside the
rates stand those that the authors of TRAC-IK publish, of chains that may have other limits and tips.
"""

import argparse
import functools
import math as plain_math
import os
import random
import sys
import time
import xml.etree.ElementTree as ElementTree
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

from rosslt import NotInvertible, Source, math, solve, track

sys.path.append(os.environ['ROSSLT_IK_PATH'])
ROBOTS = os.path.join(os.environ['ROSSLT_IK_PATH'], 'cmeel.prefix/share/example-robot-data/robots')

CHAINS = {
    'Panda': ('panda_description/urdf/panda.urdf', 'panda_link0', 'panda_link8', 99.49, 61.52),
    'UR5': ('ur_description/urdf/ur5_robot.urdf', 'base_link', 'ee_link', 99.64, 32.23),
    'UR10': ('ur_description/urdf/ur10_robot.urdf', 'base_link', 'ee_link', 99.68, 30.67),
    'UR3': ('ur_description/urdf/ur3_robot.urdf', 'base_link', 'ee_link', 99.34, 34.12),
    'Jaco2': (
        'kinova_description/robots/kinova.urdf',
        'j2s6s200_link_base',
        'j2s6s200_end_effector',
        99.61,
        26.22,
    ),
    'Baxter': ('baxter_description/urdf/baxter.urdf', 'left_arm_mount', 'left_wrist', 99.44, 60.98),
    'PR2': ('pr2_description/urdf/pr2.urdf', 'torso_lift_link', 'r_wrist_roll_link', 99.97, 82.92),
}
"""The file, the base, the tip, and the published rates of TRAC-IK and of KDL, in percent."""

EXACT = 1e-5
"""In metres, and in elements of the rotation."""

TIMEOUT = 0.005
"""For TRAC-IK, in seconds: that of its authors."""

Matrix = List[List[Any]]


class Joint(NamedTuple):
    """A joint: its place in its parent, and its axis and limits if it moves."""

    rotation: Matrix
    position: List[float]
    kind: str
    axis: List[float]
    low: float
    high: float


def numbers(text: Optional[str], default: str) -> List[float]:
    """The numbers of an attribute."""
    return [float(part) for part in (text or default).split()]


def times(one: Matrix, other: Matrix) -> Matrix:
    """The product of two matrices; what is multiplied by a constant 0 is left out."""
    return [[dot(row, column) for column in zip(*other)] for row in one]


def dot(row: Sequence[Any], column: Sequence[Any]) -> Any:
    """The inner product."""
    total: Any = 0.0
    for a, b in zip(row, column):
        if (type(a) is float and a == 0.0) or (type(b) is float and b == 0.0):
            continue
        part = b if type(a) is float and a == 1.0 else a if type(b) is float and b == 1.0 else a * b
        total = part if type(total) is float and total == 0.0 else total + part
    return total


def about(axis: Sequence[float], sine: Any, cosine: Any) -> Matrix:
    """The rotation about an axis of length 1 (Rodrigues)."""
    x, y, z = axis
    across = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    along = [[a * b for b in axis] for a in axis]
    rest = [[(1.0 if i == j else 0.0) - along[i][j] for j in range(3)] for i in range(3)]
    return [[dot([along[i][j], rest[i][j], across[i][j]], [1.0, cosine, sine]) for j in range(3)] for i in range(3)]


def cleaned(matrix: Matrix) -> Matrix:
    """A constant matrix without what rounding has made of a cosine of pi / 2."""
    return [[float(round(part)) if abs(part - round(part)) < 1e-9 else part for part in row] for row in matrix]


def read(name: str, base: str, tip: str) -> List[Joint]:
    """The joints of a URDF between two links."""
    joints = {joint.find('child').get('link'): joint for joint in ElementTree.parse(name).getroot().findall('joint')}
    found = []
    while tip != base:
        joint = joints[tip]
        tip = joint.find('parent').get('link')
        origin = joint.find('origin')
        attributes = {} if origin is None else origin.attrib
        roll, pitch, yaw = numbers(attributes.get('rpy'), '0 0 0')
        turns = [
            about(axis, plain_math.sin(angle), plain_math.cos(angle))
            for axis, angle in (([0.0, 0.0, 1.0], yaw), ([0.0, 1.0, 0.0], pitch), ([1.0, 0.0, 0.0], roll))
        ]
        axis = joint.find('axis')
        limit = joint.find('limit')
        kind = joint.get('type')
        low, high = -2 * plain_math.pi, 2 * plain_math.pi
        if kind != 'continuous' and limit is not None:
            low, high = float(limit.get('lower', '0')), float(limit.get('upper', '0'))
        found.append(
            Joint(
                cleaned(times(times(turns[0], turns[1]), turns[2])),
                numbers(attributes.get('xyz'), '0 0 0'),
                kind,
                numbers(None if axis is None else axis.get('xyz'), '1 0 0'),
                low,
                high,
            )
        )
    return found[::-1]


def pose(chain: List[Joint], values: Sequence[Any], sin: Callable, cos: Callable) -> List[Any]:
    """The tip's position and the elements of its rotation, row by row."""
    rotation: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    position: List[Any] = [0.0, 0.0, 0.0]
    rest = iter(values)
    for joint in chain:
        offset: List[Any] = list(joint.position)
        local = joint.rotation
        if joint.kind in ('revolute', 'continuous'):
            value = next(rest)
            local = times(joint.rotation, about(joint.axis, sin(value), cos(value)))
        elif joint.kind == 'prismatic':
            value = next(rest)
            offset = [a + dot(row, [value * part for part in joint.axis]) for a, row in zip(offset, joint.rotation)]
        position = [dot([a, *row], [1.0, *offset]) for a, row in zip(position, rotation)]
        rotation = times(rotation, local)
    return [*position, *[part for row in rotation for part in row]]


class Arm:
    """A chain, and the expressions of its forward kinematics in the middle of the limits.

    Args:
        chain: its joints.
    """

    def __init__(self, chain: List[Joint]) -> None:
        self.chain = chain
        self.limits = [(joint.low, joint.high) for joint in chain if joint.kind != 'fixed']
        self.middle = [(low + high) / 2 for low, high in self.limits]
        self.joints = [Source('/joints', number) for number in range(len(self.limits))]
        self.bounds = dict(zip(self.joints, self.limits))
        tracked = [track(value, source) for value, source in zip(self.middle, self.joints)]
        self.tip = pose(chain, tracked, math.sin, math.cos)

    def at(self, values: Sequence[float]) -> List[float]:
        """The tip's pose."""
        return [float(part) for part in pose(self.chain, values, plain_math.sin, plain_math.cos)]

    def is_right(self, values: Sequence[float], wanted: Sequence[float]) -> bool:
        """Return True if joint values give a pose, within the limits."""
        if not all(low - 1e-9 <= value <= high + 1e-9 for value, (low, high) in zip(values, self.limits)):
            return False
        return all(abs(a - b) <= EXACT for a, b in zip(self.at(values), wanted))


Solver = Callable[[List[float]], Optional[List[float]]]


def with_rosslt(arm: Arm) -> Solver:
    """`solve`."""

    def answer(wanted: List[float]) -> Optional[List[float]]:
        try:
            found = solve(arm.tip, wanted, bounds=arm.bounds)
        except NotInvertible:
            return None
        return [found.get(source, value) for source, value in zip(arm.joints, arm.middle)]

    return answer


def with_kdl(arm: Arm) -> Solver:
    """KDL's Newton-Raphson with joint limits."""
    import PyKDL

    def frame(rotation: Matrix, position: Sequence[float]) -> Any:
        return PyKDL.Frame(PyKDL.Rotation(*[part for row in rotation for part in row]), PyKDL.Vector(*position))

    kdl = PyKDL.Chain()
    for joint in arm.chain:
        at = frame(joint.rotation, joint.position)
        if joint.kind == 'fixed':
            kdl.addSegment(PyKDL.Segment(PyKDL.Joint(PyKDL.Joint.Fixed), at))
            continue
        kdl.addSegment(PyKDL.Segment(PyKDL.Joint(PyKDL.Joint.Fixed), at))
        kind = PyKDL.Joint.TransAxis if joint.kind == 'prismatic' else PyKDL.Joint.RotAxis
        moving = PyKDL.Joint('joint', PyKDL.Vector(0, 0, 0), PyKDL.Vector(*joint.axis), kind)
        kdl.addSegment(PyKDL.Segment(moving, PyKDL.Frame()))

    def array(values: Sequence[float]) -> Any:
        result = PyKDL.JntArray(len(values))
        for place, value in enumerate(values):
            result[place] = value
        return result

    forward = PyKDL.ChainFkSolverPos_recursive(kdl)
    velocity = PyKDL.ChainIkSolverVel_pinv(kdl)
    low, high = array([low for low, _ in arm.limits]), array([high for _, high in arm.limits])
    solver = PyKDL.ChainIkSolverPos_NR_JL(kdl, low, high, forward, velocity, 100, EXACT)
    kept = kdl, forward, velocity, low, high  # the solver refers to them, and does not keep them

    def answer(wanted: List[float]) -> Optional[List[float]]:
        assert kept
        result = PyKDL.JntArray(len(arm.limits))
        rows = [wanted[3 * row : 3 * row + 3] for row in (1, 2, 3)]
        if solver.CartToJnt(array(arm.middle), frame(rows, wanted[:3]), result) < 0:
            return None
        return [result[place] for place in range(len(arm.limits))]

    return answer


def with_trac_ik(arm: Arm, name: str, base: str, tip: str) -> Solver:
    """TRAC-IK, which knows the limits from the URDF."""
    import numpy
    from trac_ik import TracIK

    solver = TracIK(base, tip, name, TIMEOUT, EXACT)
    solver.joint_limits = [low for low, _ in arm.limits], [high for _, high in arm.limits]
    start = numpy.array(arm.middle)

    def answer(wanted: List[float]) -> Optional[List[float]]:
        found = solver.ik(numpy.array(wanted[:3]), numpy.array(wanted[3:]).reshape(3, 3), start)
        return None if found is None else [float(value) for value in found]

    return answer


def measured(arm: Arm, poses: List[List[float]], solver: Solver) -> Tuple[float, int, List[float]]:
    """The rate of right answers in percent, the number of wrong ones, and the times in seconds, sorted."""
    right = wrong = 0
    times_taken = []
    for wanted in poses:
        start = time.perf_counter()
        found = solver(wanted)
        times_taken.append(time.perf_counter() - start)
        if found is not None:
            is_right = arm.is_right(found, wanted)
            right += is_right
            wrong += not is_right
    return 100.0 * right / len(poses), wrong, sorted(times_taken)


def row(robot: str, name: str, published: str, result: Tuple[float, int, List[float]]) -> None:
    """Print one line of the table."""
    rate, wrong, taken = result
    median, late, worst = taken[len(taken) // 2], taken[int(0.95 * (len(taken) - 1))], taken[-1]
    print(
        '%-8s %-8s %8.2f %10s %6d %9.2f %9.2f %9.2f'
        % (robot, name, rate, published, wrong, median * 1e3, late * 1e3, worst * 1e3),
        flush=True,
    )


def drag_steps(arm: Arm, target: Sequence[float]) -> List[float]:
    """The times of a drag of the tip's position, 100 steps straight to another pose, in seconds, sorted."""
    from rosslt.values.solve import continued

    taken = []
    last: Dict[Source, Any] = {}
    begin = arm.at(arm.middle)[:3]
    for number in range(1, 101):
        wanted = [a + number / 100 * (b - a) for a, b in zip(begin, target[:3])]
        start = time.perf_counter()
        try:
            last = continued(arm.tip[:3], wanted, last, bounds=arm.bounds)
        except NotInvertible:
            break
        taken.append(time.perf_counter() - start)
    return sorted(taken)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--poses', type=int, default=1000)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--robot', nargs='*', default=list(CHAINS), choices=list(CHAINS))
    options = parser.parse_args()
    print(
        '%-8s %-8s %8s %10s %6s %9s %9s %9s' % ('', '', 'right %', 'published', 'wrong', 'median ms', '95 %', 'worst')
    )
    for robot in options.robot:
        path, base, tip, published, published_kdl = CHAINS[robot]
        name = os.path.join(ROBOTS, path)
        arm = Arm(read(name, base, tip))
        chance = random.Random(options.seed)
        poses = [arm.at([chance.uniform(*limits) for limits in arm.limits]) for _ in range(options.poses)]
        row(robot, 'rosslt', '', measured(arm, poses, with_rosslt(arm)))
        for label, make, rate in (
            ('TRAC-IK', functools.partial(with_trac_ik, arm, name, base, tip), published),
            ('KDL', functools.partial(with_kdl, arm), published_kdl),
        ):
            try:
                solver = make()
            except ImportError as error:
                print('%-8s %-8s %s' % (robot, label, error))
                continue
            row(robot, label, '%.2f' % rate, measured(arm, poses, solver))
        steps = [step for wanted in poses[:10] for step in drag_steps(arm, wanted)]
        steps.sort()
        if steps:
            print(
                '%-8s %-34s %9.2f %9.2f %9.2f'
                % (
                    robot,
                    'a step of a drag of the position',
                    *[1e3 * steps[int(part * (len(steps) - 1))] for part in (0.5, 0.95, 1)],
                )
            )


if __name__ == '__main__':
    main()
