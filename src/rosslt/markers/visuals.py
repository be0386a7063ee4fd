"""Which handles follow from Markers.

RViz shows ordinary messages by itself. Tracked types (`MarkerTracked`) it does not know, so that the handles
draw the thing as well; over what RViz shows they lay a ghost of the thing to grab.
"""

from visualization_msgs.msg import Marker

from rosslt import values
from rosslt.markers.controls import pose_tuple
from rosslt.markers.geometry import distance, normalized
from rosslt.markers.handles import PointHandle, PoseHandle, ScaleHandle, can_change
from rosslt.markers.stamped import COLOR, SIZE

#: How much larger a shape to grab is than the same shape, shown by RViz itself, that it covers; and by how many
#: metres at least. RViz takes hold of what is in front, and an orthographic view tells depths from 6 mm on.
OVERLAP, LEAST_OVERLAP = 1.03, 0.014

#: How opaque that shape is, against the one it covers: over it, it is not noticed; dragged away, it is seen.
GHOST = 0.3

SHAPES = frozenset([Marker.CUBE, Marker.SPHERE, Marker.CYLINDER])
LINES = frozenset([Marker.LINE_STRIP, Marker.LINE_LIST])
BODIES_AT_POINTS = frozenset([Marker.CUBE_LIST, Marker.SPHERE_LIST])
LISTS = LINES | BODIES_AT_POINTS | {Marker.POINTS, Marker.TRIANGLE_LIST}
KINDS = SHAPES | LISTS | {Marker.ARROW, Marker.TEXT_VIEW_FACING, Marker.MESH_RESOURCE}


def marker_handles(topic, marker, is_shown):
    """The handles of a Marker that is there to be shown."""
    position, orientation, scale = marker.pose.position, marker.pose.orientation, marker.scale
    can_be_moved = any(
        map(
            can_change, (position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w)
        )
    )
    can_be_scaled = any(map(can_change, (scale.x, scale.y, scale.z)))
    has_points = marker.type in LISTS or (marker.type == Marker.ARROW and len(marker.points) > 1)
    points = (
        [
            (index, point)
            for index, point in enumerate(marker.points)
            if can_change(point.x) or can_change(point.y) or can_change(point.z)
        ]
        if has_points
        else ()
    )
    handles = []
    if is_shown and not (can_be_moved or can_be_scaled or points):
        return handles
    name = '{}:{}:{}'.format(topic, marker.ns, marker.id)
    frame, place, size = marker.header.frame_id, plain_pose(marker.pose), marker_size(marker, has_points)
    if can_be_moved or not is_shown:
        handles.append(
            PoseHandle(name, frame, marker.pose, size, marker_look(marker), lambda: [marker_shape(marker, is_shown)])
        )
    if points:
        color, diameter = handle_color(marker), point_size(marker)
        handles.extend(
            PointHandle('{}:points[{}]'.format(name, index), frame, place, point, diameter, color)
            for index, point in points
        )
    if can_be_scaled:
        handles.extend(scale_handles(name, frame, place, marker, has_points, size))
    return handles


def scale_handles(name, frame, place, marker, has_points, size):
    """A handle for each tracked size of a marker that RViz heeds."""
    scale = marker.scale
    for axis, (field, value) in enumerate((('x', scale.x), ('y', scale.y), ('z', scale.z))):
        if can_change(value):
            out = scale_reach(marker, has_points, axis)
            if out:
                start = (0.0, 0.0, 0.0)
                if has_points and marker.points and marker.type != Marker.TRIANGLE_LIST:
                    first = marker.points[0]
                    start = (float(first.x), float(first.y), float(first.z))
                yield ScaleHandle('{}:scale.{}'.format(name, field), frame, place, start, axis, out, value, 0.15 * size)


def scale_reach(marker, has_points, axis):
    """How far out the edge stands for each metre of one of the sizes; 0 where RViz ignores that size."""
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


def marker_size(marker, has_points):
    """How large a marker is, in metres: its longest side."""
    scale = marker.scale
    longest = max(float(scale.x), float(scale.y), float(scale.z))
    if marker.type == Marker.TEXT_VIEW_FACING:
        return 2.0 * float(scale.z)
    if has_points and marker.points:
        # To two digits, so that the handle does not change with every point that moves a little.
        return float('%.2g' % max(0.4 * extent(marker.points), longest))
    return longest or SIZE


def point_size(marker):
    """The diameter of the handles of a marker's points."""
    scale = marker.scale
    if marker.type in BODIES_AT_POINTS:
        longest = max(float(scale.x), float(scale.y), float(scale.z))
        return max(1.1 * longest, longest + LEAST_OVERLAP)
    if marker.type == Marker.TRIANGLE_LIST:
        return float('%.2g' % (0.06 * extent(marker.points))) or 0.1 * SIZE
    if marker.type == Marker.ARROW:
        return 1.2 * max(float(scale.x), float(scale.y))
    if marker.type == Marker.POINTS:
        return 1.5 * max(float(scale.x), float(scale.y))
    return 3.0 * float(scale.x)


def extent(points):
    """The diagonal of the box around points."""
    sides = [[float(getattr(point, axis)) for point in points] for axis in 'xyz']
    return distance([min(side) for side in sides], [max(side) for side in sides])


def handle_color(marker):
    """The color of a marker's handles: its own, where it has one."""
    color = marker.color
    found = (float(color.r), float(color.g), float(color.b))
    return found if any(found) else COLOR


def plain_pose(pose):
    """(x, y, z, qx, qy, qz, qw) of a Pose, plain, the orientation of length 1."""
    plain = tuple(map(float, pose_tuple(pose)))
    return (*plain[:3], *normalized(*plain[3:]))


def marker_look(marker):
    """What the shape to grab depends on."""
    scale, color = marker.scale, marker.color
    points = colors = ()
    if marker.points:
        points = tuple([(float(point.x), float(point.y), float(point.z)) for point in marker.points])
    if marker.colors:
        colors = tuple([(float(one.r), float(one.g), float(one.b), float(one.a)) for one in marker.colors])
    return (
        marker.type,
        float(scale.x),
        float(scale.y),
        float(scale.z),
        float(color.r),
        float(color.g),
        float(color.b),
        float(color.a),
        str(marker.text),
        str(marker.mesh_resource),
        marker.mesh_use_embedded_materials,
        points,
        colors,
    )


def marker_shape(marker, is_shown):
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
    if is_shown:
        # The scale of these two is a factor, and no size.
        least = 0.0 if marker.type in (Marker.MESH_RESOURCE, Marker.TRIANGLE_LIST) else LEAST_OVERLAP
        for axis in 'xyz':
            size = getattr(shape.scale, axis)
            setattr(shape.scale, axis, max(OVERLAP * size, size + least))
        for color in (shape.color, *shape.colors):
            color.a *= GHOST
    return shape
