"""What a hand takes hold of in RViz: controls of interactive markers, by what can move.

A control acts along, or around, the x axis of its own orientation. A *fixed* one keeps to the axes of the
marker's frame however the marker itself is turned.
"""

from geometry_msgs.msg import Point, Pose, Quaternion
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, Marker

from rosslt.markers.geometry import IDENTITY, ONTO_AXIS, inverse, onto, product

AXIS_NAMES = 'xyz'

#: Red, green and blue for x, y and z, as everywhere in RViz.
AXIS_COLORS = ((0.8, 0.1, 0.1), (0.1, 0.7, 0.1), (0.15, 0.25, 0.9))


def interactive_marker(name, frame, pose, size, controls):
    """An interactive marker that stands in a frame and moves along with it.

    Args:
        pose: (x, y, z, qx, qy, qz, qw).
        size: of its controls, in metres.
    """
    marker = InteractiveMarker(name=name, scale=size, pose=pose_message(pose), controls=controls)
    # The stamp stays zero: RViz then keeps to the frame as it moves, and reports drags in that very frame.
    marker.header.frame_id = frame
    return marker


def pose_message(pose):
    """A Pose of (x, y, z, qx, qy, qz, qw)."""
    return Pose(Point(*pose[:3]), Quaternion(*pose[3:]))


def pose_tuple(message):
    """(x, y, z, qx, qy, qz, qw) of a Pose, plain."""
    position, orientation = message.position, message.orientation
    return (position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w)


def arrow(axis):
    """Arrows on both sides along an axis of the frame: 0, 1 or 2 for x, y or z."""
    return _control('move_' + AXIS_NAMES[axis], InteractiveMarkerControl.MOVE_AXIS, ONTO_AXIS[axis], fixed=True)


def ring(name, direction):
    """A ring around a direction of the frame, a vector of length 1."""
    return _control('rotate_' + name, InteractiveMarkerControl.ROTATE_AXIS, onto(direction), fixed=True)


def body(movable, shapes, turned=IDENTITY, has_menu=True):
    """Shapes to grab, which move the way that the movable axes allow.

    Args:
        movable: three booleans, for x, y and z.
        shapes: Markers whose poses are relative to the interactive marker.
        turned: the rotation of the interactive marker against the frame that the axes belong to.
        has_menu: whether a right click opens the menu even where no axis is movable.
    """
    axes = [axis for axis in range(3) if movable[axis]]
    mode = InteractiveMarkerControl.MENU if has_menu else InteractiveMarkerControl.NONE
    rotation = IDENTITY
    if len(axes) == 1:
        mode, rotation = InteractiveMarkerControl.MOVE_AXIS, product(inverse(turned), ONTO_AXIS[axes[0]])
    elif len(axes) == 2:
        (normal,) = {0, 1, 2}.difference(axes)
        mode, rotation = InteractiveMarkerControl.MOVE_PLANE, product(inverse(turned), ONTO_AXIS[normal])
    elif len(axes) == 3:
        mode = InteractiveMarkerControl.MOVE_3D
    control = _control('body', mode, rotation, fixed=False)
    control.always_visible = True
    control.markers = shapes
    return control


def sphere(diameter, color):
    """A sphere to grab."""
    shape = Marker(type=Marker.SPHERE)
    shape.scale.x = shape.scale.y = shape.scale.z = diameter
    paint(shape, color)
    return shape


def cube(side, color):
    """A cube to grab."""
    shape = sphere(side, color)
    shape.type = Marker.CUBE
    return shape


def paint(shape, color, alpha=1.0):
    """Give a shape a color (red, green, blue)."""
    shape.color.r, shape.color.g, shape.color.b = color
    shape.color.a = alpha


def _control(name, mode, rotation, fixed):
    control = InteractiveMarkerControl(name=name, interaction_mode=mode, orientation=Quaternion(*rotation))
    control.orientation_mode = InteractiveMarkerControl.FIXED if fixed else InteractiveMarkerControl.INHERIT
    return control
