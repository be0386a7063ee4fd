"""Which fields a round brings up to date, and when there is one."""

import os
import subprocess
import sys

from support.browser import python_path

#: A page's numbers with a widget that notes what is set in place of viser's, and two locations of a node.
ROUNDS = """
from unittest import mock

from rosslt.msg import Location
from rosslt.node import Place
from rosslt.web.numbers import Numbers


def widget(label, value, **options):
    return mock.Mock(label=label, value=value, order=options['order'])


places = [Place('/car', Location(id=number, name=name, type='float', value='1.0')) for number, name in
          enumerate(['pedal', 'gear'])]
locations = mock.Mock()
locations.places.return_value = {'/car': places}
locations.is_changed.return_value = False
server = mock.MagicMock()
server.gui.add_text = mock.Mock(side_effect=widget)
numbers = Numbers(server, locations, mock.Mock(), mock.Mock())
numbers.update()
pedal, gear = (numbers._fields['/car', number].widget for number in (0, 1))
for place in places:
    place.location.value = '2.5'
locations.fresh.return_value = {('/car', 0): places[0], ('/car', 7): places[0]}
numbers.follow()
print(pedal.value, gear.value)
numbers.update()
print(pedal.value, gear.value)
"""

#: A page that is brought up to date once an hour, and news.
NEWS = """
import threading

from rosslt.web.refresh_timer import RefreshTimer

timer = RefreshTimer(rate=1.0 / 3600.0)
threading.Timer(0.1, timer.request).start()
timer.wait()
print('begun')
"""

#: News all the time, with a period of a twentieth of a second.
MUCH_NEWS = """
import time

from rosslt.web.refresh_timer import RefreshTimer

timer = RefreshTimer(rate=20.0)
begun = time.monotonic()
for _ in range(11):
    timer.request()
    timer.wait()
print(time.monotonic() - begun >= 0.5)
"""

#: No news at all.
NO_NEWS = """
from rosslt.web.refresh_timer import RefreshTimer

RefreshTimer(rate=20.0).wait()
print('begun')
"""

#: Whether a round begins, and whether anything is drawn, as a box appears, is told of again, and has moved.
TOLD = """
from unittest import mock

from visualization_msgs.msg import Marker

from rosslt.markers import Scene, Settings
from rosslt.web.things import Things

scene = Scene(Settings(draws_all=True))
things = Things(mock.MagicMock(), scene, mock.Mock(), mock.Mock(version=0), mock.Mock())
for x in (0.0, 0.0, 0.5):
    scene.on_news = mock.Mock()
    marker = Marker(type=Marker.CUBE)
    marker._connection_header = {}
    marker.header.frame_id = 'world'
    marker.pose.position.x = x
    marker.pose.orientation.w = marker.scale.x = marker.scale.y = marker.scale.z = 1.0
    scene.take('/box', marker, True)
    print(f'{scene.on_news.called}/{things.follow()}')
"""

#: Frames as tf has them: two that hang on each other, and some whose names YAML would read as something else.
FRAMES = """
from unittest import mock

import tf2_ros
from geometry_msgs.msg import TransformStamped

from rosslt.web.frames import Frames

core = tf2_ros.BufferCore()
for parent, child in (('there', 'back'), ('back', 'there'), ('1', 'yes'), ('1', "it's: 2.0"), ('world', '1')):
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = parent, child
    transform.transform.translation.x = transform.transform.rotation.w = 1.0
    core.set_transform_static(transform, 'test')
buffer = mock.Mock(all_frames_as_yaml=core.all_frames_as_yaml, lookup_transform=core.lookup_transform_core)
with mock.patch('tf2_ros.Buffer', return_value=buffer), mock.patch('tf2_ros.TransformListener'):
    frames = Frames(mock.MagicMock())
for frame in ('back', 'yes', "it's: 2.0", 'world'):
    frames.branch(frame)
with mock.patch('rosslt.web.frames.ROOT_PERIOD', -1.0):
    frames.update()
print(*frames.missing(), *frames.missing().values(), frames.pose('yes')[0], frames.pose("it's: 2.0")[0])
"""


def printed(code):
    """What a program prints that finds the page's modules."""
    done = subprocess.run(
        [sys.executable, '-c', code],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
        text=True,
        timeout=120,
        env=dict(os.environ, PYTHONPATH=python_path()),
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_change_that_an_owner_tells_of_is_shown_without_looking_at_all_fields():
    assert printed(ROUNDS) == ['2.5', '1.0', '2.5', '2.5']


def test_a_round_begins_when_something_changes():
    assert printed(NEWS) == ['begun']


def test_there_are_only_so_many_rounds_however_much_changes():
    assert printed(MUCH_NEWS) == ['True']


def test_there_are_rounds_without_news():
    assert printed(NO_NEWS) == ['begun']


def test_a_message_begins_a_round_and_what_it_changes_is_drawn():
    assert printed(TOLD) == ['True/True', 'True/False', 'True/True']


def test_frames_that_hang_on_each_other_or_have_odd_names_do_not_stop_the_page():
    assert printed(FRAMES) == ['back', 'world', '2.0', '2.0']
