"""Iterative closest points: two clouds of a plane are laid on each other by singular value decompositions."""

import math

import numpy as np
from running import run

ANGLE, SHIFT = 0.1, (0.4, -0.3)
POINTS = 80
TOLERANCE = 1e-6


def compute():
    generator = np.random.RandomState(2)
    previous = (generator.rand(2, POINTS) - 0.5) * 20.0
    turn = np.array([[math.cos(ANGLE), -math.sin(ANGLE)], [math.sin(ANGLE), math.cos(ANGLE)]])
    current = turn @ previous + np.array(SHIFT).reshape(2, 1)
    H, error, before = np.eye(3), math.inf, math.inf
    for _ in range(40):
        distances = np.linalg.norm(np.repeat(current, POINTS, axis=1) - np.tile(previous, (1, POINTS)), axis=0).reshape(
            POINTS, POINTS
        )
        nearest = np.argmin(distances, axis=1)
        matched = previous[:, nearest]
        mean_m, mean_c = np.mean(matched, axis=1), np.mean(current, axis=1)
        W = (current - mean_c[:, np.newaxis]) @ (matched - mean_m[:, np.newaxis]).T
        u, _, vt = np.linalg.svd(W)
        R = (u @ vt).T
        t = mean_m - R @ mean_c
        current = R @ current + t[:, np.newaxis]
        step = np.eye(3)
        step[:2, :2], step[:2, 2] = R, t
        H = step @ H
        error = np.sum(np.linalg.norm(current - previous[:, nearest], axis=0))
        if abs(before - error) < TOLERANCE:
            break
        before = error
    assert error < 1e-3
    assert abs(math.atan2(H[1, 0], H[0, 0]) + ANGLE) < 1e-3
    return [H[0, 2], H[1, 2], math.atan2(H[1, 0], H[0, 0])]


if __name__ == '__main__':
    run(compute, 700)
