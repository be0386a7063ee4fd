"""The room of the `rosslt` command: which locations are there, what reaches which topic, and how is it changed from a
shell?

It may import all rooms and rospy. Its door is this module: `main` runs the command. A verb is a module in `verbs`, and
only the one that is asked for is loaded: tab completion must be quick.
"""

import argparse
import contextlib
import importlib
import os
import re
import sys

from rosslt import values
from rosslt.cli.failure import Failure

#: The verbs and what each does.
VERBS = {
    'run': 'a node that was not written for this, with provenance',
    'launch': 'a launch file, every Python node in it with provenance',
    'list': 'nodes and their locations',
    'get': 'the value of a location',
    'set': 'change a location',
    'undo': "take a node's last change back",
    'echo': 'messages with the provenance of their fields',
    'force': 'have a field of a topic become a value, by changing where it comes from',
    'graph': 'which location reaches which field of which topic, through which nodes',
    'bag': 'what provenance a recorded bag holds',
    'save': "a node's current values as YAML that rosparam load takes",
    'generate': 'write the .msg files of tracked message types',
}

#: Not for people: what bash asks for when somebody types tab.
COMPLETE = 'complete'

_USAGE = """\
usage: rosslt VERB [ARGUMENT...]

{}

`rosslt VERB -h` says more, with an example.
"""


def main(arguments=None):
    """Run the command.

    Args:
        arguments: those of the command line, by default this process's.

    Returns:
        The exit code: 0, 1 where it did not work (the reason is on standard error), 2 where it was not understood.
    """
    if arguments is None and sys.argv[1:2] in (['run'], ['launch']):
        arguments = sys.argv[1:]  # the remappings are those of the node
    if arguments is None:
        # remappings of the node are rospy's; anything else with := may be a text for `set`
        arguments = [argument for argument in sys.argv[1:] if not re.match(r'__\w+:=', argument)]
    verb, rest = (arguments[0], arguments[1:]) if arguments else (None, [])
    if verb in ('-h', '--help', 'help'):
        print(usage(), end='')
        return 0
    if verb not in VERBS and verb != COMPLETE:
        print(
            usage().rstrip() if verb is None else f'rosslt: there is no verb {verb!r}; see rosslt -h', file=sys.stderr
        )
        return 2
    if verb == 'run':
        # The node that it runs ends as if it were run by itself: what it raises is its own.
        return importlib.import_module('rosslt.cli.verbs.run').run(rest)
    return run(verb, rest)


def usage():
    """What `rosslt -h` prints."""
    return _USAGE.format('\n'.join(f'  {verb:<10}{summary}' for verb, summary in VERBS.items()))


def run(verb, arguments):
    """Run one verb; returns the exit code."""
    module = importlib.import_module('rosslt.cli.verbs.' + verb)
    if hasattr(module, 'parse'):
        parser = argparse.ArgumentParser(
            prog='rosslt ' + verb,
            description=module.DESCRIPTION,
            epilog=module.EXAMPLE,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.parse(parser)
        arguments = parser.parse_args(arguments)
    try:
        status = module.run(arguments)
        sys.stdout.flush()
        return status or 0
    except (Failure, values.Error) as error:
        print(f'rosslt {verb}: {error}', file=sys.stderr)
    except KeyboardInterrupt:
        print(f'rosslt {verb}: interrupted', file=sys.stderr)
    except BrokenPipeError:
        # the reader has gone, head say: what is still in the buffer is for nobody
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return 1
