"""`slt_visualization`: a scene of all tracked topics, shown in RViz; private parameters are its settings."""

import gc
from typing import Any, Callable

import rospy

from rosslt import node
from rosslt.markers.describing import Descriptions
from rosslt.markers.drags.other_views import OtherViews
from rosslt.markers.drags.scene_drags import Drags, Rules
from rosslt.markers.faults import contained
from rosslt.markers.offers import Offers
from rosslt.markers.rviz.display import Display
from rosslt.markers.rviz.frames import FixedFrame, JoinedFrames
from rosslt.markers.rviz.notes import Notes
from rosslt.markers.rviz.server import Server
from rosslt.markers.scene.follower import FRAME_RATE
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.selection import Selection
from rosslt.markers.scene.topics import Watch

#: The number of new objects after which Python's garbage collector looks for reference cycles.
OBJECTS_BEFORE_COLLECTING = 20_000


def run() -> None:
    """Show interactive markers until this node is shut down. Private parameters are the settings.

    Raises:
        ValueError: a parameter has a value that it cannot have.
    """
    update = _one_of('~update', 'live', 'release')
    settings = Settings(is_planar=_one_of('~mode', '3d', '2d') == '2d', ball_size=_positive('~ball_size', 0.2))
    rules = Rules(
        is_live=update == 'live',
        rate=_positive('~rate', Rules().rate),
        timeout=_positive('~timeout', Rules().timeout),
        resolution=_positive('~resolution', Rules().resolution),
    )
    notes, handle_size = Notes(_positive('~text_height', 0.2)), _positive('~handle_size', 0.5)
    selection = Selection(_setting('~show_all', False, lambda value: isinstance(value, bool), 'true or false'))
    topics = _setting('~topics', [], _are_names, 'a list of names')

    scene = Scene(settings)
    descriptions = Descriptions()
    others = OtherViews(scene, lambda hand: 'RViz')
    drags = Drags(scene, rules, descriptions.name, node.NodeErrors().raised_since, others)
    offers = Offers(scene, drags, descriptions)
    fixed_frame = FixedFrame(scene, _setting('~fixed_frame', '', lambda value: isinstance(value, str), 'a name'))
    frames = JoinedFrames(fixed_frame)
    display = Display(Server(rospy.get_name()), offers, notes, selection, handle_size, frames, others)
    Watch(scene, topics, also=[fixed_frame.look, lambda graph: frames.tell('~frames_apart')])
    rospy.on_shutdown(display.clear)
    # The objects that the node has begun with stay, and the garbage collector need not visit them as messages come; nor
    # the objects of a message of some hundred markers while it is read.
    gc.freeze()
    gc.set_threshold(OBJECTS_BEFORE_COLLECTING)
    while not rospy.is_shutdown():
        with contained('the markers cannot be brought up to date'):
            scene.expire()
            display.apply()
        rospy.rostime.wallsleep(1.0 / FRAME_RATE)


def _setting(name: str, default: Any, is_allowed: Callable[[Any], bool], what: str) -> Any:
    """Read a parameter; raises ValueError, which says what it has to be, if it is something else."""
    value = rospy.get_param(name, default)
    if not is_allowed(value):
        raise ValueError('the parameter {} is {!r} instead of {}'.format(name, value, what))
    return value


def _one_of(name: str, default: str, other: str) -> str:
    return str(_setting(name, default, lambda value: value in (default, other), f'{default!r} or {other!r}'))


def _positive(name: str, default: float) -> float:
    return float(_setting(name, default, lambda value: type(value) in (int, float) and value > 0.0, 'a number above 0'))


def _are_names(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(one, str) for one in value)
