"""`rosslt web`: the page."""

import argparse

from rosslt.cli.failure import Failure
from rosslt.cli.master import find_master
from rosslt.cli.verb import LOOK, Argument

GROUP = LOOK
SUMMARY = 'a page for the browser: things to drag, and a slider for each number'
DESCRIPTION = """Serve one page: everything that can be dragged in 3D, with the same handles as in RViz, and a slider
or a field for each location of each tracked node. It listens on this machine only, unless another address is named. It
needs viser, which nothing else of rosslt does."""
EXAMPLE = """\
examples:
  rosslt web
  rosslt web --host 0.0.0.0 --password-file ~/page_password
"""
ARGUMENTS = [
    Argument('--port', type=int, default=8090, metavar='N', help='where it listens (default: 8090)'),
    Argument('--host', default='127.0.0.1', metavar='ADDRESS', help='at which address (default: 127.0.0.1)'),
    Argument('--password-file', metavar='FILE', exclusive=True, help='whose first line has to be given as password'),
    Argument(
        '--no-password', action='store_true', exclusive=True, help='whoever reaches ADDRESS may see and change all'
    ),
    Argument('--fixed-frame', default='', metavar='FRAME', help='that stands still; by default the root of tf'),
]

#: The command that installs the packages that `rosslt web` needs.
INSTALL = "pip install viser==1.1.1 'typing_extensions>=4.12' pycollada"


def run(options: argparse.Namespace) -> None:
    find_master()
    try:
        from rosslt import web
    except ImportError as error:
        raise Failure(f'the page needs viser ({error}); install it with: {INSTALL}') from None
    try:
        web.run(options.host, options.port, options.password_file, options.no_password, options.fixed_frame)
    except web.NotServed as error:
        raise Failure(str(error)) from None
