"""`rosslt doctor`: why something cannot be dragged."""

import argparse
from typing import List

from rosslt.cli.diagnosis import FAULT, Examination, Losses, Traffic
from rosslt.cli.failure import Failure, did_you_mean
from rosslt.cli.fields import joined
from rosslt.cli.master import SystemState, find_master, full_name, split_topic, system_state
from rosslt.cli.output import is_terminal, write_result
from rosslt.cli.reading import listener
from rosslt.cli.verb import LOOK, Argument
from rosslt.node import Directory

GROUP = LOOK
SUMMARY = 'why something on a topic cannot be dragged or forced'
DESCRIPTION = """Look at all that a change needs, and say what is missing: publishers that send provenance,
nodes that take the change, fields without a source, messages that show it, handles in RViz; and at which lines
a node that `rosslt run` runs makes plain numbers of tracked ones, and what recording costs it. Without a TOPIC
it looks at those that RViz draws and at those with provenance. The exit code is 1 if a fault was found."""
EXAMPLE = """\
examples:
  rosslt doctor
  rosslt doctor /target
  rosslt doctor /target/pose/position/z

In a pipe each finding is a line of columns between tabs: topic, type, ok or note or fault, text.
"""
ARGUMENTS = [
    Argument('topic', nargs='?', completer='topics', metavar='TOPIC[/FIELD]', help='look at this topic or field alone'),
    Argument('--time', type=float, default=3.0, metavar='S', help='how long to listen (default: 3)'),
]

#: The packages whose messages RViz draws.
_DRAWN = ('visualization_msgs/', 'geometry_msgs/', 'nav_msgs/Path', 'rosslt/')

#: The ends of the names of topics of interactive markers and locations, which carry nothing of a robot itself.
_OWN = ('/update', '/update_full', '/feedback', '/rosslt/changes', '/rosslt/source_change', '/rosslt/locations')


def run(options: argparse.Namespace) -> int:
    master = find_master()
    state = system_state(master)
    types, field = dict(master.getTopicTypes()), ''
    if options.topic:
        wanted = [full_name(options.topic)]
        if wanted[0] not in types:
            try:
                wanted[0], _, field = split_topic(master, options.topic)
            except Failure:
                raise Failure(f'there is no topic {wanted[0]}{did_you_mean(wanted[0], types)}') from None
    else:
        wanted = sorted(topic for topic in state.publishers if not topic.startswith('/rosout') and topic != '/clock')
        wanted = [topic for topic in wanted if not topic.endswith(_OWN)]
    with listener(*_listened(state, wanted)) as stream:
        losses = Losses(state, wanted, options.time)
        traffic = Traffic(stream, options.time, joined(field, ''))
    directory = Directory()
    directory.learn(traffic.all_sources())
    examination = Examination(master, state, traffic, directory, losses)
    has_fault = False
    for topic in wanted:
        type_ = types.get(topic, '')
        if not (options.topic or traffic.is_tracked(topic) or type_.startswith(_DRAWN)):
            continue
        if is_terminal():
            print(f'{topic}  {type_}')
        for finding in examination.findings(topic):
            has_fault = has_fault or finding.kind == FAULT
            write_result(f'  {finding.kind:<7}{finding.text}', topic, type_, finding.kind, finding.text)
    return 1 if has_fault else 0


def _listened(state: SystemState, topics: List[str]) -> List[str]:
    """The topics, and all that their publishers listen to: provenance may be lost in them."""
    publishers = {node for topic in topics for node in state.publishers.get(topic, ())}
    entering = [
        topic
        for topic, nodes in state.subscribers.items()
        if topic in state.publishers and publishers.intersection(nodes)
    ]
    return list(dict.fromkeys([*(topic for topic in topics if topic in state.publishers), *entering]))
