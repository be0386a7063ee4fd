"""The controls of interactive markers, which a hand takes hold of in RViz.

A control acts along, or around, the x axis of its own orientation. A *fixed* one keeps to the axes of the
marker's frame however the marker itself is turned.
"""

from typing import List, Sequence

from geometry_msgs.msg import Pose, Quaternion
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, Marker

from rosslt.markers.geometry import IDENTITY, ONTO_AXIS, PoseTuple, Rotation, inverse, onto, product
from rosslt.markers.scene.handle import CONTROL_SCALE, Handle, Motions, Ring

AXIS_NAMES = 'xyz'


def handle_marker(handle: Handle, motions: Motions, is_free: bool, size: float, has_menu: bool) -> InteractiveMarker:
    """The interactive marker of a handle, without its menu.

    Args:
        handle: what is drawn.
        motions: the ways in which it can be moved.
        is_free: whether a body that can move every way does so in the plane of the screen, rather than in x and y.
        size: of arrows and rings, in metres; they are larger if they would stand inside the thing.
        has_menu: whether it gets a menu.
    """
    parts = [arrow(axis) for axis in range(3) if motions.arrows[axis]]
    parts.extend(ring(each) for each in motions.rings)
    rotation = handle.pose[3:] if motions.is_in_frame else IDENTITY
    parts.append(body(motions.of_body(is_free), handle.shapes(), rotation, has_menu, motions.is_button))
    return interactive_marker(handle.name, handle.frame, handle.pose, max(size, CONTROL_SCALE * handle.size), parts)


def interactive_marker(
    name: str, frame: str, pose: PoseTuple, size: float, controls: List[InteractiveMarkerControl]
) -> InteractiveMarker:
    """An interactive marker that stands in a frame and moves along with it.

    Args:
        size: of its controls, in metres.
    """
    marker = InteractiveMarker(name=name, scale=size, pose=pose_message(pose), controls=controls)
    # The stamp stays zero: RViz then keeps to the frame as it moves, and reports drags in that very frame.
    marker.header.frame_id = frame
    return marker


def pose_message(pose: PoseTuple) -> Pose:
    """A Pose of (x, y, z, qx, qy, qz, qw)."""
    message = Pose()
    position, orientation = message.position, message.orientation
    position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w = pose
    return message


def arrow(axis: int) -> InteractiveMarkerControl:
    """Arrows on both sides along an axis of the frame: 0, 1 or 2 for x, y or z."""
    return _control('move_' + AXIS_NAMES[axis], InteractiveMarkerControl.MOVE_AXIS, ONTO_AXIS[axis], is_fixed=True)


def ring(one: Ring) -> InteractiveMarkerControl:
    """A ring to turn a thing."""
    mode, rotation = InteractiveMarkerControl.ROTATE_AXIS, onto(one.direction)
    return _control('rotate_' + one.name, mode, rotation, is_fixed=one.is_in_frame)


def body(
    axes: Sequence[int],
    shapes: List[Marker],
    turned: Sequence[float],
    has_menu: bool,
    is_button: bool,
) -> InteractiveMarkerControl:
    """Shapes to grab. RViz keeps the mouse from its view over a body that can be clicked, also if nothing moves it.

    Args:
        axes: those that they move along, as in Motions; all three mean the plane of the screen.
        shapes: Markers whose poses are relative to the interactive marker.
        turned: the rotation of the interactive marker against the frame that the axes belong to.
        has_menu: whether a right click opens the menu even if no axis is movable.
        is_button: whether a left click is to select it, rather than to open the menu, then.
    """
    mode = InteractiveMarkerControl.MENU if has_menu else InteractiveMarkerControl.NONE
    if is_button:
        mode = InteractiveMarkerControl.BUTTON
    rotation: Rotation = IDENTITY
    if len(axes) == 1:
        mode, rotation = InteractiveMarkerControl.MOVE_AXIS, product(inverse(turned), ONTO_AXIS[axes[0]])
    elif len(axes) == 2:
        (normal,) = {0, 1, 2}.difference(axes)
        mode, rotation = InteractiveMarkerControl.MOVE_PLANE, product(inverse(turned), ONTO_AXIS[normal])
    elif len(axes) == 3:
        mode = InteractiveMarkerControl.MOVE_3D
    control = _control('body', mode, rotation, is_fixed=False)
    control.always_visible = True
    control.markers = shapes
    return control


def facing(shapes: List[Marker]) -> InteractiveMarkerControl:
    """Shapes that face the eye, and cannot be grabbed; their x axis points away from it, and their z axis up."""
    control = _control('text', InteractiveMarkerControl.NONE, IDENTITY, is_fixed=False)
    control.orientation_mode = InteractiveMarkerControl.VIEW_FACING
    control.always_visible = True
    control.markers = shapes
    return control


def _control(name: str, mode: int, rotation: Sequence[float], is_fixed: bool) -> InteractiveMarkerControl:
    control = InteractiveMarkerControl(name=name, interaction_mode=mode, orientation=Quaternion(*rotation))
    control.orientation_mode = InteractiveMarkerControl.FIXED if is_fixed else InteractiveMarkerControl.INHERIT
    return control
