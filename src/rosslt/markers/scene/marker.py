"""The handles that follow from Markers.

RViz shows ordinary messages by itself. Tracked types (`MarkerTracked`) it does not know, so that the handles
draw the thing as well; over what RViz shows they lay a see-through copy of the thing to grab.
"""

import math
from typing import Hashable, Iterator, List

from visualization_msgs.msg import Marker

from rosslt import values
from rosslt.markers.geometry import PoseTuple, Vector, distance
from rosslt.markers.scene.handle import Handle, Settings, has_source
from rosslt.markers.scene.handles import PointHandle, PoseHandle, ScaleHandle
from rosslt.markers.scene.shapes import plain_pose, pose_tuple, sphere

#: The size of handles on things without a size of their own, in metres.
SIZE = 0.5

#: The color of handles of what has no color of its own: (red, green, blue).
COLOR: Vector = (1.0, 0.6, 0.1)

#: The size of a shape to grab relative to the shape of RViz's own that it covers, and the least difference in metres.
#: RViz grabs the shape in front; an orthographic view distinguishes depths from 6 mm on.
OVERLAP, LEAST_OVERLAP = 1.03, 0.014

#: The opacity of that shape relative to the one it covers: invisible on top of it, visible when dragged away.
OVERLAY_ALPHA = 0.3

SHAPES = frozenset([Marker.CUBE, Marker.SPHERE, Marker.CYLINDER])
LINES = frozenset([Marker.LINE_STRIP, Marker.LINE_LIST])
BODIES_AT_POINTS = frozenset([Marker.CUBE_LIST, Marker.SPHERE_LIST])
LISTS = LINES | BODIES_AT_POINTS | {Marker.POINTS, Marker.TRIANGLE_LIST}
KINDS = SHAPES | LISTS | {Marker.ARROW, Marker.TEXT_VIEW_FACING, Marker.MESH_RESOURCE}


def marker_handles(topic: str, marker: Marker, is_shown: bool, settings: Settings) -> List[Handle]:
    """The handles of a Marker that is there to be shown.

    Args:
        topic: where it was published.
        marker: a visualization_msgs/Marker.
        is_shown: whether RViz shows it by itself.
        settings: what the user has chosen for all handles.
    """
    scale = marker.scale
    can_be_moved = any(map(has_source, pose_tuple(marker.pose)))
    can_be_scaled = any(map(has_source, (scale.x, scale.y, scale.z)))
    has_points = marker.type in LISTS or (marker.type == Marker.ARROW and len(marker.points) > 1)
    # RViz multiplies the corners of triangles by the scale: they have handles if it is 1.
    is_unscaled = marker.type != Marker.TRIANGLE_LIST or (scale.x, scale.y, scale.z) == (1.0, 1.0, 1.0)
    points = [
        (index, point)
        for index, point in enumerate(marker.points if has_points and is_unscaled else ())
        if has_source(point.x) or has_source(point.y) or has_source(point.z)
    ]
    handles: List[Handle] = []
    if is_shown and not (can_be_moved or can_be_scaled or points):
        return handles
    name = '{}:{}:{}'.format(topic, marker.ns, marker.id)
    frame, place, size = marker.header.frame_id, plain_pose(marker.pose), marker_size(marker, has_points)
    if can_be_moved or not is_shown:
        handles.append(
            PoseHandle(
                name,
                frame,
                marker.pose,
                size,
                marker_shape_key(marker),
                lambda: [marker_shape(marker, is_shown)],
                is_planar=settings.is_planar,
                has_points=bool(points),
                shows_turns=shows_turns(marker),
                draws_thing=not is_shown,
            )
        )
    if points:
        color, diameter = handle_color(marker), point_size(marker)
        handles.extend(
            PointHandle(
                f'{name}:points[{index}]',
                frame,
                place,
                point,
                diameter,
                color,
                settings.is_planar,
                thing=name,
                thing_at=pose_tuple(marker.pose)[:3],
            )
            for index, point in points
        )
    if can_be_scaled:
        sizes = scale_handles(name, frame, place, marker, has_points, size)
        handles.extend(one for one in sizes if not (settings.is_planar and one.is_upright))
    return handles


def scale_handles(
    name: str, frame: str, place: PoseTuple, marker: Marker, has_points: bool, size: float
) -> Iterator[ScaleHandle]:
    """A handle for each tracked size of a marker that RViz uses."""
    scale = marker.scale
    for axis, (field, value) in enumerate((('x', scale.x), ('y', scale.y), ('z', scale.z))):
        if has_source(value):
            out = scale_reach(marker, has_points, axis)
            if out:
                part, start = '{}:scale.{}'.format(name, field), scale_start(marker, has_points)
                side = min(0.15 * size, point_size(marker)) if has_points and marker.points else 0.15 * size
                at = pose_tuple(marker.pose)[:3]
                yield ScaleHandle(part, frame, place, start, axis, out, value, side, name, at)


def scale_start(marker: Marker, has_points: bool) -> Vector:
    """Return the point from which the sizes of a marker are measured, in its own coordinates: on no ball of a line or
    an arrow."""
    if not has_points or marker.type == Marker.TRIANGLE_LIST:
        return 0.0, 0.0, 0.0
    ends = marker.points[:1] if marker.type in BODIES_AT_POINTS or marker.type == Marker.POINTS else marker.points[:2]
    x, y, z = (sum(float(getattr(end, axis)) for end in ends) / max(len(ends), 1) for axis in 'xyz')
    return x, y, z


def scale_reach(marker: Marker, has_points: bool, axis: int) -> float:
    """The distance of the edge for each metre of one of the sizes; 0 if RViz ignores that size."""
    kind = marker.type
    if kind in SHAPES or kind in BODIES_AT_POINTS:
        return 0.5
    if kind in LINES:
        return 0.5 if axis == 0 else 0.0
    if kind == Marker.POINTS:
        return 0.5 if axis < 2 else 0.0
    if kind == Marker.TEXT_VIEW_FACING:
        return 1.0 if axis == 2 else 0.0
    if kind == Marker.ARROW:
        # Between two points, the sizes are the diameters of shaft and head, and the length of the head.
        return 0.5 if has_points or axis > 0 else 1.0
    return 1.0


def marker_size(marker: Marker, has_points: bool) -> float:
    """The longest side of a marker, in metres; above 0 whatever its scale is."""
    scale = marker.scale
    size = max(abs(float(scale.x)), abs(float(scale.y)), abs(float(scale.z)))  # a mirrored mesh has negative ones
    if marker.type == Marker.TEXT_VIEW_FACING:
        size = 2.0 * float(scale.z)
    elif has_points and marker.points:
        # To two digits, so that the handle does not change with every point that moves a little.
        size = float('%.2g' % max(0.4 * extent(marker), size))
    return size if size > 0.0 else SIZE


def point_size(marker: Marker) -> float:
    """The diameter of the handles of a marker's points, in metres; above 0 whatever its scale is."""
    scale = marker.scale
    size = 3.0 * float(scale.x)
    if marker.type in BODIES_AT_POINTS:
        longest = max(float(scale.x), float(scale.y), float(scale.z))
        size = max(1.1 * longest, longest + LEAST_OVERLAP)
    elif marker.type == Marker.TRIANGLE_LIST:
        size = float('%.2g' % (0.06 * extent(marker)))
    elif marker.type == Marker.ARROW:
        size = 1.2 * max(float(scale.x), float(scale.y))
        length = float('%.2g' % extent(marker))
        size = min(size, length or size)  # the balls on both ends of a short arrow touch each other, and no more
    elif marker.type == Marker.POINTS:
        size = 1.5 * max(float(scale.x), float(scale.y))
    return size if size > 0.0 else 0.1 * SIZE


def shows_turns(marker: Marker) -> bool:
    """False for a marker that looks alike however it is turned: a text, which faces the eye, and a ball."""
    scale = marker.scale
    is_ball = marker.type == Marker.SPHERE and scale.x == scale.y == scale.z
    return not is_ball and marker.type != Marker.TEXT_VIEW_FACING


def extent(marker: Marker) -> float:
    """The diagonal of the box around a marker's points, in metres."""
    sides = [[float(getattr(point, axis)) for point in marker.points] for axis in 'xyz']
    return distance([min(side) for side in sides], [max(side) for side in sides])


def handle_color(marker: Marker) -> Vector:
    """The color of a marker's handles: its own, if it has one."""
    color = marker.color
    found = (float(color.r), float(color.g), float(color.b))
    return found if any(found) else COLOR


def marker_shape_key(marker: Marker) -> Hashable:
    """All that the shape to grab depends on."""
    scale, color = marker.scale, marker.color
    numbers = (scale.x, scale.y, scale.z, color.r, color.g, color.b, color.a)
    return (
        marker.type,
        tuple(map(float, numbers)),
        str(marker.text),
        str(marker.mesh_resource),
        marker.mesh_use_embedded_materials,
        tuple([(float(point.x), float(point.y), float(point.z)) for point in marker.points]),
        tuple([(float(one.r), float(one.g), float(one.b), float(one.a)) for one in marker.colors]),
    )


def marker_shape(marker: Marker, is_shown: bool) -> Marker:
    """The Marker to grab: the marker itself, relative to its own pose."""
    shape = values.untracked(marker)
    shape.header.frame_id = ''
    shape.header.stamp = type(shape.header.stamp)()
    shape.lifetime = type(shape.lifetime)()
    shape.frame_locked = False
    shape.action = Marker.ADD
    place = type(shape.pose)()
    place.orientation.w = 1.0
    shape.pose = place
    if is_shown and shape.type == Marker.TEXT_VIEW_FACING:
        # A text faces the eye wherever it is: so does a ball, and it is not read twice.
        height = max(OVERLAP * float(marker.scale.z), float(marker.scale.z) + LEAST_OVERLAP)
        color = shape.color
        shape = sphere(height, (color.r, color.g, color.b), OVERLAY_ALPHA * color.a)
    elif is_shown:
        laid_over(shape)
    return shape


def laid_over(shape: Marker) -> None:
    """Make a shape a little larger than what it covers, so that the mouse takes it, and see-through."""
    # The scale of these two is a factor, not a size.
    least = 0.0 if shape.type in (Marker.MESH_RESOURCE, Marker.TRIANGLE_LIST) else LEAST_OVERLAP
    for axis in 'xyz':
        size = getattr(shape.scale, axis)
        setattr(shape.scale, axis, math.copysign(max(OVERLAP * abs(size), abs(size) + least), size))
    for color in (shape.color, *shape.colors):
        color.a *= OVERLAY_ALPHA
