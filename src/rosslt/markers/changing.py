"""From where a hand wants a thing to what its sources must become, and on to their owners."""

from collections import namedtuple

from rosslt import node, values
from rosslt.markers import reach

Outcome = namedtuple('Outcome', 'changes gap')
Outcome.__doc__ = 'What was changed, {Source: Change}, and the distance from the target that remains.'

#: A little change, against the size of what is changed.
NUDGE = 1e-3


def force(tracked, targets, source=None, timeout=1.0):
    """Have tracked values become their targets, or come as near as they can.

    Args:
        tracked, targets: tracked values and as many numbers.
        source: change this Source alone where a value depends on it.
        timeout: how long to wait for the owners' answers, in seconds.

    Raises:
        values.NotInvertible: the sources cannot bring the values any nearer.
        node.ChangeRejected, node.SourceUnreachable: as of `node.force_value`.
    """
    if source is not None:
        tracked = [kept_to(value, source) for value in tracked]
    try:
        return Outcome(node.force_value(tracked, targets, timeout=timeout), 0.0)
    except values.NotInvertible:
        present = reach.current_values(tracked)
        changes, gap = reach.nearest(tracked, targets, present)
        if not changes:
            raise
        return Outcome(request({one: (present[one], value) for one, value in changes.items()}, timeout), gap)


def default_sources(tracked, read_only=()):
    """The sources that a drag changes where none has been chosen, in order of appearance.

    Found by asking for a little change of each of the tracked values.
    """
    present = {source: value for source, value in reach.current_values(tracked).items() if source not in read_only}
    numbers = [value for value in tracked if not isinstance(value, str)]
    found = set()
    for index in range(len(numbers)):
        targets = list(map(float, numbers))
        targets[index] += NUDGE * max(1.0, abs(targets[index]))
        try:
            found.update(values.solve(numbers, targets, read_only=read_only))
        except values.NotInvertible:
            found.update(reach.nearest(numbers, targets, present)[0])
    return [source for source in values.sources(tracked) if source in found]


def request(wanted, timeout):
    """Have sources become what is wanted of them.

    Args:
        wanted: {Source: (present value, new value)}.
        timeout: as of `force`.
    """
    return node.force_value(
        [values.track(present, source) for source, (present, _) in wanted.items()],
        [new for _, new in wanted.values()],
        timeout=timeout,
    )


def kept_to(value, source):
    """The value with all sources but one held as constants; as it is where it does not depend on that one."""
    if source not in values.sources(value):
        return value
    instructions, (root,) = values.disassemble([value])
    held, constants = [], set()
    for index, instruction in enumerate(instructions):
        kind = instruction[0]
        if kind == values.SOURCE and instruction[1] != source:
            instruction = (values.CONSTANT, instruction[2])
            constants.add(index)
        elif kind == values.AFFINE:
            terms = tuple(term for term in instruction[2] if term[0] not in constants)
            if terms:
                instruction = (kind, instruction[1], terms, instruction[3])
            else:
                instruction = (values.CONSTANT, instruction[1])
                constants.add(index)
        held.append(instruction)
    return values.assemble(held)[root]
