"""A node's own server of dynamic_reconfigure: what its callback gets are the parameters that the numbers stand in.

The server itself goes on with plain numbers, as it asks for exact types.
"""

import copy
import functools
import sys
import types
from typing import Any, Callable

import rospy

from rosslt import node, values


def tracked_server(original: Any, extract_params: Callable[[Any], Any]) -> Any:
    """The class `Server` for a node's own code.

    Args:
        original: dynamic_reconfigure's.
        extract_params: gives the parameters of a description.
    """

    class Server(original):
        callback: Any

        def __init__(self, type: Any, callback: Any, namespace: str = '') -> None:  # noqa: A002 (as it is called)
            self._keys: Any = {}
            self._made_at: Any = sys._getframe(1)
            super().__init__(_plain_type(type), callback, namespace)

        def _find_sources(self, frame: Any) -> None:
            for parameter in extract_params(self.type.config_description):
                name = parameter['name']
                if type(self.config[name]) in (float, int):
                    key = self._keys[name] = rospy.resolve_name(self.ns + name)
                    if not rospy.has_param(key):
                        rospy.set_param(key, self.config[name])
                    node.parameter_was_set(key)  # the node may have read it before, while it was not set
                    node.serve_parameter(
                        node.read_parameter(frame, key),
                        functools.partial(self._follow, name),
                        self.type.min[name],
                        self.type.max[name],
                        'this node starts from the default of its dynamic_reconfigure server, or from a launch file',
                    )

        def _follow(self, name: str) -> None:
            """A parameter has changed, by other ways than this server's."""
            value = values.untracked(self._read(name))
            if type(value) is type(self.config[name]) and value != self.config[name]:
                self.update_configuration({name: value})

        def _read(self, name: str) -> Any:
            return node.read_parameter(sys._getframe(), self._keys[name])

        def _change_config(self, config: object, level: int) -> Any:
            if self._made_at is not None and node.is_started():
                self._find_sources(self._made_at)
            self._made_at = None
            callback = self.callback
            self.callback = lambda config, level: _plain(callback(self._with_sources(config), level))
            try:
                return super()._change_config(config, level)
            finally:
                self.callback = callback

        def _with_sources(self, config: Any) -> Any:
            made = copy.deepcopy(config)
            for name, key in self._keys.items():
                value = config[name]
                if values.untracked(self._read(name)) != value:
                    rospy.set_param(key, value)
                    node.parameter_was_set(key)
                reading = self._read(name)
                if values.untracked(reading) == value and type(values.untracked(reading)) is type(value):
                    made[name] = reading
            return made

    return Server


def _plain_type(kind: object) -> Any:
    """The module that describes a configuration without provenance, which it has if it is the node's own."""
    own = {name: value for name, value in vars(kind).items() if not name.startswith('__')}
    if not any(values.is_tracked(leaf) for _, leaf in values.leaves(own)):
        return kind
    return types.SimpleNamespace(**values.untracked(own))


def _plain(config: Any) -> Any:
    """Copy the configuration that a callback returns, without provenance; the node's own object stays as it is."""
    if config is None:
        return None
    made = copy.deepcopy(config)
    # `untracked` asks whether a thing is a message by an attribute, for which a nested configuration raises KeyError.
    scalars = {name: value for name, value in config.items() if type(value) in values.TRACKED_CLASSES}
    made.update({name: values.untracked(value) for name, value in scalars.items()})
    return made
