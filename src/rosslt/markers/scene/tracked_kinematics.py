"""Forward kinematics of one point, with the provenance of the positions of the joints before it."""

import functools
from typing import Any, Iterable, List, Sequence, Tuple

from rosslt import node, values
from rosslt.markers.geometry import AXES, IDENTITY, Vector, rotate_vector
from rosslt.markers.scene.kinematics import turned

_SIN, _COS = values.MATH['sin'], values.MATH['cos']

#: Elements of a fixed rotation that are as near as this to 0, 1 or -1 are these: right angles have so many digits.
NOISE = 1e-12


def with_provenance(
    joints: Sequence[node.Joint], positions: Sequence[Any], point: Vector
) -> Tuple[List[Any], List[Any]]:
    """Return the position of a point behind joints, and its orientation, with the provenance of the joints' positions.

    The expressions are as short as can be, as they are solved with each step of a drag: the point is carried from joint
    to joint, and what is multiplied by 0 is left out.

    Args:
        joints: all before it, fixed ones included, from the outermost inward.
        positions: of each, tracked or plain; of fixed ones, anything.
        point: x, y and z behind the first joint, in metres.

    Returns:
        (x, y and z, the quaternion), in the frame that the last joint is fixed to.
    """
    place: List[Any] = list(point)
    rotation: List[Any] = list(IDENTITY)
    for joint, position in zip(joints, positions):
        if joint.is_turning:
            place = _turned_about(joint.axis, _SIN(position), _COS(position), place)
            sine = _SIN(0.5 * position)
            rotation = _product([_times(part, sine) for part in joint.axis] + [_COS(0.5 * position)], rotation)
        elif not joint.is_fixed:
            place = [_plus(at, _times(part, position)) for at, part in zip(place, joint.axis)]
        place = [_sum(map(_times, row, place)) for row in _matrix(joint.roll_pitch_yaw)]
        place = list(map(_plus, place, joint.position))
        rotation = _product(turned(joint.roll_pitch_yaw), rotation)
    return place, rotation


def _turned_about(axis: Vector, sine: Any, cosine: Any, vector: Sequence[Any]) -> List[Any]:
    """A vector turned about an axis of length 1 (Rodrigues' formula)."""
    a, b, c = axis
    cross = ((0.0, -c, b), (c, 0.0, -a), (-b, a, 0.0))
    result = []
    for row in range(3):
        parts = []
        for column, value in enumerate(vector):
            both = axis[row] * axis[column]
            factor = _plus(_times(cosine, float(row == column) - both), both)
            parts.append(_times(_plus(factor, _times(sine, cross[row][column])), value))
        result.append(_sum(parts))
    return result


@functools.lru_cache(maxsize=None)
def _matrix(roll_pitch_yaw: Vector) -> Tuple[Tuple[float, ...], ...]:
    """The rows of the rotation of a URDF's `rpy`; right angles give 0, 1 and -1."""
    columns = [rotate_vector(turned(roll_pitch_yaw), axis) for axis in AXES]
    return tuple(tuple(map(_without_noise, row)) for row in zip(*columns))


def _without_noise(part: float) -> float:
    return round(part) + 0.0 if abs(part - round(part)) < NOISE else part


def _product(first: Sequence[Any], second: Sequence[Any]) -> List[Any]:
    """The rotation `second`, then `first`."""
    ax, ay, az, aw = first
    bx, by, bz, bw = second
    return [
        _sum([_times(aw, bx), _times(ax, bw), _times(ay, bz), _minus(_times(az, by))]),
        _sum([_times(aw, by), _minus(_times(ax, bz)), _times(ay, bw), _times(az, bx)]),
        _sum([_times(aw, bz), _times(ax, by), _minus(_times(ay, bx)), _times(az, bw)]),
        _sum([_times(aw, bw), _minus(_times(ax, bx)), _minus(_times(ay, by)), _minus(_times(az, bz))]),
    ]


def _times(first: Any, second: Any) -> Any:
    for one, other in ((first, second), (second, first)):
        if type(one) is float and one in (0.0, 1.0):
            return other if one else 0.0
    return first * second


def _plus(first: Any, second: Any) -> Any:
    for one, other in ((first, second), (second, first)):
        if type(one) is float and one == 0.0:
            return other
    return first + second


def _minus(number: Any) -> Any:
    return 0.0 if type(number) is float and number == 0.0 else -number


def _sum(parts: Iterable[Any]) -> Any:
    total: Any = 0.0
    for part in parts:
        total = _plus(total, part)
    return total
