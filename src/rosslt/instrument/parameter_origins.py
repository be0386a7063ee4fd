"""Records the file position of each parameter, and of the arguments of nodes, while `rosslt launch` reads launch files,
for saving values later."""

import json
import os
import xmlrpc.client
from typing import Any, Dict, Iterator, List, Optional, Tuple, Union
from xml.dom.minidom import Element

import rosgraph
import roslaunch.core
import roslaunch.xmlloader
from rosgraph.names import ns_join

from rosslt.files import ORIGINS, is_scalar, words

_Step = Union[str, int]


class NotingLoader(roslaunch.xmlloader.XmlLoader):
    """roslaunch's loader, which notes where each number, text and truth value that becomes a parameter stands.

    Attributes:
        origins: {full name of a parameter, with the index below a list: where it stands}.
    """

    def __init__(self) -> None:
        super().__init__()
        self.origins: Dict[str, Dict[str, Any]] = {}
        self._rosparam = 0, 0  # which <rosparam> of its file is being loaded, and of how many
        # By the id of a roslaunch.core.Node: where its arguments stand, and what they are read in.
        self._arguments: Dict[int, Tuple[Dict[str, Any], Any]] = {}
        # Those that roslaunch gives the nodes of a context, such as `~x` of a <group>, and what a node has of its own.
        self._for_nodes: List[Tuple[roslaunch.core.Param, Dict[str, Any]]] = []
        self._in_node: List[roslaunch.core.Param] = []

    def _param_tag(self, tag: Element, context: Any, ros_config: Any, *args: Any, **kwds: Any) -> Any:
        made = super()._param_tag(tag, context, ros_config, *args, **kwds)
        if made is not None:
            origin = {
                'file': os.path.realpath(context.filename),
                'tag': _place_of(tag),
                'name': tag.getAttribute('name'),
                'text': tag.getAttribute('value'),
                'type': (tag.getAttribute('type') or 'auto').lower().strip(),
                'said': made.value,
                'is_substituted': '$(' in tag.getAttribute('value') or not tag.hasAttribute('value'),
            }
            is_local = bool(kwds.get('force_local'))
            if is_local:
                self._in_node.append(made)
            if is_local or made.key.startswith('~'):
                self._for_nodes.append((made, origin))
            else:
                self._note_param(ns_join(context.ns, made.key), made.value, origin)
        return made

    def _node_tag(self, tag: Element, context: Any, *args: Any, **kwds: Any) -> Any:
        self._in_node = []
        made = super()._node_tag(tag, context, *args, **kwds)
        if made is not None:
            # roslaunch sets them in this order, after what the <rosparam> in the node says.
            for one in [*context.params, *self._in_node]:
                origin = next(origin for param, origin in self._for_nodes if param is one)
                full = ns_join(ns_join(made.namespace, made.name), one.key.lstrip('~'))
                self._note_param(full, one.value, origin)
        if tag.tagName == 'node' and made is not None:
            origin = {
                'file': os.path.realpath(context.filename),
                'tag': _place_of(tag),
                'name': tag.getAttribute('name'),
                'text': tag.getAttribute('args'),
            }
            self._arguments[id(made)] = origin, context
        return made

    def note_argument(self, node: roslaunch.core.Node, index: int, name: str, value: float) -> None:
        """Note that a parameter is given by a word of the arguments of a node that was loaded.

        Args:
            node: the node, with the arguments that roslaunch has read.
            index: of the word.
            name: the full name of the parameter.
            value: its value.
        """
        origin, context = self._arguments[id(node)]
        said, read = words(origin['text']), words(node.args)
        # A substitution may be several words or none; `eval` has words of its own.
        is_substituted = origin['text'].startswith('$(eval ') or (
            [words(self.resolve_args(word, context)) for word in said] != [[word] for word in read]
            or said[index] != read[index]
        )
        self._note(name, value, {**origin, 'word': index, 'is_substituted': is_substituted})

    def _rosparam_tag(self, tag: Element, *args: object, **kwds: object) -> Any:
        self._rosparam = _place_of(tag)
        return super()._rosparam_tag(tag, *args, **kwds)

    def load_rosparam(
        self,
        context: Any,
        ros_config: Any,
        cmd: str,
        param: Optional[str],
        file_: Optional[str],
        text: str,
        verbose: bool = True,
        subst_function: Any = None,
    ) -> None:
        """Load parameters as roslaunch does, and note their origins."""
        before = dict(ros_config.params)
        super().load_rosparam(
            context, ros_config, cmd, param, file_, text, verbose=verbose, subst_function=subst_function
        )
        if cmd != 'load':
            return
        base = ns_join(context.ns, param) if param else context.ns
        loaded = {key: one for key, one in ros_config.params.items() if before.get(key) is not one}
        for key, one in loaded.items():
            path: List[_Step] = [step for step in key[len(base) :].split('/') if step]
            origin = {
                'file': os.path.realpath(file_ or context.filename),
                'is_substituted': subst_function is not None,
            }
            if not file_:
                # Inside of the launch file: another language within it.
                origin['rosparam'], origin['text'] = self._rosparam, text
            self._note(key, one.value, origin, path)

    def _note_param(self, name: str, value: object, origin: Dict[str, Any]) -> None:
        self._note(name, value, origin)
        if origin['is_substituted'] and not origin['text'] and name in self.origins:
            # The text of a file or of a program's output may be long, such as a robot's description, and is not
            # written back.
            self.origins[name]['said'] = None

    def _note(self, key: str, value: object, origin: Dict[str, object], path: Optional[List[_Step]] = None) -> None:
        for name in [one for one in self.origins if one == key or one.startswith(key + '/')]:
            del self.origins[name]  # the last declaration wins
        for steps, scalar in _scalars(value):
            full = '/'.join([key, *map(str, steps)])
            self.origins[full] = {**origin, 'said': scalar}
            if path is not None:
                self.origins[full]['path'] = [*path, *steps]


def _scalars(value: object) -> Iterator[Tuple[List[_Step], Any]]:
    """The numbers, texts and truth values in a parameter, each with the steps to it."""
    if isinstance(value, list):
        for index, part in enumerate(value):
            for steps, scalar in _scalars(part):
                yield [index, *steps], scalar
    elif isinstance(value, dict):
        for name, part in value.items():
            for steps, scalar in _scalars(part):
                yield [name, *steps], scalar
    elif is_scalar(value):
        yield [], value


def _place_of(tag: Element) -> Tuple[int, int]:
    """Return (index, count) of a tag among the tags with its name in its file."""
    document: Any = tag.ownerDocument
    those = document.getElementsByTagName(tag.tagName)
    return next(index for index, one in enumerate(those) if one is tag), len(those)


def with_earlier(origins: Dict[str, Dict[str, object]]) -> str:
    """The text of the parameter `ORIGINS`: these origins, and those that other launch files have noted."""
    try:
        earlier = json.loads(rosgraph.Master('/rosslt').getParam(ORIGINS))
    except (OSError, xmlrpc.client.Error, rosgraph.MasterException, ValueError, TypeError):
        earlier = {}
    return json.dumps({**(earlier if isinstance(earlier, dict) else {}), **origins})
