"""The numbers in a parameter that is the text of a robot (URDF)."""

from typing import Dict, Mapping

from rosslt import files
from rosslt.messages import Scalar
from rosslt.node.parameters.server import Tree


def numbers_in(text: Tree) -> Dict[str, float]:
    """{name: number} of a robot, as of `files.urdf_numbers`; none if it is no text, or not one that can be changed."""
    try:
        return {one.name: one.value for one in files.urdf_numbers(str(text).encode('utf-8'))}
    except ValueError:
        return {}


def text_with(text: Tree, numbers: Mapping[str, Scalar]) -> Tree:
    """A robot with other numbers, each in the place of the one before; as it is if it is not one that can be changed.

    Args:
        text: it.
        numbers: {name: number}; those that it does not have are left out.
    """
    try:
        return files.with_numbers(str(text).encode('utf-8'), numbers).decode('utf-8')
    except ValueError:
        return text
