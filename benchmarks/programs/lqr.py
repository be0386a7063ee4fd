"""LQR for an inverted pendulum on a cart: the Riccati equation by iteration, and the motion under its gains."""

import numpy as np
from running import run

MASS_CART, MASS_POLE, LENGTH, GRAVITY = 1.0, 0.3, 2.0, 9.8
DT = 0.1
STATE_COST = [0.0, 1.0, 1.0, 0.0]
INPUT_COST = 0.01


def model():
    A = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, MASS_POLE * GRAVITY / MASS_CART, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, GRAVITY * (MASS_CART + MASS_POLE) / (LENGTH * MASS_CART), 0.0],
        ]
    )
    B = np.array([[0.0], [1.0 / MASS_CART], [0.0], [1.0 / (LENGTH * MASS_CART)]])
    return np.eye(4) + DT * A, DT * B


def gain(A, B, Q, R):
    P = Q
    for _ in range(150):
        following = A.T @ P @ A - A.T @ P @ B @ np.linalg.inv(R + B.T @ P @ B) @ B.T @ P @ A + Q
        if abs(following - P).max() < 0.001:
            break
        P = following
    return np.linalg.inv(B.T @ P @ B + R) @ (B.T @ P @ A)


def compute():
    A, B = model()
    K = gain(A, B, np.diag(STATE_COST), np.diag([INPUT_COST]))
    x = np.array([[0.0], [0.0], [0.3], [0.0]])
    for _ in range(50):
        u = -K @ x
        x = A @ x + B @ u
    assert abs(x[2, 0]) < 0.01
    return [K[0, 0], K[0, 1], K[0, 2], K[0, 3]]


if __name__ == '__main__':
    run(compute, 600)
