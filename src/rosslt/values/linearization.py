"""The linearization of any expression at the present values of its sources."""

from typing import Any, Tuple

from .affine import folded
from .sources import Source


def linearized(x: Any) -> Tuple[Tuple[Source, Any, Any], ...]:
    """The terms of a tracked value near its present one: those of `affine` where it is affine.

    Returns:
        `((Source, source's value, slope), ...)` in order of first appearance, each source once. A slope is 0 where the
        value has none, and the source's value may be a text or a bool.
    """
    return tuple([(leaf._record[1], leaf._plain, slope) for leaf, slope in folded(x)[1]])
