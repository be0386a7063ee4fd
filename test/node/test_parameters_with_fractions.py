"""An int parameter that takes fractions: what the node has read of it takes them as well, at no further cost."""

import pytest

from rosslt import values
from rosslt.node.locations.call_sites import CallSite
from rosslt.node.locations.location import ParameterLocation


def test_what_was_read_as_an_int_takes_fractions_without_being_replaced():
    location = ParameterLocation('/node/gain', CallSite('node.py', 1, 1, ''), 3, None)
    location.name_node('/node')
    read = location.tracked
    computed = read * 0.5
    with pytest.raises(values.NotInvertible):
        values.solve(computed, 2.25)
    location.put(3.0)
    assert values.solve(computed, 2.25) == {location.source: 4.5}
    assert values.evaluate(read, {location.source: 4.5}) == 4.5
    assert (read, type(values.untracked(read))) == (3, int)
    assert (location.value, type(values.untracked(location.tracked))) == (3.0, float)
