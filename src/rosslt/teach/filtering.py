"""A filter against a hand that trembles."""

import math
from typing import Sequence, Tuple

from rosslt.markers.geometry import Vector, product
from rosslt.teach.turning import rotation_of, rotation_vector, scaled

#: The time constant of the mean lag, in seconds: shorter than a hand takes to set off, longer than it takes to tremble.
AVERAGING = 0.1

#: The mean lags that speed the filter up, in metres and in radians: five times the jitter of a usual tracker.
LAGS = (0.01, 0.05)

#: The rate of the filter, of 1/s, that a mean lag as long as one of LAGS adds.
RATE = 30.0

#: The longest time that one sample stands for, in seconds: after a gap, its jitter is not the mean of the gap.
LONGEST = 0.05


class Filter:
    """A low pass whose cutoff rises with the speed: slow at rest, where a hand trembles, and fast as it moves.

    It is the One Euro filter of Casiez, Roussel and Vogel, CHI 2012, for positions and rotations, with two changes.
    Theirs takes the speed from the distance between the sample and the filtered value over the period, which depends
    on the rate of the samples; here, that distance, the lag, is the measure itself. And the cutoff rises with its third
    power instead of linearly: a linear one that lags by 80 ms at 0.25 m/s lets a jitter of 2 mm pass with 0.4 mm.

    The filtered value begins as the first sample, and moves by the steps that come out.

    Args:
        constant: the time constant at rest, in seconds, above 0.
    """

    def __init__(self, constant: float) -> None:
        self._constant = constant
        self._lags: Tuple[Vector, Vector] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self._means = self._lags

    def step(self, move: Vector, turn: Vector, seconds: float) -> Tuple[Vector, Vector]:
        """The step of the filtered value for one of the samples.

        Args:
            move: in metres.
            turn: the axis of a rotation, as long as its angle in radians.
            seconds: since the sample before, above 0.
        """
        seconds = min(seconds, LONGEST)
        lags = (
            _sum(self._lags[0], move),
            rotation_vector(product(rotation_of(turn), rotation_of(self._lags[1]))),
        )
        weight = seconds / (seconds + AVERAGING)
        self._means = (
            _sum(scaled(self._means[0], 1.0 - weight), scaled(lags[0], weight)),
            _sum(scaled(self._means[1], 1.0 - weight), scaled(lags[1], weight)),
        )
        shares = [self._share(mean, unit, seconds) for mean, unit in zip(self._means, LAGS)]
        self._lags = scaled(lags[0], 1.0 - shares[0]), scaled(lags[1], 1.0 - shares[1])
        return scaled(lags[0], shares[0]), scaled(lags[1], shares[1])

    def _share(self, mean: Sequence[float], unit: float, seconds: float) -> float:
        """Return the share of a lag that is made up for."""
        passed = seconds * (1.0 / self._constant + RATE * (math.sqrt(sum(one * one for one in mean)) / unit) ** 3)
        return passed / (1.0 + passed)


def _sum(first: Vector, second: Vector) -> Vector:
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]
