"""A Kalman filter for a cart with constant acceleration: matrices of NumPy that are carried on from step to step."""

import numpy as np
from running import run

DT = 0.1
PROCESS_NOISE = 0.05
MEASUREMENT_NOISE = 0.4
ACCELERATION = 0.3


def compute():
    generator = np.random.RandomState(1)
    F = np.array([[1.0, DT], [0.0, 1.0]])
    B = np.array([[0.5 * DT**2], [DT]])
    H = np.array([[1.0, 0.0]])
    Q = np.diag([PROCESS_NOISE * DT, PROCESS_NOISE])
    R = np.array([[MEASUREMENT_NOISE**2]])
    x, P = np.zeros((2, 1)), np.eye(2)
    truth = np.zeros((2, 1))
    for _ in range(200):
        truth = F @ truth + B * ACCELERATION
        z = H @ truth + MEASUREMENT_NOISE * generator.randn(1, 1)
        x = F @ x + B * ACCELERATION
        P = F @ P @ F.T + Q
        S = H @ P @ H.T + R
        K = P @ H.T @ np.linalg.inv(S)
        x = x + K @ (z - H @ x)
        P = (np.eye(2) - K @ H) @ P
    assert abs(x[0, 0] - truth[0, 0]) < 1.0
    assert np.all(np.linalg.eigvalsh((P + P.T) / 2) > 0)
    return [x[0, 0], x[1, 0], P[0, 0]]


if __name__ == '__main__':
    run(compute, 120)
