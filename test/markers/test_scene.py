"""Which handles a scene shows, and how a kind of message is added to it."""

import math as plain_math

import pytest
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import (
    Point,
    Point32,
    PointStamped,
    PolygonStamped,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
)
from move_base_msgs.msg import MoveBaseActionGoal
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from sensor_msgs.msg import JointState, Range
from std_msgs.msg import ColorRGBA
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from rosslt import values
from rosslt.markers.geometry import distance
from rosslt.markers.scene import by_type, duplicates, joints
from rosslt.markers.scene.by_type import KINDS, MessageKind
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from support.scenery import take


def tracked(value, number=1):
    return values.track(float(value), values.Source('/owner', number))


class Seen:
    """A view that notes what is new in a scene, each time it is looked at."""

    def __init__(self):
        self.scene, self._handles, self._said, self.changed = None, {}, [], []

    def look(self):
        news = self.scene.news()
        self.changed = list(news.handles)
        self._handles.update(news.handles)
        self._handles = {name: handle for name, handle in self._handles.items() if handle is not None}
        self._said += [(handle.name, text) for handle, text in news.said]
        return self

    @property
    def handles(self):
        return self.look()._handles

    @property
    def said(self):
        return self.look()._said


@pytest.fixture
def seen():
    return Seen()


@pytest.fixture
def scene(seen):
    result = seen.scene = Scene(Settings())
    return result


class Clock:
    """The time of ROS, which a test sets."""

    def __init__(self):
        self.seconds = 1000.0

    def __call__(self):
        return rospy.Time.from_sec(self.seconds)


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    result = Clock()
    monkeypatch.setattr(rospy.Time, 'now', staticmethod(result))
    return result


def pose_stamped(x):
    message = PoseStamped()
    message.header.frame_id = 'world'
    message.pose.position.x = x
    return message


def marker(x, kind=Marker.SPHERE):
    message = Marker(type=kind, ns='thing')
    message.header.frame_id = 'world'
    message.pose.position.x = x
    message.scale.x = message.scale.y = message.scale.z = 0.3
    return message


def path(*places):
    message = Path(poses=[pose_stamped(x) for x in places])
    message.header.frame_id = 'world'
    return message


@pytest.mark.parametrize('message_class', [PoseWithCovarianceStamped, Odometry])
def test_a_pose_with_covariance_has_the_handle_of_a_pose(scene, seen, message_class):
    message = message_class()
    message.header.frame_id = 'odom'
    message.pose.pose.position.x, message.pose.pose.position.y = tracked(1.0), tracked(2.0, 2)
    message.pose.pose.orientation.w = 1.0
    take(scene, '/where', message)
    (handle,) = seen.handles.values()
    assert (handle.name, handle.frame, handle.pose[:3]) == ('/where', 'odom', (1.0, 2.0, 0.0))
    assert handle.motions(lambda _: True).arrows == (True, True, False)


def test_an_occupancy_grid_has_a_handle_on_its_origin(scene, seen):
    message = OccupancyGrid(data=[0])
    message.header.frame_id = 'map'
    message.info.resolution, message.info.width, message.info.height = 0.05, 1, 1
    message.info.origin.position.x = tracked(-10.0)
    message.info.origin.orientation.z, message.info.origin.orientation.w = plain_math.sin(0.2), plain_math.cos(0.2)
    take(scene, '/map', message)
    (handle,) = seen.handles.values()
    assert (handle.name, handle.frame, handle.pose[:3]) == ('/map', 'map', (-10.0, 0.0, 0.0))
    assert handle.motions(lambda _: True).arrows == (True, False, False)


def transform(child, x):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = 'world'
    message.transform.translation.x = x
    message.transform.rotation.w = 1.0
    return message


def test_a_kind_of_message_is_one_row_of_the_table(scene, seen, monkeypatch):
    def range_handles(topic, message, settings):
        point = PointStamped()
        point.header, point.point.x = message.header, message.range
        yield from by_type.point_stamped(topic, point, settings)

    monkeypatch.setitem(KINDS, 'sensor_msgs/Range', MessageKind(range_handles))
    message = Range(range=tracked(2.0))
    message.header.frame_id = 'sonar'
    take(scene, '/range', message)
    handle = seen.handles['/range']
    assert (handle.frame, handle.pose[:3]) == ('sonar', (2.0, 0.0, 0.0))
    assert handle.wanted((3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), True, False) == ([2.0], [3.0])


def test_frames_with_provenance_have_handles_and_those_of_other_broadcasters_stay(scene, seen):
    take(scene, '/tf', TFMessage([transform('arm', tracked(1.0)), transform('plain', 3.0)]), '/first')
    take(scene, '/tf', TFMessage([transform('tool', tracked(2.0))]), '/second')
    assert set(seen.handles) == {'/tf:arm', '/tf:tool'}
    take(scene, '/tf', TFMessage([transform('tool', 2.0)]), '/second')
    assert set(seen.handles) == {'/tf:arm'}, 'it is plain now'
    scene.keep_publishers('/tf', {'/second'})
    assert not seen.handles


def test_frames_that_are_broadcast_no_more_go_as_in_rviz_and_static_ones_stay(scene, seen, clock):
    take(scene, '/tf', TFMessage([transform('once', tracked(1.0)), transform('again', tracked(2.0, 2))]))
    take(scene, '/tf_static', TFMessage([transform('static', tracked(3.0, 3))]))
    clock.seconds += 14.0
    take(scene, '/tf', TFMessage([transform('again', tracked(2.0, 2))]))
    scene.expire()
    assert set(seen.handles) == {'/tf:once', '/tf:again', '/tf_static:static'}
    clock.seconds += 2.0
    scene.expire()
    assert set(seen.handles) == {'/tf:again', '/tf_static:static'}


def test_a_marker_goes_when_its_lifetime_ends(scene, seen, clock):
    mortal = marker(tracked(1.0))
    mortal.lifetime = rospy.Duration(5.0)
    for later, remains in ((4.9, True), (5.1, False)):
        take(scene, '/markers', mortal)
        clock.seconds += later
        scene.expire()
        assert bool(seen.handles) == remains, later


def test_a_lifetime_begins_again_with_each_message_that_shows_the_same_marker(scene, seen, clock):
    mortal = marker(tracked(1.0))
    mortal.lifetime = rospy.Duration(5.0)
    for later, remains in ((4.0, True), (4.0, True), (5.1, False)):
        take(scene, '/markers', MarkerArray([mortal]))
        clock.seconds += later
        scene.expire()
        assert bool(seen.handles) == remains, later


def test_a_marker_with_a_lifetime_goes_when_the_clock_is_set_back(scene, seen, clock):
    mortal = marker(tracked(1.0))
    mortal.lifetime = rospy.Duration(5.0)
    take(scene, '/markers', mortal)
    clock.seconds = 0.0
    scene.expire()
    assert not seen.handles
    take(scene, '/markers', mortal)
    scene.expire()
    assert set(seen.handles) == {'/markers:thing:0'}


def test_a_mirrored_mesh_has_handles_of_its_size_and_stays_mirrored(scene, seen):
    mesh = marker(tracked(1.0), Marker.MESH_RESOURCE)
    mesh.scale.x, mesh.scale.y, mesh.scale.z = tracked(-2.0, 2), -2.0, -2.0
    take(scene, '/markers', mesh)
    body, size = seen.handles['/markers:thing:0'], seen.handles['/markers:thing:0:scale.x']
    (shape,) = body.shapes()
    assert body.size == 2.0
    assert shape.scale.x == pytest.approx(1.03 * -2.0), 'over the mesh that RViz shows'
    assert size.pose[0] == -1.0
    for x, wanted in ((-2.0, -3.0), (4.0, -1e-3)):
        assert size.wanted((x, *size.pose[1:]), True, False)[1] == [pytest.approx(wanted)], x


def test_the_goal_of_an_action_has_a_handle_on_its_pose(scene, seen):
    message = MoveBaseActionGoal(goal_id=GoalID(id='one'))
    message.goal.target_pose = pose_stamped(tracked(1.5))
    take(scene, '/move_base/goal', message)
    assert seen.handles['/move_base/goal:target_pose'].pose[0] == 1.5


def test_who_asks_for_a_handle_sees_that_another_message_has_shown_it(scene):
    name, one = '/markers:thing:0', marker(tracked(1.0))
    take(scene, '/markers', MarkerArray([one]))
    before = scene.handle(name)
    assert scene.handle(name) is before
    take(scene, '/markers', MarkerArray([one]))
    after = scene.handle(name)
    assert after is not before
    assert (after.pose, after.draw_key, after.tracked) == (before.pose, before.draw_key, before.tracked)


def test_one_thing_published_as_a_pose_and_drawn_as_a_marker_has_the_handle_of_the_marker(scene, seen):
    x = tracked(1.0)
    take(scene, '/waypoint', pose_stamped(x))
    assert set(seen.handles) == {'/waypoint'}
    take(scene, '/markers', marker(x))
    assert set(seen.handles) == {'/markers:thing:0'}
    assert scene.names() == ['/markers:thing:0']
    scene.keep_publishers('/markers', ())
    assert set(seen.handles) == {'/waypoint'}


near = duplicates._Related.near


def grid_of(count):
    """A PoseArray, and the markers on its poses, all of which stand beside one tracked point."""
    origin, poses, markers = tracked(1.0), PoseArray(), MarkerArray()
    poses.header.frame_id = 'world'
    for index in range(count):
        shown = marker(origin + float(index))
        shown.id = index
        markers.markers.append(shown)
        poses.poses.append(shown.pose)
    return poses, markers


def test_of_many_things_that_come_from_one_number_those_that_are_shown_twice_have_one_handle(scene, seen):
    poses, markers = grid_of(20)
    take(scene, '/poses', poses)
    take(scene, '/markers', markers)
    names = {f'/markers:thing:{index}' for index in range(20)}
    assert set(seen.handles) == set(scene.names()) == names
    elsewhere = marker(tracked(1.0) + 100.0)
    elsewhere.id = 3
    take(scene, '/markers', elsewhere)
    assert set(seen.handles) == names | {'/poses:poses[3]'}
    scene.keep_publishers('/markers', ())
    assert set(seen.handles) == {f'/poses:poses[{index}]' for index in range(20)}


def test_the_search_for_things_that_are_shown_twice_takes_time_in_proportion_to_their_number(scene, seen, monkeypatch):
    compared = []
    monkeypatch.setattr(duplicates, 'distance', lambda *poses: compared.append(0) or distance(*poses))
    monkeypatch.setattr(duplicates._Related, 'near', lambda *one: [compared.append(0) or other for other in near(*one)])
    counts = []
    for count in (100, 400):
        poses, markers = grid_of(count)
        for _ in range(2):
            take(scene, '/poses', poses)
            take(scene, '/markers', markers)
        assert len(seen.handles) == count
        counts.append(len(compared))
        compared.clear()
        scene.keep_publishers('/poses', ())
        scene.keep_publishers('/markers', ())
        assert not seen.handles
        compared.clear()
    assert counts[1] < 5 * counts[0]


def test_what_comes_from_the_same_number_but_stands_elsewhere_keeps_its_handle(scene, seen):
    x = tracked(1.0)
    take(scene, '/waypoint', pose_stamped(x + 2.0))
    take(scene, '/markers', marker(x))
    assert set(seen.handles) == {'/waypoint', '/markers:thing:0'}


@pytest.fixture
def warned(monkeypatch):
    result = []
    monkeypatch.setattr(rospy, 'logwarn_throttle_identical', lambda _period, text: result.append(text))
    return result


def test_a_message_without_a_frame_is_warned_of(scene, seen, warned):
    message = PoseStamped()
    message.pose.position.x = tracked(1.0)
    take(scene, '/waypoint', message)
    assert not seen.handles
    assert warned == ['/owner on /waypoint: the message has no frame_id']


@pytest.mark.parametrize('colors', ['color', 'colors'])
def test_a_marker_with_a_color_that_is_no_number_is_warned_of_and_not_shown(scene, seen, warned, colors):
    message = marker(tracked(1.0), Marker.SPHERE_LIST)
    message.points = [Point(0.0, 0.0, 0.0)]
    color = ColorRGBA(1.0, plain_math.nan, 0.0, 1.0)
    setattr(message, colors, color if colors == 'color' else [color])
    take(scene, '/markers', message)
    assert not seen.handles
    assert warned == ['/owner on /markers: marker thing/0 has a number that is not finite']


def test_the_size_of_balls_is_a_setting(seen):
    scene = seen.scene = Scene(Settings(ball_size=0.05))
    take(scene, '/waypoint', pose_stamped(tracked(1.0)))
    (ball,) = seen.handles['/waypoint'].shapes()
    assert ball.scale.x == 0.05


@pytest.fixture
def all_drawn(seen):
    """A scene for a view that has to draw everything by itself."""
    result = seen.scene = Scene(Settings(draws_all=True))
    return result


def test_a_view_that_draws_everything_gets_the_axes_of_a_pose(all_drawn, seen):
    take(all_drawn, '/waypoint', pose_stamped(tracked(1.0)))
    _, axes = seen.handles['/waypoint'].shapes()
    ends = [(point.x, point.y, point.z) for point in axes.points]
    assert axes.type == Marker.LINE_LIST
    assert [end.index(max(end)) for end in ends[1::2]] == [0, 1, 2]
    assert [(color.r, color.g, color.b).index(max(color.r, color.g, color.b)) for color in axes.colors] == [
        0,
        0,
        1,
        1,
        2,
        2,
    ]


def test_it_gets_the_line_of_a_path_which_follows_and_goes_with_it(all_drawn, seen):
    def line():
        (shape,) = seen.handles['/path:line::0'].shapes()
        return [(point.x, point.y, point.z) for point in shape.points]

    take(all_drawn, '/path', path(tracked(1.0), 2.0))
    assert line() == [(1.0, 0.0, 0.0), (2.0, 0.0, 0.0)]
    first = seen.handles['/path:line::0']
    take(all_drawn, '/path', path(tracked(1.5), 2.0, 3.0))
    assert line() == [(1.5, 0.0, 0.0), (2.0, 0.0, 0.0), (3.0, 0.0, 0.0)]
    assert seen.handles['/path:line::0'].draw_key != first.draw_key
    take(all_drawn, '/path', path(1.0, 2.0))
    assert not seen.handles


def test_the_line_of_a_polygon_is_closed(all_drawn, seen):
    polygon = PolygonStamped()
    polygon.header.frame_id = 'world'
    polygon.polygon.points = [Point32(tracked(1.0), 0.0, 0.0), Point32(0.0, 1.0, 0.0), Point32(0.0, 0.0, 1.0)]
    take(all_drawn, '/polygon', polygon)
    (shape,) = seen.handles['/polygon:line::0'].shapes()
    assert len(shape.points) == 4
    assert shape.points[0] == shape.points[-1]


def test_nobody_is_asked_or_told_while_the_scene_is_locked(scene, monkeypatch):
    locked = []

    def noting(*_arguments):
        locked.append(scene._lock._is_owned())
        return ''

    monkeypatch.setattr(joints, '_description_for', noting)  # asks the master
    monkeypatch.setattr(joints.rospy, 'get_param_cached', noting)
    monkeypatch.setattr(rospy, 'logwarn_throttle_identical', noting)
    take(scene, '/joint_states', JointState(name=['tower'], position=[tracked(0.3)]))
    take(scene, '/markers', marker(plain_math.inf * tracked(1.0)))
    assert locked == [False] * 3


def test_a_marker_that_cannot_be_read_leaves_the_others_of_its_message(scene, seen, monkeypatch):
    broken, sound = marker(tracked(1.0)), marker(tracked(2.0, 2))
    broken.id, broken.scale = 1, None
    take(scene, '/markers', MarkerArray([broken, sound]))
    assert set(seen.handles) == {'/markers:thing:0'}
