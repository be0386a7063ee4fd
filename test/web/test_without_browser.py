"""How the page takes frames of tf and texts of others, without a browser."""

import os
import subprocess
import sys

from support.browser import python_path

#: Frames as tf has them: two that hang on each other, and some whose names YAML would read as something else.
FRAMES = """
import contextlib
from unittest import mock

import tf2_ros
from geometry_msgs.msg import TransformStamped

from rosslt.web.frames import Frames

core = tf2_ros.BufferCore()
for parent, child in (('there', 'back'), ('back', 'there'), ('1', 'yes'), ('1', "it's: 2.0"), ('world', '1')):
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = parent, child
    transform.transform.translation.x = transform.transform.rotation.w = 1.0
    core.set_transform_static(transform, 'test')
buffer = mock.Mock(all_frames_as_yaml=core.all_frames_as_yaml, lookup_transform=core.lookup_transform_core)
with mock.patch('tf2_ros.Buffer', return_value=buffer), mock.patch('tf2_ros.TransformListener'):
    frames = Frames(mock.MagicMock(), contextlib.nullcontext(True))
for frame in ('back', 'yes', "it's: 2.0", 'world'):
    frames.branch(frame)
frames.find_root()
frames.update()
print(frames.pose('yes')[0], frames.pose("it's: 2.0")[0])
"""

#: The diff of a file that is not in UTF-8.
DIFF = r"""
from rosslt.web.markdown import block

print(ascii(block(b'+x = 1.5  # \xe4'.decode('utf-8', 'surrogateescape'), 'diff')))
"""


def printed(code):
    """What a program prints that finds the page's modules."""
    done = subprocess.run(
        [sys.executable, '-c', code],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
        text=True,
        timeout=120,
        env=dict(os.environ, PYTHONPATH=python_path()),
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_frames_that_hang_on_each_other_or_have_odd_names_do_not_stop_the_page():
    assert printed(FRAMES) == '2.0 2.0'


def test_a_text_that_was_not_in_utf8_can_be_sent_to_a_browser():
    assert printed(DIFF) == r"'```diff\n+x = 1.5  # ?\n```'"
