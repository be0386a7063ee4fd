"""Texts of others on the page."""

import os
import subprocess
import sys

from support.browser import python_path

DIFF = r"""
from rosslt.web.markdown import block

print(ascii(block(b'+x = 1.5  # \xe4'.decode('utf-8', 'surrogateescape'), 'diff')))
"""


def test_a_text_that_was_not_in_utf8_can_be_sent_to_a_browser():
    printed = subprocess.run(
        [sys.executable, '-c', DIFF],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        env=dict(os.environ, PYTHONPATH=python_path()),
    ).stdout
    assert printed == r"'```diff\n+x = 1.5  # ?\n```'" + '\n'
