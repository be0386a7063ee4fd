"""The flow of provenance as a drawing."""

import subprocess
from typing import Iterable, Optional

from rosslt import values
from rosslt.flow.flow import Flow, Thing
from rosslt.flow.provenance_map import brief
from rosslt.node import Directory

#: The graphviz shape of each kind.
_ATTRIBUTES = {
    'location': 'shape=note, style=filled, fillcolor="#fff2cc"',
    'node': 'shape=ellipse, style=filled, fillcolor="#dae8fc"',
    'topic': 'shape=box',
}


class NotDrawn(Exception):
    """A drawing cannot be made; says why."""


def dot(flow: Flow, directory: Directory, sources: Optional[Iterable[values.Source]] = None) -> str:
    """A Flow in graphviz's language.

    Args:
        directory: the Directory that knows the names of locations.
        sources: as in `edges`.
    """
    edges = flow.edges(sources)
    # sorted, so that the same flow is the same text whichever message came first
    things = sorted({thing for edge in edges for thing in edge}, key=str)
    names = {thing: f'{thing[0]}{number}' for number, thing in enumerate(things)}
    lines = [
        'digraph rosslt {',
        '  rankdir=LR;',
        '  node [fontname="sans", fontsize=11];',
        '  edge [fontname="sans", fontsize=9];',
    ]
    for thing in things:
        lines.append(
            '  {} [{}, label={}];'.format(names[thing], _ATTRIBUTES[thing[0]], _quoted(_label(thing, directory)))
        )
    for (start, end), fields in sorted(edges.items(), key=str):
        lines.append(
            '  {} -> {}{};'.format(
                names[start], names[end], f' [label={_quoted(brief(sorted(fields)))}]' if fields else ''
            )
        )
    return '\n'.join([*lines, '}'])


def svg(text: str) -> str:
    """Draw a graph in the DOT language with graphviz; returns the SVG.

    Raises:
        NotDrawn: it is not installed, or does not do it.
    """
    try:
        drawn = subprocess.run(['dot', '-Tsvg'], input=text, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise NotDrawn('found no command dot: install graphviz') from None
    if drawn.returncode:
        raise NotDrawn('dot failed: ' + ' '.join(drawn.stderr.split()))
    return drawn.stdout


def _label(thing: Thing, directory: Directory) -> str:
    _, name = thing
    if not isinstance(name, values.Source):
        return str(name)
    place = directory.of(name)
    return f'{place.local_name}\n{place.short_file}' if place else str(name)


def _quoted(text: str) -> str:
    return '"' + text.replace('\\', '\\\\').replace('"', '\\"').replace('\n', '\\n') + '"'
