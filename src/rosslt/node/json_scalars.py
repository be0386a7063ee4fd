"""Values as they travel between nodes: scalars, written as JSON."""

import json

from rosslt.messages import Scalar


class Refused(Exception):
    """A value that a location refuses; the text is the reason, as a message can hold it."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason.encode('utf-8', 'replace').decode('utf-8'))


def to_json(value: Scalar) -> str:
    """A plain scalar as it travels; JSON writes a float with all its digits.

    Raises:
        Refused: it cannot travel: a number that is not finite or has too many digits, or a text that is not Unicode.
    """
    try:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False)
        text.encode('utf-8')
    except UnicodeEncodeError:
        raise Refused(f'{value!a} holds half a surrogate pair, which no message can hold') from None
    except ValueError as error:
        if isinstance(value, float):
            raise Refused(f'{value!r} is not a finite number') from None
        raise Refused(f'it cannot be sent: {error}') from None
    return text


def from_json(text: str) -> Scalar:
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
