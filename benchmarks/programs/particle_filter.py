"""A particle filter in plain Python: a robot in a corridor finds out where it is from its distance to three doors."""

import math
import random

from running import run

DOORS = [2.0, 5.5, 9.0]
NOISE = 0.3
STEP = 0.25
PARTICLES = 200


class Particle:
    def __init__(self, x):
        self.x = x
        self.weight = 1.0


def compute():
    chance = random.Random(5)
    particles = [Particle(chance.uniform(0.0, 10.0)) for _ in range(PARTICLES)]
    truth = 1.0
    for _ in range(20):
        truth += STEP
        nearest = min(abs(door - truth) for door in DOORS) + chance.gauss(0.0, NOISE / 4)
        for particle in particles:
            particle.x += STEP + chance.gauss(0.0, 0.05)
            error = min(abs(door - particle.x) for door in DOORS) - nearest
            particle.weight *= math.exp(-0.5 * (error / NOISE) ** 2) + 1e-12
        total = sum(particle.weight for particle in particles)
        for particle in particles:
            particle.weight /= total
        if 1.0 / sum(particle.weight**2 for particle in particles) < PARTICLES / 2:
            drawn = []
            position, index, reached = chance.random() / PARTICLES, 0, particles[0].weight
            for _ in range(PARTICLES):
                while position > reached and index < PARTICLES - 1:
                    index += 1
                    reached += particles[index].weight
                drawn.append(Particle(particles[index].x))
                position += 1.0 / PARTICLES
            particles = drawn
    total = sum(particle.weight for particle in particles)
    mean = sum(particle.x * particle.weight for particle in particles) / total
    assert 0.0 < mean < 12.0
    return [mean, total]


if __name__ == '__main__':
    run(compute, 150)
