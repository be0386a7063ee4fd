"""The room of devices: a joystick, a velocity command or a tracker does what the mouse does.

A device is a hand on one more view of a scene. What it changes, and what is refused, is decided in `markers`, as for a
mouse. It may import the rooms `markers`, `node` and `values`, and rospy. Its door is this module: `device` finds one,
and a `Teacher` has it move a thing.
"""

from rosslt.teach.devices import DEVICES, NotTaught, Options, device
from rosslt.teach.teacher import Teacher
