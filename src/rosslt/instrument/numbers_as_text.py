"""Tracked numbers and texts as YAML and messages write them: like plain ones."""

from typing import Any

import genpy
import genpy.message
import yaml

from rosslt import values


def represent_in_yaml() -> None:
    """Let `yaml.dump` write tracked values; it asks for the exact type."""
    for kind in (float, int, bool, str):
        tracked = type(values.track(kind(), values.Source('/', 0)))

        def represent(dumper, value, kind=kind):
            return dumper.represent_data(kind(value))

        for dumper in (
            yaml.SafeDumper,
            yaml.Dumper,
            getattr(yaml, 'CSafeDumper', None),
            getattr(yaml, 'CDumper', None),
        ):
            if dumper is not None:
                dumper.add_representer(tracked, represent)


def show_in_messages() -> None:
    """Let messages show lists of tracked values on one line, as lists of numbers; genpy asks for the exact type."""
    original = genpy.message.strify_message

    def strify_message(val: Any, *arguments: Any, **options: Any) -> Any:
        if type(val) in (list, tuple) and val and values.is_tracked(val[0]):
            val = [values.untracked(part) for part in val]
        return original(val, *arguments, **options)

    genpy.message.strify_message = genpy.strify_message = strify_message
