"""A* on a grid with walls, in plain Python."""

import heapq
import math

from running import run

SIZE = 40
RESOLUTION = 0.5
CLEARANCE = 0.8
START, GOAL = (2, 2), (36, 36)
MOVES = [(1, 0, 1.0), (0, 1, 1.0), (-1, 0, 1.0), (0, -1, 1.0), (1, 1, 1.4), (-1, 1, 1.4), (1, -1, 1.4), (-1, -1, 1.4)]
WALLS = [(10.0, y * 0.5) for y in range(60)] + [(15.0, 20.0 - y * 0.5) for y in range(32)]


def blocked():
    cells = set()
    for ix in range(SIZE):
        for iy in range(SIZE):
            x, y = ix * RESOLUTION, iy * RESOLUTION
            if any(abs(x - wx) < CLEARANCE and abs(y - wy) < CLEARANCE for wx, wy in WALLS if wy < 17.0):
                cells.add((ix, iy))
    return cells


def compute():
    walls = blocked()
    queue, costs, parents = [(0.0, START)], {START: 0.0}, {}
    while queue:
        _, cell = heapq.heappop(queue)
        if cell == GOAL:
            break
        for dx, dy, length in MOVES:
            following = cell[0] + dx, cell[1] + dy
            if not (0 <= following[0] < SIZE and 0 <= following[1] < SIZE) or following in walls:
                continue
            cost = costs[cell] + length * RESOLUTION
            if cost < costs.get(following, math.inf):
                costs[following], parents[following] = cost, cell
                estimate = cost + RESOLUTION * math.hypot(GOAL[0] - following[0], GOAL[1] - following[1])
                heapq.heappush(queue, (estimate, following))
    path = [GOAL]
    while path[-1] != START:
        path.append(parents[path[-1]])
    assert costs[GOAL] >= RESOLUTION * math.hypot(34, 34) - 1e-9
    assert len(path) > 34
    return [costs[GOAL], float(len(path))]


if __name__ == '__main__':
    run(compute, 70)
