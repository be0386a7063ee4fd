"""The frames of tf, and the roots of its trees: what stands in them stays where it is when somebody drags a frame."""

import collections
import re
from typing import Any, Counter, Iterable

import tf2_ros
from tf2_msgs.msg import TFMessage

from rosslt import node

#: A frame, and the one that it hangs on, in tf's text about all frames: YAML, except for names that YAML would quote.
_PARENT = re.compile(r"^(\S.*): *\n  parent: '(.*)'$", re.MULTILINE)


def heard_frames() -> tf2_ros.Buffer:
    """Make a Buffer that hears tf.

    Of all subscribers of a topic in a process, the first one says how rospy reads it. Static transforms are sent once,
    and others in this process watch where they come from: so they are read with provenance.
    """
    node.Subscriber('/tf_static', TFMessage)
    buffer = tf2_ros.Buffer()
    tf2_ros.TransformListener(buffer)
    return buffer


def most_common_root(buffer: Any, frames: Iterable[str]) -> str:
    """The root of most frames, the first one by name of several; '' of none.

    Args:
        buffer: a tf2_ros.Buffer. A frame that it does not know is a root.
        frames: without a / in front; one that is there twice counts twice.
    """
    parents = dict(_PARENT.findall(buffer.all_frames_as_yaml()))
    roots: Counter[str] = collections.Counter()
    for frame in frames:
        passed = set()
        while frame in parents and frame not in passed:  # tf takes frames that hang on each other in a circle
            passed.add(frame)
            frame = parents[frame]
        roots[frame] += 1
    return max(sorted(roots), key=lambda root: roots[root], default='')
