"""Rows of a Jacobian with affine parts added up beforehand, against sweeps over every operation."""

import gc
import random

import pytest

from rosslt import NotInvertible, Source, evaluate, math, solve, track
from rosslt.values.graph import Graph
from rosslt.values.solve.budget import Budget, Trial
from rosslt.values.solve.preaccumulation import Preaccumulated

SOURCES = [Source('/slopes', number) for number in range(5)]


def random_results(chance):
    """Results that share parts of each other, affine and bending ones."""
    pool = [track(chance.uniform(0.5, 2.0), source) for source in SOURCES]
    for _ in range(25):
        a, b = chance.choice(pool), chance.choice(pool)
        constant = chance.uniform(0.5, 1.5)
        pool.append(
            chance.choice(
                [
                    lambda a=a, b=b: a + b,
                    lambda a=a, b=b: a - b,
                    lambda a=a, c=constant: a * c,
                    lambda a=a, c=constant: c - a,
                    lambda a=a, c=constant: a / c,
                    lambda a=a, b=b: math.sin(a) * b,
                    lambda a=a: math.sin(a),
                    lambda a=a, b=b: a * math.cos(b),
                ]
            )()
        )
    return pool[-8:]


@pytest.mark.parametrize('seed', range(40))
def test_rows_are_those_of_a_sweep_over_every_operation(seed):
    chance = random.Random(seed)
    results = random_results(chance)
    graph = Graph(results)
    unknowns = chance.sample(list(graph.occurrences), max(1, len(graph.occurrences) - 1))
    roots = [graph.index[id(result)] for result in results]
    columns = {at: column for column, source in enumerate(unknowns) for at in graph.occurrences[source]}
    trial = Trial(graph, unknowns, roots, graph.plain(), Budget(1e9))
    slopes = Preaccumulated(graph, trial, columns, roots)
    inner = chance.sample(range(max(roots)), 3)
    for _ in range(3):
        values = trial.values({source: chance.uniform(0.5, 2.0) for source in unknowns})
        partials = trial.partials(values)
        slopes.move(values, roots + inner, Budget(1e9))
        for place in roots + inner:
            expected = graph.gradient(place, partials, graph.below(place, partials))
            found = slopes.gradient(place, Budget(1e9))
            assert [found.get(column, 0) for column in range(len(unknowns))] == pytest.approx(
                [expected.get(source, 0) for source in unknowns], rel=1e-12, abs=1e-12
            )


def test_a_dense_system_with_a_sine_in_each_row_is_solved():
    chance = random.Random(1)
    sources = [Source('/dense', number) for number in range(60)]
    leaves = [track(chance.uniform(-1, 1), source) for source in sources]
    results = []
    for leaf in leaves:
        result = math.sin(leaf)
        for other in leaves:
            result = result + chance.uniform(-1, 1) * other
        results.append(result)
    targets = evaluate(results, {source: leaf + chance.uniform(-0.1, 0.1) for source, leaf in zip(sources, leaves)})
    assert evaluate(results, solve(results, targets)) == pytest.approx(targets, rel=1e-9)


def test_the_garbage_collector_is_as_before_after_results_were_solved_together():
    a, b = (track(1.0, source) for source in SOURCES[:2])
    solve([a + b, a - b], [3.0, 0.5])
    assert gc.isenabled()
    with pytest.raises(NotInvertible):
        solve([a + b, a + b], [3.0, 0.5])
    assert gc.isenabled()
    gc.disable()
    try:
        solve([a + b, a - b], [3.0, 0.5])
        assert not gc.isenabled()
    finally:
        gc.enable()
