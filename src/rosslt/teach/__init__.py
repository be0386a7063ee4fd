"""The room of devices: a joystick, a velocity command or a tracker does what the mouse does.

A device is a hand on one more view of a scene. What it changes, and what is refused, is decided in `markers`, as for a
mouse. A `Matcher` changes without a scene: what is commanded becomes what is measured when one of `Presses` comes. The
room may import the rooms `markers`, `node`, `files`, `messages` and `values`, and rospy. Its door is this module:
`device` finds one, and a `Teacher` has it move a thing.
"""

from rosslt.teach.devices import (
    DEVICES,
    JOINTS,
    TF,
    WAYS,
    Device,
    Joints,
    Joystick,
    NotTaught,
    Numbers,
    Options,
    Stick,
    device,
)
from rosslt.teach.matcher import Matcher
from rosslt.teach.pairing import Field
from rosslt.teach.presses import Answer, Presses
from rosslt.teach.recording import Recording, Written
from rosslt.teach.teacher import Teacher
