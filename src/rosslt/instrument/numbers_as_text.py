"""Tracked numbers and texts as YAML writes them: like plain ones."""

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
