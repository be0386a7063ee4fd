#!/usr/bin/env python3
"""Writes the .msg files of tracked message types; see -h."""

import os
import sys

from rosslt.cli import run

sys.exit(run('generate', sys.argv[1:], os.path.basename(sys.argv[0])))
