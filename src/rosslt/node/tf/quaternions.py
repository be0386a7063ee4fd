"""The usual functions of quaternions, for tracked values and plain ones.

Quaternions are sequences or messages with x, y, z and w, and come out as tuples, for `Quaternion(*q)`. The functions
have the names that they have in tf.transformations, which computes in NumPy's floats and so loses provenance.
"""

import functools
import operator
from typing import Any, Sequence, Tuple

from rosslt.values import MATH, is_tracked

Numbers = Tuple[Any, ...]

_sin, _cos, _atan2, _hypot = (MATH[name] for name in ('sin', 'cos', 'atan2', 'hypot'))

#: A quaternion this near to a pitch of +-90 degrees, relative to its length, does not determine roll and yaw.
_GIMBAL_LOCK = 1e-15


def quaternion_from_euler(roll: float, pitch: float, yaw: float) -> Numbers:
    """The quaternion of a rotation around the fixed axes x, then y, then z."""
    return quaternion_multiply(
        quaternion_about_axis(yaw, (0, 0, 1)),
        quaternion_multiply(quaternion_about_axis(pitch, (0, 1, 0)), quaternion_about_axis(roll, (1, 0, 0))),
    )


def euler_from_quaternion(quaternion: object) -> Numbers:
    """(roll, pitch, yaw) around the fixed axes x, then y, then z; any length of the quaternion will do."""
    (xx, _, _), (yx, yy, yz), (zx, zy, zz) = rotation_matrix(quaternion)
    level = _hypot(xx, yx)
    if level > _GIMBAL_LOCK * sum(part * part for part in _xyzw(quaternion)):
        return _atan2(zy, zz), _atan2(-zx, level), _atan2(yx, xx)
    return _atan2(-yz, yy), _atan2(-zx, level), 0.0


def quaternion_about_axis(angle: float, axis: object) -> Numbers:
    """The quaternion of a rotation by an angle around an axis, a sequence or message of any length but zero."""
    axis = _xyz(axis)
    length = _hypot(*axis)
    sine = _sin(angle / 2)
    return (*(products((sine, part / length)) for part in axis), _cos(angle / 2))


def quaternion_multiply(second: object, first: object) -> Numbers:
    """The rotation `first`, and then `second`."""
    (x2, y2, z2, w2), (x1, y1, z1, w1) = _xyzw(second), _xyzw(first)
    return (
        products((w2, x1), (x2, w1), (y2, z1), (-z2, y1)),
        products((w2, y1), (-x2, z1), (y2, w1), (z2, x1)),
        products((w2, z1), (x2, y1), (-y2, x1), (z2, w1)),
        products((w2, w1), (-x2, x1), (-y2, y1), (-z2, z1)),
    )


def quaternion_conjugate(quaternion: object) -> Numbers:
    """The rotation back, of a quaternion of length 1."""
    x, y, z, w = _xyzw(quaternion)
    return -x, -y, -z, w


def quaternion_inverse(quaternion: object) -> Numbers:
    """The rotation back, of a quaternion of any length but zero."""
    square = sum(part * part for part in _xyzw(quaternion))
    return tuple(part / square for part in quaternion_conjugate(quaternion))


def rotated(vector: object, quaternion: object) -> Numbers:
    """A vector, given as a sequence or message with x, y and z, turned by a quaternion of length 1: a tuple."""
    vector = _xyz(vector)
    return tuple(products(*zip(row, vector)) for row in rotation_matrix(quaternion))


def products(*pairs: Any) -> Any:
    """The sum of the products of pairs. A factor of a plain 0 is left out, so it does not become a source."""
    counting = [a * b for a, b in pairs if not (_is_zero(a) or _is_zero(b))]
    return functools.reduce(operator.add, counting) if counting else 0.0


def _is_zero(number: object) -> bool:
    return number == 0 and not is_tracked(number)


def _xyzw(quaternion: Any) -> Sequence[Any]:
    return (quaternion.x, quaternion.y, quaternion.z, quaternion.w) if hasattr(quaternion, 'w') else quaternion


def _xyz(vector: Any) -> Sequence[Any]:
    return (vector.x, vector.y, vector.z) if hasattr(vector, 'z') else vector


def rotation_matrix(quaternion: object) -> Tuple[Numbers, Numbers, Numbers]:
    """The rows of the rotation matrix of a quaternion of length 1, as KDL has them."""
    x, y, z, w = _xyzw(quaternion)
    return (
        (w * w + x * x - y * y - z * z, 2 * x * y - 2 * w * z, 2 * x * z + 2 * w * y),
        (2 * x * y + 2 * w * z, w * w - x * x + y * y - z * z, 2 * y * z - 2 * w * x),
        (2 * x * z - 2 * w * y, 2 * y * z + 2 * w * x, w * w - x * x - y * y + z * z),
    )
