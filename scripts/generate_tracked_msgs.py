#!/usr/bin/env python3
"""Writes the .msg files of tracked message types; see -h."""

import sys

from rosslt.messages import generate_tracked_msgs

sys.exit(generate_tracked_msgs())
