"""The room of the `rosslt` command: which locations are there, what reaches which topic, and how is it changed from a
shell?

It may import all rooms and rospy. Its door is this module: `command` is the executable, `main` runs the command, and
`run` one verb of it. A verb is a module in `verbs` that says all about it (`verb.Verb`), and only the one that is asked
for is loaded.
"""

import contextlib
import os
import re
import sys
from typing import Dict, List, Optional, Sequence

from rosslt import values
from rosslt.cli import verb
from rosslt.cli.failure import Failure, Misused, did_you_mean

#: Not for people: what bash asks for when somebody types tab.
_COMPLETE = 'complete'

_USAGE = """\
usage: rosslt VERB [ARGUMENT...]

{}`rosslt VERB -h` says more, with an example; `rosslt --version` says which version this is.
"""


def main(arguments: Optional[Sequence[str]] = None, version: str = '') -> int:
    """Run the command.

    Args:
        arguments: the arguments of the command line, by default this process's.
        version: of the package.

    Returns:
        The exit code: 0, 1 if it did not work (the reason is on standard error), 2 if it was not understood.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if not arguments:
        print(usage().rstrip(), file=sys.stderr)
        return 2
    name, rest = arguments[0], arguments[1:]
    if name in ('-h', '--help', 'help'):
        print(usage(), end='')
        return 0
    if name == '--version':
        print('rosslt', version)
        return 0
    if name == _COMPLETE:
        from rosslt.cli import completion

        completion.write_completions(*rest)
        return 0
    known = verb.names()
    if name not in known:
        print(f'rosslt: there is no verb {name!r}{did_you_mean(name, known)}; see rosslt -h', file=sys.stderr)
        return 2
    return run(name, rest)


def command(version: str) -> int:
    """`main` as the executable of this process: it leaves the ROS graph when it is done.

    Args:
        version: of the package.

    Returns:
        The exit code, as in `main`.
    """
    # A node that runs in this process has a command line of its own, and ends as it would by itself.
    is_node = any(map(_takes_over, sys.argv[1:2]))
    status = main(version=version)
    if 'rosslt.node' in sys.modules and not is_node:
        sys.modules['rosslt.node'].leave()
    return status


def _takes_over(name: str) -> bool:
    return name in verb.names() and bool(getattr(verb.load(name), 'TAKES_OVER', False))


def usage() -> str:
    """Return the text of `rosslt -h`: the commands, by group."""
    lines: Dict[str, List[str]] = {}
    for name in verb.names():
        described = verb.load(name)
        lines.setdefault(described.GROUP, []).append(f'  {name:<12}{described.SUMMARY}')
    return _USAGE.format(
        ''.join('\n'.join([f'{group}:', *lines[group], '\n']) for group in verb.GROUPS if group in lines)
    )


def run(name: str, arguments: Sequence[str], program: Optional[str] = None) -> int:
    """Run one verb.

    Args:
        name: the verb's.
        arguments: the arguments after the verb.
        program: the command's name in its help and errors, by default `rosslt VERB`.

    Returns:
        The exit code, as in `main`.
    """
    program = program or f'rosslt {name}'
    chosen = verb.load(name)
    parser = verb.parser(name, program)
    if any(argument.is_rest for argument in chosen.ARGUMENTS):
        options = parser.parse_args(arguments)
    else:
        # roslaunch appends __name:= and the like; anything else with := may be a text for `set`
        arguments = [argument for argument in arguments if not re.match(r'__\w+:=', argument)]
        options = parser.parse_intermixed_args(arguments)
    if _takes_over(name):
        # The node that it runs ends as if it were run by itself: its exceptions are its own.
        return chosen.run(options) or 0
    try:
        status = chosen.run(options)
        sys.stdout.flush()
        return status or 0
    except Misused as error:
        parser.error(str(error))
    except (Failure, values.Error) as error:
        print(f'{program}: {error}', file=sys.stderr)
    except KeyboardInterrupt:
        print(f'{program}: interrupted', file=sys.stderr)
    except BrokenPipeError:
        # whoever read the output, such as `head`, has ended: drop what is still in the buffer
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return 1
