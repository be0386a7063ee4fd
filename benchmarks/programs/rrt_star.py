"""RRT* between discs: a tree whose nodes hang on each other, and are hung anew where that is shorter."""

import math
import random

from running import run

OBSTACLES = [(5.0, 5.0, 1.0), (3.0, 6.0, 1.5), (3.0, 8.0, 1.0), (7.0, 5.0, 1.5), (9.0, 5.0, 1.5)]
START, GOAL = (0.0, 0.0), (6.0, 9.0)
REACH = 0.8
RADIUS = 1.6
NODES = 220


class Node:
    def __init__(self, x, y):
        self.x, self.y = x, y
        self.cost, self.parent = 0.0, None


def is_free(a, b):
    for step in range(5):
        x, y = a.x + (b.x - a.x) * step / 4, a.y + (b.y - a.y) * step / 4
        if any(math.hypot(x - ox, y - oy) <= size for ox, oy, size in OBSTACLES):
            return False
    return True


def compute():
    chance = random.Random(7)
    tree = [Node(*START)]
    for _ in range(NODES):
        x, y = GOAL if chance.random() < 0.1 else (chance.uniform(-2.0, 12.0), chance.uniform(-2.0, 12.0))
        near = min(tree, key=lambda node: (node.x - x) ** 2 + (node.y - y) ** 2)
        angle = math.atan2(y - near.y, x - near.x)
        length = min(REACH, math.hypot(x - near.x, y - near.y))
        new = Node(near.x + length * math.cos(angle), near.y + length * math.sin(angle))
        if not is_free(near, new):
            continue
        around = [node for node in tree if math.hypot(node.x - new.x, node.y - new.y) < RADIUS]
        new.parent, new.cost = near, near.cost + length
        for node in around:
            cost = node.cost + math.hypot(node.x - new.x, node.y - new.y)
            if cost < new.cost and is_free(node, new):
                new.parent, new.cost = node, cost
        for node in around:
            cost = new.cost + math.hypot(node.x - new.x, node.y - new.y)
            if cost < node.cost and is_free(new, node):
                node.parent, node.cost = new, cost
        tree.append(new)
    best = min(tree, key=lambda node: math.hypot(node.x - GOAL[0], node.y - GOAL[1]))
    assert len(tree) > 50
    assert best.cost >= math.hypot(best.x, best.y) - 1e-9
    return [best.x, best.y, best.cost]


if __name__ == '__main__':
    run(compute, 100)
