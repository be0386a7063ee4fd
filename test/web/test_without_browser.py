"""How the page takes frames of tf and texts of others, without a browser."""

import os
import subprocess
import sys

from support.browser import python_path

#: Frames as tf has them: two that hang on each other, and some whose names YAML would read as something else.
FRAMES = """
import contextlib
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
    frames = Frames(mock.MagicMock(), contextlib.nullcontext(True))
for frame in ('back', 'yes', "it's: 2.0", 'world'):
    frames.branch(frame)
frames.find_root()
frames.update()
print(frames.pose('yes')[0], frames.pose("it's: 2.0")[0])
"""

#: The diff of a file that is not in UTF-8.
DIFF = r"""
from rosslt.web.markdown import block

print(ascii(block(b'+x = 1.5  # \xe4'.decode('utf-8', 'surrogateescape'), 'diff')))
"""

#: The hints of a parameter that the code has a default for, of one that a launch file gives, and of a literal.
HINTS = """
from rosslt import msg
from rosslt.node import Place
from rosslt.web.location_inputs import hint

origins = {'/n/height': {'file': '/my.launch', 'said': 2.0}}
for name in ('/n/width', '/n/height', 'radius'):
    print(hint(Place('/n', msg.Location(name=name, file='/n.py', line=7)), origins))
late = 'rospy.Rate at n.py:9 takes it at the next start'
print(hint(Place('/n', msg.Location(name='rate', file='/n.py', line=7, plain_copies=late)), origins))
"""

#: The folders of files with few and with many fields, and the buttons that open them, before and after more have come
#: and after one of these was clicked.
FOLDERS = """
import asyncio
import contextlib
from unittest import mock

from rosslt import msg
from rosslt.node import Place
from rosslt.web.location_inputs import Numbers

folders, buttons = [], []
def add(made, label, visible=True, **options):
    made.append(mock.MagicMock(label=label, visible=visible))
    return made[-1]

server, locations = mock.MagicMock(), mock.MagicMock()
server.gui.add_folder = lambda *given, **options: add(folders, *given, **options)
server.gui.add_button = lambda *given, **options: add(buttons, *given, **options)
numbers = Numbers(server, contextlib.nullcontext(True), locations, print, print)
few = [Place('/n', msg.Location(id=at, file='/few.py', fault='none')) for at in range(50)]
for count in (51, 60):
    many = [Place('/n', msg.Location(id=100 + at, file='/many.py', fault='none')) for at in range(count)]
    numbers._keep_folders({'/n': few + many})
    print([(folder.label, folder.visible) for folder in folders], [button.label for button in buttons])
((click,), _), = buttons[0].on_click.call_args_list
asyncio.run(click(None))
print([(folder.label, folder.visible) for folder in folders], buttons[0].remove.call_count)
"""

#: Where parameters stand in a YAML file that gives them, and what is said of others.
DOCUMENT = r"""
import json

from rosslt import msg
from rosslt.node import Place
from rosslt.web import documents

content = 'ä: &a 1.50\nname: "it\'s"\nis_on: Yes\nlines: "a\n  b"\nedited: 3'.encode()
said = {'ä': 1.5, 'name': "it's", 'is_on': True, 'lines': 'a b', 'edited': 2, 'arg': 1}
origins = {'/n/' + name: {'file': '/n.yaml', 'path': [name], 'said': value} for name, value in said.items()}
origins['/n/arg']['is_substituted'] = True
places = [
    Place('/n', msg.Location(id=at, name='/n/' + name, value=json.dumps(value), file='/n.py'))
    for at, (name, value) in enumerate(said.items())
]
assert {documents.file_of(place, origins) for place in places} == {'/n.yaml'}
assert documents.file_of(places[0], {}) == '/n.py'
document, _ = documents.read('/n.yaml', content, places, origins)
for mark in document.marks.values():
    print(*mark)
print(*document.notes, sep='\n')
"""

#: Numbers whose digits say another number in decimal, or in another unit, and some that look so.
NOT_DECIMAL = r"""
import json

import rosparam
import yaml

from rosslt import msg
from rosslt.node import Place
from rosslt.web import documents

content = 'octal: 010\nturned: !degrees 45\nnamed: !degrees &a 45\ndeg: deg(45)\nhex: 0x10\nlong: 1_000\ntext: "010"'
said = yaml.safe_load(content)
origins = {'/n/' + name: {'file': '/n.yaml', 'path': [name], 'said': value} for name, value in said.items()}
places = [
    Place('/n', msg.Location(id=at, name='/n/' + name, value=json.dumps(value), file='/n.py'))
    for at, (name, value) in enumerate(said.items())
]
document, _ = documents.read('/n.yaml', content.encode(), places, origins)
print([mark.token for mark in document.marks.values()])
print(*document.notes, sep='\n')
"""

#: What is said to two visitors who save the same, and to one who sends what is not taken, or what fails.
VISITORS = r"""
import contextlib
import json
import pathlib
import tempfile
from unittest import mock

from rosslt import files, msg
from rosslt.node import Place
from rosslt.web import saving
from rosslt.web.source_panel import SourcePanel, Visitor

file = pathlib.Path(tempfile.mkdtemp()) / 'n.py'
file.write_bytes(b'x = 1.5')
other = file.with_name('other.py')
other.symlink_to(file)
place = Place('/n', msg.Location(id=1, name='x', type='str', value='"a"', file=str(file)))
locations = mock.MagicMock(origins={})
locations.places.return_value = {'/n': [place]}
panel = SourcePanel(contextlib.nullcontext(True), locations)
visitors = [Visitor('one'), Visitor('other')]

def says(visitor, message):
    panel._take(visitor, message if isinstance(message, bytes) else json.dumps(message))
    print(*(one.get('refused') or one['said'].replace(str(file), 'n.py') for one in visitor.to_say))
    visitor.to_say.clear()

for visitor in visitors:
    visitor.file = str(file)
    edit = files.Edit(str(file), files.digest_of(b'x = 1.5'), 4, 7, b'1.5', b'2.5', 'x')
    visitor.offer = saving.Offer([], [edit], [], [])
with mock.patch('rosslt.node.changes_to_save', return_value=([edit], [])):
    print(saving.offer(str(file), [place]).lines)
for visitor in visitors:
    says(visitor, {'save': str(file)})
print(file.read_text())
says(visitors[0], {'save': str(file)})
for name in (str(other), f'{file.parent}/./n.py', str(file) + '\0'):
    says(visitors[0], {'open': name})
panel._take(visitors[0], json.dumps({'wish': {'number': '/n 1', 'text': '\ud800', 'turn': 1}}))
print(visitors[0].to_say.pop()['said'].isascii(), locations.wish.called)
visitors[0].to_say.clear()
says(visitors[0], b'{"hover": "\xff"}')
place.location.value = '5'
panel._take(visitors[0], json.dumps({'wish': {'number': '/n 1', 'text': 'b', 'turn': 1}}))
print([*visitors[0].to_say], locations.wish.call_args[0][1].value)
locations.wait_for_wishes.side_effect = ValueError('of something within')
says(visitors[0], {'diff': str(file)})
"""

#: What is selected as two clients click on things, and beside them.
CLICKS = """
import asyncio
import contextlib
from unittest import mock

from rosslt.web.clicks import Clicks

server = mock.MagicMock()
server.gui.add_checkbox.return_value.value = False
clients = {number: mock.MagicMock(client_id=number) for number in (1, 2)}
server.get_clients.return_value = clients
clicks = Clicks(server, contextlib.nullcontext(True))

def tell():
    clicks.update()
    print(sorted(clicks.selection.things))

def anywhere(number):
    ((clicked,), _), = clients[number].scene.on_click.return_value.call_args_list
    asyncio.run(clicked(mock.Mock(client=clients[number], client_id=number)))
    tell()

tell()
clicks.click(clients[1], 'a')
clicks.select(clients[2], 'b')
tell()
clicks.click(clients[1], 'c')  # the browser reports it as a click anywhere, too
anywhere(1)
anywhere(1)
del clients[2]
tell()
server.gui.add_checkbox.return_value.value = True
clicks.update()
print(clicks.selection.shows_all)
"""

#: The buttons for a row in the details of things with one and without, and what they do.
ROWS = """
from unittest import mock

from rosslt import values
from rosslt.web.details import Details

handle = mock.Mock(tracked=[], basis=None)
handle.name = '/stops::1'
offers = mock.MagicMock()
offers.choices.return_value, offers.can_be_free.return_value = [], False
offers.scene.handle.return_value = handle
for rows in ([], [('A_0', values.Source('/patrol', 7))], [(f'A_{n}', values.Source('/patrol', n)) for n in (3, 7)]):
    offers.rows.return_value = rows
    gui = mock.MagicMock()
    Details(offers, mock.MagicMock(), mock.MagicMock(), mock.MagicMock()).show(mock.Mock(gui=gui), handle)
    print([call[0] for call in gui.add_button_group.call_args_list])
_, ((click,), _) = gui.add_button_group.return_value.on_click.call_args_list
for title in gui.add_button_group.call_args[0][1]:
    click(mock.Mock(target=mock.Mock(value=title)))
print([(name, source.location_id, operation) for (name, source, operation), _ in offers.edit_row.call_args_list])
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
    return done.stdout.strip()


def test_frames_that_hang_on_each_other_or_have_odd_names_do_not_stop_the_page():
    assert printed(FRAMES) == '2.0 2.0'


def test_a_text_that_was_not_in_utf8_can_be_sent_to_a_browser():
    assert printed(DIFF) == r"'```diff\n+x = 1.5  # ?\n```'"


def test_parameters_are_marked_where_their_file_gives_them_or_named():
    assert printed(DOCUMENT).split('\n') == [
        '1 7 1.50 1.5',
        "2 8 it's it's",
        '3 8 Yes True',
        'not marked are /n/~lines: it is written in several lines',
        'not marked are /n/~edited: the file has changed since it was loaded, or says no single value there',
        'not marked are /n/~arg: it stands in /n.yaml through a substitution',
    ]


def test_a_number_that_would_be_typed_as_another_one_is_not_marked():
    assert printed(NOT_DECIMAL).split('\n') == [
        "['deg(45)', '0x10', '1_000', '010']",
        'not marked are /n/~octal: it is not written as a decimal number',
        'not marked are /n/~turned, /n/~named: it is written in degrees, and the value is in radians',
    ]


def test_one_diff_is_saved_once_and_what_fails_ends_no_connection():
    shown, *said = printed(VISITORS).split('\n')
    assert shown == "[('-', 'x = 1.5'), ('+', 'x = 2.5')]"
    assert said[0] == 'saved in n.py'
    assert said[1].startswith('nothing is written: ')
    assert said[1].endswith('it was edited at this moment; try again')
    assert said[2:4] == ['x = 2.5', 'there is no diff to save']
    assert said[4:7] == ['no location stands in this file'] * 3
    assert said[7] == 'True False'
    assert said[8].startswith('this is not JSON: ')
    assert said[9:] == ['[] b', 'this has failed; the log of `rosslt web` says why']


def test_the_hint_of_a_parameter_says_where_it_is_given():
    assert printed(HINTS).split('\n') == [
        'a parameter, read at /n.py:7',
        'given in /my.launch, read at /n.py:7',
        '/n.py:7',
        '/n.py:7, rospy.Rate at n.py:9 takes it at the next start',
    ]


def test_the_folder_of_many_fields_is_a_button_until_it_is_opened():
    few = "('/n', True), ('few.py', True)"
    assert printed(FOLDERS).split('\n') == [
        '/n',
        f"[{few}, ('many.py', False)] ['many.py: show 51 numbers']",
        f"[{few}, ('many.py', False)] ['many.py: show 60 numbers']",
        f"[{few}, ('many.py', True)] 1",
    ]


def test_each_visitor_selects_a_thing_and_all_are_shown():
    assert printed(CLICKS).split('\n') == ['[]', "['a', 'b']", "['b', 'c']", "['b']", '[]', 'True']


def test_the_details_have_buttons_for_the_row_of_a_thing():
    titles = ['Duplicate', 'Delete', 'Move up', 'Move down']
    done = [('/stops::1', 7, operation) for operation in ('duplicate', 'delete', 'up', 'down')]
    several = [('Row A_3', titles), ('Row A_7', titles)]
    assert printed(ROWS).split('\n') == ['[]', str([('Row', titles)]), str(several), str(done)]
