"""Checks the bounds and the weight that the code gives a location; `location` checks its values against them."""

import math
from typing import Dict, Union

from rosslt import values
from rosslt.messages import Scalar


def checked_limits(minimum: Scalar, maximum: Scalar, weight: object) -> Dict[str, Union[int, float, None]]:
    """Bounds and weight of a location as plain numbers.

    Raises:
        TypeError: one is not a number.
        ValueError: one is not finite, the minimum is above the maximum, or the weight is not above 0.
    """
    limits: Dict[str, Union[int, float, None]] = {}
    for word, given in (('minimum', minimum), ('maximum', maximum), ('weight', weight)):
        limits[word] = None
        if given is None:
            continue
        number = values.plain_scalar(given)
        if type(number) not in (int, float):
            raise TypeError(f'{word}={given!r} is not a number: give an int, a float or None')
        if not math.isfinite(number):
            raise ValueError(f'{word}={given!r} is not a finite number; leave it out for no limit')
        limits[word] = number
    low, high, hard = limits['minimum'], limits['maximum'], limits['weight']
    if low is not None and high is not None and low > high:
        raise ValueError(f'minimum={low!r} is above maximum={high!r}: no value is in between')
    if hard is not None and hard <= 0:
        raise ValueError(f'weight={hard!r} has to be above 0')
    return limits
