"""A source that is in use before its node has a name is the same place as one that is made with the name."""

import copy
import operator
import pickle

from rosslt import evaluate, solve, sources, track
from rosslt.values import Source, UnnamedSource

NAMED = Source('/node', 5)


def named_later():
    """A tracked value, made before its source's node had a name."""
    source = UnnamedSource(5)
    value = 2 * track(3.0, source)
    source.name_node('/node')
    return value


def test_it_is_the_named_source_from_then_on():
    (source,) = sources(named_later())
    assert source == NAMED
    assert operator.eq(NAMED, source)
    assert hash(source) == hash(NAMED)
    assert (tuple(source), source.node, source[0], str(source)) == (tuple(NAMED), '/node', '/node', str(NAMED))
    assert (source != NAMED) is False
    assert source != Source('/other', 5)


def test_values_from_before_and_after_have_one_source():
    total = named_later() + track(3.0, NAMED)
    assert sources(total) == [NAMED]
    assert solve(total, 12.0) == {NAMED: 4.0}
    assert evaluate(total, {NAMED: 1.0}) == 3.0
    assert evaluate(total, dict.fromkeys(sources(named_later()), 1.0)) == 3.0


def test_copies_are_the_same_source_and_pickles_the_named_one():
    (source,) = sources(named_later())
    assert copy.deepcopy(source) is copy.copy(source) is source
    assert type(pickle.loads(pickle.dumps(source))) is Source


def test_without_a_name_two_ids_are_two_sources():
    assert UnnamedSource(1) != UnnamedSource(2)
    assert UnnamedSource(1) == UnnamedSource(1)
