"""The room of interactive markers: which of them follow from tracked visualizations, and what a drag changes.

The paper's `slt_visualization` (section V). It may import the rooms `node`, `messages` and `values`, and
rospy. From the top down: `topics` subscribes to what can be seen, `scene` keeps what is there, `visuals`
says which `handles` follow from it, drawn as `controls`, and the `board` shows them. `drags` notes what RViz
reports of a hand on a marker, and `changing` asks the sources for it, with the help of `reach` where there is
no exact answer. `menus` and `notes` are what else a hand is shown; `places` knows where sources are.
"""

import rospy

from rosslt.markers.board import Board, Server
from rosslt.markers.drags import Drags
from rosslt.markers.menus import Menus
from rosslt.markers.notes import Notes
from rosslt.markers.places import Places
from rosslt.markers.scene import Scene
from rosslt.markers.topics import Watch

__all__ = ['run']

#: How often markers follow messages, in Hz: as often as RViz draws.
FRAME_RATE = 30.0

#: In how many menus, each time, to look for sources that are new.
MENUS_CHECKED = 10


def run():
    """Show interactive markers until this node is shut down, as its private parameters say."""
    update = rospy.get_param('~update', 'live')
    if update not in ('live', 'release'):
        raise ValueError("the parameter ~update is {!r} instead of 'live' or 'release'".format(update))
    rate, timeout = _positive('~rate', 20.0), _positive('~timeout', 0.25)
    text_height = _positive('~text_height', 0.2)
    topics = rospy.get_param('~topics', [])
    if not isinstance(topics, list) or not all(isinstance(topic, str) for topic in topics):
        raise ValueError('the parameter ~topics is {!r} instead of a list of names'.format(topics))

    board = Board(Server(rospy.get_name()))
    notes = Notes(board, text_height)
    places = Places(lambda: menus.redraw())
    drags = Drags(board, update == 'live', rate, timeout, notes.say)
    menus = Menus(board, drags, places)
    board.connect(drags.feedback, menus.add, places.can_move)
    scene = Scene(board)
    Watch(scene, topics)
    rospy.on_shutdown(board.clear)
    while not rospy.is_shutdown():
        scene.expire()
        notes.expire()
        menus.check(MENUS_CHECKED)
        board.apply()
        rospy.rostime.wallsleep(1.0 / FRAME_RATE)


def _positive(name, default):
    value = rospy.get_param(name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0.0:
        raise ValueError('the parameter {} is {!r} instead of a number above 0'.format(name, value))
    return float(value)
