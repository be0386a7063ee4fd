"""Markers as things of the page: what viser draws for each type of visualization_msgs/Marker."""

import contextlib
import functools
from typing import Any, Callable, Dict, List, Sequence, Tuple

import numpy
import rospkg
import rospy
import trimesh
import viser
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from rosslt.markers import plain_pose

#: The most things that a browser, or a person, can cope with at once.
MANY = 50

#: The minimal width of a drawn line, in metres.
THINNEST = 0.002

#: The proportions of shaft and head of an arrow without points, as in RViz.
SHAFT_LENGTH, SHAFT_WIDTH = 0.77, 0.5

#: The color of outlines, and the width of their lines in pixels.
OUTLINE, OUTLINE_WIDTH = (255, 200, 0), 4.0

#: Draws a marker on a branch of viser's scene.
Draw = Callable[[viser.SceneApi, str, Marker], viser.SceneNodeHandle]


def draw(scene: viser.SceneApi, name: str, marker: Marker) -> List[viser.SceneNodeHandle]:
    """Draw a marker; gives what of it a mouse can take hold of.

    Args:
        scene: viser's.
        name: of the branch that it stands on, at the pose of the thing.
        marker: posed relative to the thing.
    """
    if marker.type in _ON_POINTS and not marker.points:
        return []
    made = _KINDS[marker.type](scene, name, marker)
    x, y, z, *rotation = plain_pose(marker.pose)
    made.position, made.wxyz = (x, y, z), (rotation[3], *rotation[:3])
    return [made] if hasattr(made, 'on_drag') else []


def outline(scene: viser.SceneApi, name: str, markers: Sequence[Marker]) -> viser.SceneNodeHandle:
    """Draw the edges of a box around markers that are posed relative to the same thing.

    Args:
        scene, name: as in `draw`.
        markers: at least one.
    """
    corners = numpy.concatenate([_corners(marker) for marker in markers])
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = numpy.maximum(high - low, THINNEST)
    box = trimesh.creation.box(size)
    edges = box.vertices[box.face_adjacency_edges[box.face_adjacency_angles > 0.0]]
    points = (edges + (low + high) / 2).astype(numpy.float32)
    return scene.add_line_segments(name, points, OUTLINE, thickness=OUTLINE_WIDTH, thickness_units='screen')


def _corners(marker: Marker) -> numpy.ndarray:
    """The corners of a box around a marker, or of boxes around its points, in the frame that it is posed in."""
    size, shape = numpy.array(_scale(marker)), trimesh.creation.box((1.0, 1.0, 1.0)).vertices
    middles = numpy.zeros((1, 3))
    if marker.points and marker.type in (Marker.ARROW, *_ON_POINTS):
        middles = _points(marker)
    elif marker.type == Marker.ARROW:
        middles = numpy.array([[size[0] / 2, 0.0, 0.0]])
    elif marker.type == Marker.MESH_RESOURCE:
        with contextlib.suppress(Exception):  # then it is drawn as a box
            shape = trimesh.bounds.corners(_loaded(str(marker.mesh_resource)).bounds)
    if marker.type in (Marker.LINE_STRIP, Marker.LINE_LIST):
        size = numpy.full(3, size[0])
    x, y, z, *rotation = plain_pose(marker.pose)
    turned = trimesh.transformations.quaternion_matrix((rotation[3], *rotation[:3]))[:3, :3]
    return (middles[:, None] + shape * size).reshape(-1, 3) @ turned.T + (x, y, z)


def _color(color: ColorRGBA) -> Tuple[int, int, int]:
    red, green, blue = (max(0, min(255, round(255 * float(part)))) for part in (color.r, color.g, color.b))
    return red, green, blue


def _paint(marker: Marker) -> Dict[str, Any]:
    alpha = float(marker.color.a)
    return {'color': _color(marker.color), 'opacity': None if alpha >= 1.0 else max(alpha, 0.0)}


def _scale(marker: Marker) -> Tuple[float, float, float]:
    return float(marker.scale.x), float(marker.scale.y), float(marker.scale.z)


def _points(marker: Marker) -> numpy.ndarray:
    return numpy.array([[point.x, point.y, point.z] for point in marker.points], dtype=numpy.float32)


def _colors(marker: Marker) -> numpy.ndarray:
    """The color of each point: its own if each has one."""
    of_points = marker.colors if len(marker.colors) == len(marker.points) else [marker.color] * len(marker.points)
    return numpy.array([_color(one) for one in of_points], dtype=numpy.uint8)


def _cube(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    return scene.add_box(name, dimensions=_scale(marker), **_paint(marker))


def _sphere(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    return scene.add_icosphere(name, radius=0.5, scale=_scale(marker), subdivisions=2, **_paint(marker))


def _cylinder(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    return scene.add_cylinder(name, radius=0.5, height=1.0, scale=_scale(marker), **_paint(marker))


def _arrow(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    x, y, z = _scale(marker)
    if len(marker.points) < 2:
        # along x, so long as scale.x, with a head of the width scale.y and the height scale.z
        shape = _arrow_shape(SHAFT_LENGTH, SHAFT_WIDTH, 1.0, 1.0)
        mesh = shape.apply_transform(numpy.diag([x, y, z, 1.0]))
    else:
        start, end = _points(marker)[:2].astype(float)
        length = float(numpy.linalg.norm(end - start))
        head = min(z or 0.23 * length, length)
        mesh = _arrow_shape(length - head, x, y, length)
        mesh.apply_transform(trimesh.geometry.align_vectors([1.0, 0.0, 0.0], end - start))
        mesh.apply_translation(start)
    return scene.add_mesh_simple(name, mesh.vertices.astype(numpy.float32), mesh.faces, **_paint(marker))


def _arrow_shape(shaft: float, width: float, head_width: float, length: float) -> trimesh.Trimesh:
    """An arrow along x, from the origin."""
    body = trimesh.creation.cylinder(radius=width / 2, height=shaft, sections=16)
    body.apply_translation([0.0, 0.0, shaft / 2])
    head = trimesh.creation.cone(radius=head_width / 2, height=length - shaft, sections=16)
    head.apply_translation([0.0, 0.0, shaft])
    both = trimesh.util.concatenate([body, head])
    return both.apply_transform(trimesh.transformations.rotation_matrix(numpy.pi / 2, [0.0, 1.0, 0.0]))


def _line_strip(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    points, colors = _points(marker), _colors(marker)
    return _lines(scene, name, marker, numpy.stack([points[:-1], points[1:]], 1), numpy.stack([colors[:-1]] * 2, 1))


def _line_list(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    count = len(marker.points) // 2 * 2
    points, colors = _points(marker)[:count], _colors(marker)[:count]
    return _lines(scene, name, marker, points.reshape(-1, 2, 3), colors.reshape(-1, 2, 3))


def _lines(
    scene: viser.SceneApi, name: str, marker: Marker, points: numpy.ndarray, colors: numpy.ndarray
) -> viser.SceneNodeHandle:
    return scene.add_line_segments(name, points, colors, thickness=max(float(marker.scale.x), THINNEST))


def _cubes(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    return _at_points(scene, name, marker, trimesh.creation.box((1.0, 1.0, 1.0)))


def _spheres(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    return _at_points(scene, name, marker, trimesh.creation.icosphere(subdivisions=2, radius=0.5))


def _at_points(scene: viser.SceneApi, name: str, marker: Marker, shape: trimesh.Trimesh) -> viser.SceneNodeHandle:
    return scene.add_batched_meshes_simple(
        name,
        (shape.vertices * _scale(marker)).astype(numpy.float32),
        shape.faces,
        numpy.tile([1.0, 0.0, 0.0, 0.0], (len(marker.points), 1)),
        _points(marker),
        batched_colors=_colors(marker),
        flat_shading=marker.type == Marker.CUBE_LIST,
    )


def _dots(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    size = max(float(marker.scale.x), float(marker.scale.y), THINNEST)
    return scene.add_point_cloud(name, _points(marker), _colors(marker), point_size=size, precision='float32')


def _triangles(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    count = len(marker.points) // 3 * 3
    points = _points(marker)[:count] * _scale(marker)
    faces = numpy.arange(count).reshape(-1, 3)
    paint = _paint(marker)
    if len(marker.colors) == len(marker.points):
        # viser gives a mesh one color: the mean of those of its corners
        paint['color'] = tuple(int(part) for part in _colors(marker).mean(axis=0))
    return scene.add_mesh_simple(name, points.astype(numpy.float32), faces, side='double', flat_shading=True, **paint)


def _text(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    return scene.add_label(
        name, str(marker.text), font_size_mode='scene', font_scene_height=float(marker.scale.z), anchor='center-center'
    )


def _mesh(scene: viser.SceneApi, name: str, marker: Marker) -> viser.SceneNodeHandle:
    try:
        mesh = _loaded(str(marker.mesh_resource))
    except Exception as error:  # whatever a reader of some format raises
        rospy.logwarn_once('%s cannot be read, and is drawn as a box: %s', marker.mesh_resource, error)
        return _cube(scene, name, marker)
    if marker.mesh_use_embedded_materials:
        return scene.add_mesh_trimesh(name, mesh, scale=_scale(marker))
    return scene.add_mesh_simple(
        name, mesh.vertices.astype(numpy.float32), mesh.faces, scale=_scale(marker), **_paint(marker)
    )


@functools.lru_cache(maxsize=64)
def _loaded(resource: str) -> trimesh.Trimesh:
    """A mesh of a file:// or package:// address."""
    kind, _, path = resource.partition('://')
    if kind == 'package':
        package, _, path = path.partition('/')
        path = rospkg.RosPack().get_path(package) + '/' + path
    elif kind != 'file':
        raise ValueError('it is at no file:// or package:// address')
    return trimesh.load(path, force='mesh')


_ON_POINTS: Sequence[int] = (
    Marker.LINE_STRIP,
    Marker.LINE_LIST,
    Marker.CUBE_LIST,
    Marker.SPHERE_LIST,
    Marker.POINTS,
    Marker.TRIANGLE_LIST,
)

_KINDS: Dict[int, Draw] = {
    Marker.ARROW: _arrow,
    Marker.CUBE: _cube,
    Marker.SPHERE: _sphere,
    Marker.CYLINDER: _cylinder,
    Marker.LINE_STRIP: _line_strip,
    Marker.LINE_LIST: _line_list,
    Marker.CUBE_LIST: _cubes,
    Marker.SPHERE_LIST: _spheres,
    Marker.POINTS: _dots,
    Marker.TEXT_VIEW_FACING: _text,
    Marker.MESH_RESOURCE: _mesh,
    Marker.TRIANGLE_LIST: _triangles,
}
