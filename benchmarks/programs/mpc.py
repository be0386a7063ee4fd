"""Model predictive control of a double integrator by gradient descent, in plain Python."""

from running import run

DT = 0.1
HORIZON = 25
GOAL = 1.0
WEIGHT_POSITION, WEIGHT_SPEED, WEIGHT_INPUT = 1.0, 0.2, 0.05
LIMIT = 1.5
STEP = 0.05


def rollout(position, speed, inputs):
    states = []
    for u in inputs:
        position = position + speed * DT
        speed = speed + u * DT
        states.append((position, speed))
    return states


def gradient(states, inputs):
    slopes = [0.0] * len(inputs)
    of_position = of_speed = 0.0
    for k in reversed(range(len(inputs))):
        position, speed = states[k]
        of_speed = of_speed + of_position * DT + 2.0 * WEIGHT_SPEED * speed
        of_position = of_position + 2.0 * WEIGHT_POSITION * (position - GOAL)
        slopes[k] = of_speed * DT + 2.0 * WEIGHT_INPUT * inputs[k]
    return slopes


def compute():
    position, speed = 0.0, 0.0
    inputs = [0.0] * HORIZON
    for _ in range(12):
        for _ in range(30):
            slopes = gradient(rollout(position, speed, inputs), inputs)
            inputs = [max(-LIMIT, min(LIMIT, u - STEP * slope)) for u, slope in zip(inputs, slopes)]
        position, speed = rollout(position, speed, inputs[:1])[0]
        inputs = inputs[1:] + [0.0]
    assert 0.0 < position < 1.5
    return [position, speed, inputs[0]]


if __name__ == '__main__':
    run(compute, 170)
