"""The names of `math`, for tracked values: write `from rosslt import math` instead of `import math`.

The functions keep the provenance of tracked values and give what `math` gives for plain numbers. See
`docs/values.md` for those that have no provenance to keep.
"""

from typing import TYPE_CHECKING, Any

from .values import MATH

globals().update(MATH)

__all__ = list(MATH)

if TYPE_CHECKING:

    def __getattr__(name: str) -> Any: ...
