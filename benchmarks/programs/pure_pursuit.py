"""Pure pursuit of a path by a bicycle model, with PID for its speed, in plain Python."""

import math

from running import run

WHEELBASE = 2.9
GAIN = 0.1
LOOK_AHEAD = 2.0
SPEED_GAIN = 1.0
TARGET_SPEED = 10.0 / 3.6
DT = 0.1


class State:
    def __init__(self, x=0.0, y=-3.0, yaw=0.0, v=0.0):
        self.x, self.y, self.yaw, self.v = x, y, yaw, v

    def update(self, a, delta):
        self.x += self.v * math.cos(self.yaw) * DT
        self.y += self.v * math.sin(self.yaw) * DT
        self.yaw += self.v / WHEELBASE * math.tan(delta) * DT
        self.v += a * DT


def compute():
    path = [(i * 0.5, math.sin(i * 0.5 / 5.0) * i * 0.5 / 2.0) for i in range(100)]
    state = State()
    index = 0
    for _ in range(150):
        while index < len(path) - 1:
            now = math.hypot(path[index][0] - state.x, path[index][1] - state.y)
            following = math.hypot(path[index + 1][0] - state.x, path[index + 1][1] - state.y)
            if now < following:
                break
            index += 1
        ahead = GAIN * state.v + LOOK_AHEAD
        target = index
        while target < len(path) - 1 and math.hypot(path[target][0] - state.x, path[target][1] - state.y) < ahead:
            target += 1
        alpha = math.atan2(path[target][1] - state.y, path[target][0] - state.x) - state.yaw
        delta = math.atan2(2.0 * WHEELBASE * math.sin(alpha) / ahead, 1.0)
        state.update(SPEED_GAIN * (TARGET_SPEED - state.v), delta)
    assert state.x > 20.0
    return [state.x, state.y, state.yaw, state.v]


if __name__ == '__main__':
    run(compute, 2500)
