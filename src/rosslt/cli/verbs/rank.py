"""`rosslt rank`: which numbers move a field of a topic, and how much."""

import argparse
from typing import List, NamedTuple, Tuple

from rosslt import values
from rosslt.cli import field_reading
from rosslt.cli.output import is_terminal, table, write_note, write_row
from rosslt.cli.rendering import text_of
from rosslt.cli.verb import LOOK
from rosslt.node import Directory

GROUP = LOOK
SUMMARY = 'which numbers move a field of a topic, and how much'
DESCRIPTION = """List the numbers of all nodes that a field of the next message of a topic comes from, those first that
move it most: by how much it moves, to first order, if the number moves by 1 % of the range of its bounds or, without
both bounds, by 1 % of its value. A number that is 0 and has no bounds is taken to move by 0.01.

With --frame, it is about a link of a robot, as of `rosslt explain`."""
EXAMPLE = """\
examples:
  rosslt rank /target/pose/position/x
  rosslt rank --frame gripper position/z

In a pipe each number of each field is a line of columns between tabs: field, NODE/LOCATION, its value, by how much it
moves, by how much it moves the field, slope, file:line:column (or empty).
"""
ARGUMENTS = field_reading.ARGUMENTS

#: The share of its range, or of its value, by which a number is taken to move.
SHARE = 0.01


class Effect(NamedTuple):
    """By how much a number moves a field.

    Attributes:
        name: NODE/LOCATION.
        value: the number, as a text.
        step: by how much it moves, in its unit.
        slope: of the field, per unit of the number.
        file: where it stands; '' if that is not known.
        fixed: why it takes no change; '' if it does.
    """

    name: str
    value: str
    step: float
    slope: float
    file: str
    fixed: str

    @property
    def moved(self) -> float:
        """By how much the field moves, in its unit."""
        return abs(self.slope) * self.step


def run(options: argparse.Namespace) -> None:
    directory = Directory()
    reading = field_reading.read_field(options, directory)
    for each, path, leaf in reading.tracked_leaves():
        if isinstance(leaf, str):
            write_note('rank', f'{path} is a text: it has no slope')
            continue
        effects, steady = _effects(leaf, directory)
        if not is_terminal():
            for one in effects:
                write_row(path, one.name, one.value, one.step, one.moved, one.slope, one.file)
            continue
        by = f', published by {each.publisher}' if each.publisher else ''
        print(f'{reading.title or each.topic} {path} = {text_of(leaf)}{by}')
        rows = [
            (f'{one.moved:.3g}', 'if', one.name, f'moves from {one.value} by {one.step:.3g}', one.fixed or one.file)
            for one in effects
        ]
        print('\n'.join(table(rows, indent='  ')))
        if steady:
            print(f'  Not moved now by {", ".join(steady)}, from which it comes as well.')


def _effects(leaf: object, directory: Directory) -> Tuple[List[Effect], List[str]]:
    """What moves a number, the strongest first; the names of its other sources."""
    found = []
    present = values.source_values([leaf])
    slopes = values.slopes([leaf])
    for source, value in present.items():
        (slope,) = slopes.get(source, (0.0,))
        place = directory.of(source)
        step = abs(SHARE * float(value)) or SHARE if isinstance(value, (int, float)) else 0.0
        if place is not None and place.minimum is not None and place.maximum is not None:
            step = SHARE * (place.maximum - place.minimum)
        file = place.file if place else ''
        fixed = 'takes no change' if place and place.is_fixed else ''
        found.append(Effect(directory.name(source), text_of(value), step, slope, file, fixed))
    moving = sorted((one for one in found if one.moved), key=lambda one: -one.moved)
    return moving, [one.name for one in found if not one.moved]
