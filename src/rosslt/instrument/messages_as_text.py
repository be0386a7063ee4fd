"""Messages with lists of tracked values as text: like those with lists of plain ones."""

from typing import Any

import genpy
import genpy.message

from rosslt import values


def show_in_messages() -> None:
    """Let messages show lists of tracked values on one line, as lists of numbers; genpy asks for the exact type."""
    original = genpy.message.strify_message

    def strify_message(val: Any, *arguments: Any, **options: Any) -> Any:
        if type(val) in (list, tuple) and val and values.is_tracked(val[0]):
            val = [values.untracked(part) for part in val]
        return original(val, *arguments, **options)

    genpy.message.strify_message = genpy.strify_message = strify_message
