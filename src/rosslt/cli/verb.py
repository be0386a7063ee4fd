"""Descriptions of the command's verbs. The help, the parser and the tab completion derive from them.

A verb is a module in `verbs` with the names of `Verb`, and nothing else knows of it: adding one is adding a file.
"""

import argparse
import contextlib
import importlib
import pkgutil
from typing import Any, List, Optional, Protocol, cast

from rosslt.cli import verbs

LOOK = 'Look'
CHANGE = 'Change'
RUN = 'Run'
BUILD = 'Build'

#: The groups of verbs in the order in which `rosslt -h` prints them.
GROUPS = (LOOK, CHANGE, RUN, BUILD)


class Argument:
    """An argument of a verb.

    Args:
        names: the names of an option, or the name of a positional argument.
        completer: the name of the function in `completers` that offers words for it; '' if there is none.
        exclusive: True for an argument that excludes the verb's other exclusive arguments.
        options: further arguments of `argparse.ArgumentParser.add_argument`.
    """

    def __init__(self, *names: str, completer: str = '', exclusive: bool = False, **options: Any) -> None:
        self.names = names
        self.completer = completer
        self.exclusive = exclusive
        self.options = options

    @property
    def is_option(self) -> bool:
        """True for an option such as `--json`, False for a positional argument."""
        return self.names[0].startswith('-')

    @property
    def takes_word(self) -> bool:
        """True if the option takes a value; a flag such as `--json` takes none."""
        return self.options.get('action', 'store') in ('store', 'append')

    @property
    def is_repeated(self) -> bool:
        """True if the positional argument may be given several times."""
        return self.options.get('nargs') in ('*', '+', argparse.REMAINDER)

    @property
    def is_rest(self) -> bool:
        """True if the argument takes all following words unchanged, for another program."""
        return self.options.get('nargs') == argparse.REMAINDER


#: A location that a verb is about.
LOCATION = Argument('location', completer='locations', metavar='NODE/LOCATION', help='as rosslt list says, or NODE#ID')


def node_or_location(meaning: str, **options: Any) -> Argument:
    """The argument of a verb that is about a location or a whole node; `meaning` is what a node stands for, and the
    options are those of `argparse`."""
    return Argument(
        'location',
        completer='nodes_and_locations',
        metavar='NODE[/LOCATION]',
        help=f'as rosslt list says, or NODE#ID; a NODE for {meaning}',
        **options,
    )


class Verb(Protocol):
    """The names that a module in `verbs` has."""

    GROUP: str
    """The verb's group, one of GROUPS."""
    SUMMARY: str
    """A short description, for the list of verbs."""
    DESCRIPTION: str
    """The full description."""
    EXAMPLE: str
    """Examples, and the output in a pipe."""
    ARGUMENTS: List[Argument]

    @staticmethod
    def run(options: argparse.Namespace) -> Optional[int]:
        """Do it; returns the exit code, or None for 0."""


def names() -> List[str]:
    """The verbs that exist, sorted."""
    return sorted(module.name for module in pkgutil.iter_modules(verbs.__path__))


def load(name: str) -> Verb:
    """The verb of a name. Only verbs that are asked for are loaded: tab completion must be quick."""
    return cast(Verb, importlib.import_module('rosslt.cli.verbs.' + name))


class _Parser(argparse.ArgumentParser):
    """A parser to which a word is no option if `float` takes it: that of argparse knows -1 and -.5, and neither
    -1e-1 nor -inf."""

    def _parse_optional(self, arg_string: str) -> Any:
        with contextlib.suppress(ValueError):
            float(arg_string)
            return None
        return super()._parse_optional(arg_string)


def parser(name: str, program: Optional[str] = None) -> argparse.ArgumentParser:
    """The parser of a verb's arguments; `program` is the command's name in the help, by default `rosslt VERB`."""
    verb = load(name)
    made = _Parser(
        prog=program or f'rosslt {name}',
        description=verb.DESCRIPTION,
        epilog=verb.EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    exclusive = None  # argparse takes no empty group
    for argument in verb.ARGUMENTS:
        if argument.exclusive and exclusive is None:
            exclusive = made.add_mutually_exclusive_group()
        (exclusive if exclusive and argument.exclusive else made).add_argument(*argument.names, **argument.options)
    return made
