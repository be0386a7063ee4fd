"""Carries a change to where a node keeps the number: its globals, and the attributes of its classes and objects.

A node reads `self.gain` or a global once and computes with it for hours. The names that stand for the number that was
read get the next reading, so that what is computed from now on is computed with it, recorded or not.
"""

import gc
import sys
from typing import Any, List

from rosslt.instrument.tree_rewriting import CELLS


def rebind(before: Any, following: Any) -> None:
    """Have the names that stand for a reading stand for the one that follows it.

    Args:
        before: the reading, itself: what was computed from it stays.
        following: the tracked value that replaces it.
    """
    # The main module is not among what the collector looks at.
    owners: List[Any] = [module for module in list(sys.modules.values()) if CELLS in getattr(module, '__dict__', ())]
    for referrer in gc.get_referrers(before):
        owners += [owner for owner in _owners(referrer) if _is_own(owner)]
    for owner in owners:
        for name in [name for name, value in list(vars(owner).items()) if value is before]:
            if isinstance(owner, type):
                type.__setattr__(owner, name, following)
            else:
                vars(owner)[name] = following


def _owners(referrer: Any) -> List[Any]:
    """Return the objects whose attributes are in `referrer`, if it is a dict, else `referrer` itself."""
    return gc.get_referrers(referrer) if type(referrer) is dict else [referrer]


def _is_own(thing: Any) -> bool:
    """Return whether something is a class of the node's own code, or an object of such a class."""
    kind = thing if isinstance(thing, type) else type(thing)
    return CELLS in vars(sys.modules.get(kind.__module__, sys)) and (kind is thing or kind.__dictoffset__ != 0)
