"""Makes yaml and xmlrpc write tracked values as plain values.

Both look up a value's class, not what it is a subclass of: `yaml.safe_dump` would refuse a tracked float, `yaml.dump`
would write it as a Python object, `xmlrpc.client.dumps` would refuse it.
"""

import xmlrpc.client
from typing import Any, Iterator

from .values import TRACKED_CLASSES, untracked

try:
    import yaml
except ImportError:  # which ROS brings; nothing else here needs it
    yaml = None


def register() -> None:
    """Register all tracked classes with both."""
    for tracked in TRACKED_CLASSES:
        xmlrpc.client.Marshaller.dispatch[tracked] = dump_plain
        if yaml is not None:
            for representer in dumpers(yaml.representer.BaseRepresenter):
                representer.yaml_representers[tracked] = represent_plain


def dump_plain(marshaller: Any, value: Any, write: Any) -> None:
    """Write a tracked value as xmlrpc writes the plain one."""
    plain = untracked(value)
    marshaller.dispatch[type(plain)](marshaller, plain, write)


def represent_plain(dumper: Any, value: Any) -> Any:
    """Represent a tracked value as yaml represents the plain one."""
    return dumper.represent_data(untracked(value))


def dumpers(base: Any) -> Iterator[Any]:
    """The classes of yaml that have a table of their own; others share that of their base."""
    if 'yaml_representers' in vars(base):
        yield base
    for subclass in base.__subclasses__():
        yield from dumpers(subclass)
