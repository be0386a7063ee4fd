"""Records the file position of each parameter, and of the arguments of nodes, while `rosslt launch` reads launch files,
for saving values later."""

import collections
import json
import os
import re
import shlex
import textwrap
import xmlrpc.client
from typing import Any, Dict, Iterator, List, Optional, Tuple, Union
from xml.dom.minidom import Element

import rosgraph
import roslaunch.core
import roslaunch.xmlloader
from rosgraph.names import ns_join

from rosslt.files import ORIGINS, is_scalar, words

_Step = Union[str, int]

#: A text that is an argument of the launch file.
_ARG = re.compile(r'\$\(arg +([^ $()]+) *\)')

#: The key of {argument: where it is given} in what roslaunch resolves texts with, and hands on with the arguments.
_GIVEN = 'rosslt_given'

#: The programs that print a file, if it has nothing to be computed.
_PRINTING = ('cat', 'xacro', 'xacro.py')

#: The maximal length of a text that is quoted, in characters.
_LONGEST = 60


class NotingLoader(roslaunch.xmlloader.XmlLoader):
    """roslaunch's loader, which notes where each number, text and truth value that becomes a parameter stands."""

    def __init__(self) -> None:
        super().__init__()
        self._origins: Dict[str, Dict[str, Any]] = {}
        # By the place of an <arg>: the texts that it is used in, but for parameters that it gives as a whole.
        self._uses: Dict[Tuple[Any, ...], List[str]] = collections.defaultdict(list)
        self._rosparam = 0, 0  # which <rosparam> of its file is being loaded, and of how many
        # By the id of a roslaunch.core.Node: where its arguments stand, and what they are read in.
        self._arguments: Dict[int, Tuple[Dict[str, Any], Any]] = {}
        # Those that roslaunch gives the nodes of a context, such as `~x` of a <group>, and what a node has of its own.
        self._for_nodes: List[Tuple[roslaunch.core.Param, Dict[str, Any]]] = []
        self._in_node: List[roslaunch.core.Param] = []

    @property
    def origins(self) -> Dict[str, Dict[str, Any]]:
        """{full name of a parameter, with the index below a list: where it stands}."""
        return {name: self._unless_used(origin) for name, origin in self._origins.items()}

    def _unless_used(self, origin: Dict[str, Any]) -> Dict[str, Any]:
        """Where a parameter stands, which is not to be written if it is an <arg> that gives something else as well."""
        uses = self._uses.get(_key_of(origin))
        if origin['is_substituted'] or not uses:
            return origin
        why = f'its <arg name="{origin["name"]}"> is used elsewhere as well, in {_short(uses[0])}'
        return {**origin, 'is_substituted': True, 'why': why}

    def resolve_args(self, args: Optional[str], context: Any) -> Any:
        """Resolve a text as roslaunch does, and note which arguments it uses."""
        if args and '$(' in args:
            given = context.resolve_dict.get(_GIVEN, {})
            for name in _args_in(args, given):
                self._uses[_key_of(given[name])].append(args)
        return super().resolve_args(args, context)

    def _followed(self, own: Dict[str, Any], context: Any) -> Dict[str, Any]:
        """Say where the value of an attribute, or of a word of it, stands.

        Args:
            own: its own place; roslaunch has resolved the text.
            context: roslaunch's.

        Returns:
            That, or the place of an <arg>, if the text is `$(arg NAME)`, with the places that lead there; and whether,
            and why, the value stands nowhere as it is.
        """
        text = words(own['text'])[own['word']] if 'word' in own else own['text']
        if '$(' not in text:
            return {**own, 'is_substituted': False}
        match = _ARG.fullmatch(text)
        if not match:
            return {**own, 'is_substituted': True, 'why': f'{_short(text)} is more than $(arg NAME)'}
        given = context.resolve_dict.get(_GIVEN, {}).get(match[1])
        if given is None:
            return {**own, 'is_substituted': True, 'why': f'the argument {match[1]} is given on the command line'}
        self._uses[_key_of(given)].remove(own['text'])
        place = {key: own[key] for key in ('file', 'tag', 'name', 'text', 'word', 'arg') if key in own}
        others = {key: one for key, one in own.items() if key != 'word'}
        return {**others, **given, 'through': [*given.get('through', ()), place]}

    def _arg_tag(self, tag: Element, context: Any, *args: Any, **kwds: Any) -> Any:
        set_in = context.resolve_dict if context.include_resolve_dict is None else context.include_resolve_dict
        before = set(set_in.get('arg', ()))
        super()._arg_tag(tag, context, *args, **kwds)
        attribute = next((one for one in ('value', 'default') if tag.hasAttribute(one)), None)
        if attribute is None or not roslaunch.xmlloader.ifunless_test(self, tag, context):
            return
        origin = {
            'file': os.path.realpath(context.filename),
            'tag': _place_of(tag),
            'name': tag.getAttribute('name'),
            'text': tag.getAttribute(attribute),
            'arg': attribute,
        }
        followed = self._followed(origin, context)
        name = super().resolve_args(tag.getAttribute('name'), context)
        if attribute == 'value' or name not in before:
            set_in.setdefault(_GIVEN, {})[name] = followed

    def _ns_clear_params_attr(self, tag_name: str, tag: Element, *args: Any, **kwds: Any) -> Any:
        child = super()._ns_clear_params_attr(tag_name, tag, *args, **kwds)
        if tag.hasAttribute('pass_all_args'):
            child.include_resolve_dict[_GIVEN] = dict(child.resolve_dict.get(_GIVEN, {}))
        return child

    def _param_tag(self, tag: Element, context: Any, ros_config: Any, *args: Any, **kwds: Any) -> Any:
        made = super()._param_tag(tag, context, ros_config, *args, **kwds)
        if made is not None:
            origin = {
                'file': os.path.realpath(context.filename),
                'tag': _place_of(tag),
                'name': tag.getAttribute('name'),
                'text': tag.getAttribute('value'),
                'type': (tag.getAttribute('type') or 'auto').lower().strip(),
            }
            if tag.hasAttribute('value'):
                origin = self._followed(origin, context)
            else:
                origin = {**origin, 'is_substituted': True, 'text_of': self._file_of(tag, context)}
            is_local = bool(kwds.get('force_local'))
            if is_local:
                self._in_node.append(made)
            if is_local or made.key.startswith('~'):
                self._for_nodes.append((made, origin))
            else:
                self._note_param(ns_join(context.ns, made.key), made.value, origin)
        return made

    def _file_of(self, tag: Element, context: Any) -> str:
        """The file that a <param> has its text from, as it is or as `cat` and `xacro` print it; '' if that is
        not known."""
        given = {one: tag.getAttribute(one) for one in ('textfile', 'command') if tag.hasAttribute(one)}
        # Arguments that it uses have been noted.
        resolved = {name: super(NotingLoader, self).resolve_args(text, context) for name, text in given.items()}
        if 'textfile' in resolved:
            return os.path.realpath(resolved['textfile'])
        program, *others = shlex.split(resolved.get('command', '')) or ['']
        named = [word for word in others if not word.startswith('-')]
        if os.path.basename(program) not in _PRINTING or len(named) != 1:
            return ''
        return os.path.realpath(named[0])

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
        found, context = self._arguments[id(node)]
        origin = {**found, 'word': index}
        said, read = words(origin['text']), words(node.args)
        resolved = [words(super(NotingLoader, self).resolve_args(word, context)) for word in said]
        # A substitution may be several words or none; `eval` has words of its own.
        if origin['text'].startswith('$(eval ') or resolved != [[word] for word in read]:
            self._note(name, value, {**origin, 'is_substituted': True})
        else:
            self._note(name, value, self._followed(origin, context))

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
        if origin['is_substituted'] and not origin['text'] and name in self._origins:
            # The text of a file or of a program's output may be long, such as a robot's description, and is not
            # written back.
            self._origins[name]['said'] = None

    def _note(self, key: str, value: object, origin: Dict[str, object], path: Optional[List[_Step]] = None) -> None:
        for name in [one for one in self._origins if one == key or one.startswith(key + '/')]:
            del self._origins[name]  # the last declaration wins
        for steps, scalar in _scalars(value):
            full = '/'.join([key, *map(str, steps)])
            self._origins[full] = {**origin, 'said': scalar}
            if path is not None:
                self._origins[full]['path'] = [*path, *steps]


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


def _args_in(text: str, given: Dict[str, Any]) -> List[str]:
    """The arguments that a text uses, as often as it does, of those whose places are known."""
    if text.startswith('$(eval '):
        return [name for name in given if re.search(rf'(?<!\w){re.escape(name)}(?!\w)', text)]
    return [name for name in _ARG.findall(text) if name in given]


def _key_of(origin: Dict[str, Any]) -> Tuple[Any, ...]:
    """The place of an <arg>, or of what stands elsewhere, as a key."""
    return origin['file'], origin.get('tag'), origin.get('arg')


def _short(text: str) -> str:
    """A text in one line, without its end if it is long."""
    return textwrap.shorten(text, _LONGEST, placeholder='...')


def with_earlier(origins: Dict[str, Dict[str, object]]) -> str:
    """The text of the parameter `ORIGINS`: these origins, and those that other launch files have noted."""
    try:
        earlier = json.loads(rosgraph.Master('/rosslt').getParam(ORIGINS))
    except (OSError, xmlrpc.client.Error, rosgraph.MasterException, ValueError, TypeError):
        earlier = {}
    return json.dumps({**(earlier if isinstance(earlier, dict) else {}), **origins})
