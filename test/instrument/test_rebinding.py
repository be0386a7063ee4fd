"""What a node keeps of a number follows its changes by itself: globals, attributes of classes and objects."""

from rosslt import Source, track
from rosslt.instrument.rebinding import rebind
from support.programs import run_rewritten

KEPT = """
gain = 0.5
same = gain
computed = gain * 2.0
several = [gain]

class Node:
    limit = gain
    def __init__(self):
        self.gain = gain
        self.twice = gain * 2.0

class Slotted:
    __slots__ = ('gain',)

node = Node()
slotted = Slotted()
slotted.gain = gain
"""


def test_names_that_stand_for_a_reading_stand_for_the_next_one_and_nothing_else_changes(tmp_path, monkeypatch):
    import sys
    import types

    path = tmp_path / 'kept.py'
    module = types.ModuleType('kept')
    monkeypatch.setitem(sys.modules, 'kept', module)
    vars(module).update(run_rewritten(KEPT, str(path), module='kept'))
    before, following = module.gain, track(0.75, Source('/node', 1))
    foreign = types.SimpleNamespace(gain=before)
    rebind(before, following)
    assert all(one is following for one in (module.gain, module.same, module.node.gain, module.Node.limit))
    assert (module.computed, module.node.twice) == (1.0, 1.0)
    assert module.slotted.gain is before
    assert module.several[0] is before
    assert foreign.gain is before
