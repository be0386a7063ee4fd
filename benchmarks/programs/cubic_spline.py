"""Natural cubic splines through waypoints: a linear system of NumPy, and points in plain Python."""

import bisect
import math

import numpy as np
from running import run

XS = [-2.5, 0.0, 2.5, 5.0, 7.5, 3.0, -1.0]
YS = [0.7, -6.0, 5.0, 6.5, 0.0, 5.0, -2.0]
SPACING = 0.1


class Spline:
    def __init__(self, at, values):
        self.at = at
        steps = np.diff(at)
        count = len(at)
        A, B = np.zeros((count, count)), np.zeros(count)
        A[0, 0] = A[-1, -1] = 1.0
        for i in range(1, count - 1):
            A[i, i - 1], A[i, i], A[i, i + 1] = steps[i - 1], 2.0 * (steps[i - 1] + steps[i]), steps[i]
            B[i] = 3.0 * (values[i + 1] - values[i]) / steps[i] - 3.0 * (values[i] - values[i - 1]) / steps[i - 1]
        self.a = values
        self.c = np.linalg.solve(A, B)
        self.b, self.d = [], []
        for i in range(count - 1):
            self.d.append((self.c[i + 1] - self.c[i]) / (3.0 * steps[i]))
            self.b.append((values[i + 1] - values[i]) / steps[i] - steps[i] * (2.0 * self.c[i] + self.c[i + 1]) / 3.0)

    def value(self, t):
        i = min(bisect.bisect(self.at, t) - 1, len(self.b) - 1)
        dt = t - self.at[i]
        return self.a[i] + self.b[i] * dt + self.c[i] * dt**2 + self.d[i] * dt**3

    def slope(self, t):
        i = min(bisect.bisect(self.at, t) - 1, len(self.b) - 1)
        dt = t - self.at[i]
        return self.b[i] + 2.0 * self.c[i] * dt + 3.0 * self.d[i] * dt**2


def compute():
    at = [0.0]
    for (x, y), (nx, ny) in zip(zip(XS, YS), zip(XS[1:], YS[1:])):
        at.append(at[-1] + math.hypot(nx - x, ny - y))
    sx, sy = Spline(at, XS), Spline(at, YS)
    points = []
    for t in np.arange(0, at[-1], SPACING):
        points.append((sx.value(t), sy.value(t), math.atan2(sy.slope(t), sx.slope(t))))
    assert abs(points[0][0] - XS[0]) < 1e-9
    assert math.hypot(points[-1][0] - XS[-1], points[-1][1] - YS[-1]) < 0.3
    return [number for point in points[:20] for number in point]


if __name__ == '__main__':
    run(compute, 400)
