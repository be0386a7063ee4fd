"""SLAM by an extended Kalman filter: a robot drives in a circle between landmarks that it does not know."""

import math

import numpy as np
from running import run

DT = 0.2
SPEED, TURN = 1.0, 0.25
LANDMARKS = np.array([[3.0, 1.0], [-2.0, 6.0], [4.0, 7.0], [0.0, -1.5]])
RANGE_NOISE, BEARING_NOISE = 0.05, 0.02
MOTION_NOISE = 0.02


def wrapped(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def moved(pose):
    x, y, yaw = pose
    return np.array([x + SPEED * DT * math.cos(yaw), y + SPEED * DT * math.sin(yaw), wrapped(yaw + TURN * DT)])


def compute():
    generator = np.random.RandomState(3)
    count = len(LANDMARKS)
    size = 3 + 2 * count
    state, P = np.zeros(size), np.zeros((size, size))
    P[3:, 3:] = np.eye(2 * count) * 100.0
    truth, seen = np.zeros(3), set()
    R = np.diag([RANGE_NOISE**2, BEARING_NOISE**2])
    for _ in range(60):
        truth = moved(truth)
        G = np.eye(size)
        G[0, 2] = -SPEED * DT * math.sin(state[2])
        G[1, 2] = SPEED * DT * math.cos(state[2])
        state[:3] = moved(state[:3])
        P = G @ P @ G.T
        P[:3, :3] += np.eye(3) * MOTION_NOISE**2
        for i, (lx, ly) in enumerate(LANDMARKS):
            distance = math.hypot(lx - truth[0], ly - truth[1]) + RANGE_NOISE * generator.randn()
            bearing = math.atan2(ly - truth[1], lx - truth[0]) - truth[2] + BEARING_NOISE * generator.randn()
            at = 3 + 2 * i
            if i not in seen:
                seen.add(i)
                state[at] = state[0] + distance * math.cos(bearing + state[2])
                state[at + 1] = state[1] + distance * math.sin(bearing + state[2])
            dx, dy = state[at] - state[0], state[at + 1] - state[1]
            q = dx * dx + dy * dy
            root = math.sqrt(q)
            H = np.zeros((2, size))
            H[:, :3] = [[-dx / root, -dy / root, 0.0], [dy / q, -dx / q, -1.0]]
            H[:, at : at + 2] = [[dx / root, dy / root], [-dy / q, dx / q]]
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            innovation = np.array([distance - root, wrapped(bearing - math.atan2(dy, dx) + state[2])])
            state = state + K @ innovation
            P = (np.eye(size) - K @ H) @ P
    assert np.linalg.norm(state[:2] - truth[:2]) < 0.5
    assert np.abs(state[3:].reshape(-1, 2) - LANDMARKS).max() < 0.7
    return state


if __name__ == '__main__':
    run(compute, 80)
