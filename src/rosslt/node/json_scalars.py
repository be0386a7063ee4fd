"""Values as they travel between nodes: scalars, written as JSON."""

import json
from typing import Any


class Refused(Exception):
    """A value that a location refuses; the text is the reason."""


def to_json(value: Any) -> str:
    """A plain scalar as it travels; JSON writes a float with all its digits."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def from_json(text: str) -> Any:
    """A plain scalar from the wire.

    Raises:
        Refused: the text is no JSON scalar, or a number that is not finite.
    """

    def not_finite(constant: str) -> None:
        raise Refused(f'{constant} is not a finite number')

    try:
        value = json.loads(text, parse_constant=not_finite)
    except (ValueError, RecursionError) as error:
        raise Refused(f'{text!r} is not a JSON scalar ({error})') from None
    if type(value) not in (float, int, str, bool):
        raise Refused(f'{text!r} is not a JSON scalar')
    return value
