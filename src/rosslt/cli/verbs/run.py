"""`rosslt run`: a node that was not written for this, with provenance."""

import os
import sys

DESCRIPTION = """\
usage: rosslt run [--include MODULE]... PACKAGE NODE [ARGUMENT...]
       rosslt run [--include MODULE]... FILE [ARGUMENT...]

Run a rospy node as it is, with its number literals as locations and its parameters as sources. It behaves as when it
is run by itself. What cannot be tracked runs untracked, with a line that says why.

  --include MODULE  track this module too, and those below it; by default those beside the script and those of
                    catkin workspaces are

examples:
  rosslt run turtle_tf2 dynamic_tf2_broadcaster.py
  rosslt run ./patrol.py _speed:=0.3
  <node pkg="turtle_tf2" type="dynamic_tf2_broadcaster.py" name="frame" launch-prefix="rosslt run"/>
"""


def run(arguments):
    """Run a node in this process; its exceptions and its exit go through. Returns the exit code where none is run."""
    from rosslt import instrument

    include, rest = [], list(arguments)
    while rest and rest[0].startswith('-'):
        option = rest.pop(0)
        name, has_value, value = option.partition('=')
        if option in ('-h', '--help'):
            print(DESCRIPTION, end='')
            return 0
        if name != '--include' or not (has_value or rest):
            print(f'rosslt run: {option} is not understood; see rosslt run -h', file=sys.stderr)
            return 2
        include += (value if has_value else rest.pop(0)).split(',')
    if not rest:
        print('rosslt run: which node? See rosslt run -h', file=sys.stderr)
        return 2
    first = rest.pop(0)
    is_file = os.path.isfile(first) and (os.sep in first or first.endswith('.py') or not rest)
    try:
        if not is_file:
            if not rest or ':=' in rest[0]:
                raise instrument.NoNode(f'there is no file {first}')
            first = instrument.find_node(first, rest.pop(0))
    except instrument.NoNode as error:
        print(f'rosslt run: {error}', file=sys.stderr)
        return 1
    instrument.run_file(first, rest, include)
    return 0
