"""Which sources of a thing move other things as well."""

from rosslt import node, values

DOCK, BESIDE, ANGLE = (values.Source('/owner', number) for number in range(3))


def number(*sources):
    return sum(values.track(1.0, source) for source in sources)


def test_what_another_thing_comes_from_is_shared_and_the_same_thing_shown_twice_is_none():
    uses = node.Uses()
    gate = [number(DOCK, BESIDE), number(ANGLE)]
    uses.put('gate', gate)
    assert uses.shared('gate', gate) == [set(), set()]
    uses.put('target', gate)
    uses.put('label', [number(DOCK, BESIDE, ANGLE)])
    assert uses.shared('gate', gate) == [set(), set()]
    uses.put('dock', [number(DOCK)])
    assert uses.shared('gate', gate) == [{DOCK}, set()]
    assert uses.shared('dock', [number(DOCK)]) == [set()]
    uses.drop('dock')
    uses.drop('dock')
    assert uses.shared('gate', gate) == [set(), set()]


def test_a_thing_that_comes_from_something_else_now_has_left_its_sources():
    uses = node.Uses()
    uses.put('dock', [number(DOCK)])
    uses.put('dock', [number(ANGLE)])
    assert uses.shared('gate', [number(DOCK, BESIDE)]) == [set()]
    assert uses.shared('gate', [number(ANGLE, BESIDE)]) == [{ANGLE}]
