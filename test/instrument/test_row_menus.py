"""Rows of a list, waypoints say, which are duplicated, moved and deleted in the menus of their handles."""

import subprocess

import pytest

from support.processes import wait_until
from support.shell import failure, rosslt
from support.unmodified import Unmodified

pytestmark = pytest.mark.rostest

PATROL = """import rospy
from visualization_msgs.msg import Marker, MarkerArray

WAYPOINTS = [
    (0.25, 1.0),  # the dock
    (1.25, 3.0),
    (2.25, 1.5),
]
HEIGHT = 0.75
rospy.init_node('patrol')
pub = rospy.Publisher('stops', MarkerArray, queue_size=1)


def ball(number, x, y):
    made = Marker(id=number, type=Marker.SPHERE)
    made.header.frame_id = 'world'
    made.scale.x = made.scale.y = made.scale.z = made.color.a = 1
    made.pose.orientation.w = 1
    made.pose.position.x, made.pose.position.y, made.pose.position.z = x, y, HEIGHT
    return made


while not rospy.is_shutdown():
    balls = [ball(number, x, y) for number, (x, y) in enumerate(WAYPOINTS)]
    between = ball(3, (WAYPOINTS[0][0] + WAYPOINTS[1][0]) / 2, WAYPOINTS[1][1])
    pub.publish(MarkerArray(markers=balls + [between]))
    rospy.sleep(0.05)
"""


def titles(hand, name):
    """The titles of a handle's menu, and of its submenu `Row`."""
    entries = hand.marker(name).menu_entries
    rows = [entry.id for entry in entries if entry.title == 'Row']
    return [entry.title for entry in entries if not entry.parent_id], [
        entry.title for entry in entries if entry.parent_id in rows
    ]


def said(hand, name, text):
    """Wait for a note at a handle that has a text, on whatever lines."""
    note = name + ':note'
    wait_until(
        lambda: note in hand.names() and text in ' '.join(hand.marker(note).controls[0].markers[0].text.split()),
        lambda: f'{text!r} to be said; it is {hand.marker(note).controls[0].markers[0].text!r}',
    )


def test_a_waypoint_is_duplicated_moved_and_refused_in_its_menu(hand, tmp_path):
    with Unmodified(tmp_path, 'patrol', PATROL) as node:
        wait_until(lambda: 'Row' in titles(hand, '/stops::1')[0], 'the row is known')
        assert titles(hand, '/stops::1')[1] == ['Duplicate', 'Delete', 'Move up', 'Move down']
        wait_until(lambda: any('HEIGHT' in title for title in titles(hand, '/stops::3')[0]), 'its numbers are known')
        several = ['WAYPOINTS_0_0', 'WAYPOINTS_1_1']
        wait_until(lambda: titles(hand, '/stops::3')[1] == several, lambda: titles(hand, '/stops::3'))
        hand.choose('/stops::3', 'Duplicate')
        said(hand, '/stops::3', 'duplicated WAYPOINTS_0 in patrol.py')
        dock = '    (0.25, 1.0),  # the dock\n'
        assert node.file.read_text() == PATROL.replace(dock, dock * 2)
        rosslt('undo', '/patrol')
        assert node.file.read_text() == PATROL

        hand.choose('/stops::1', 'Duplicate')
        said(
            hand,
            '/stops::1',
            'duplicated WAYPOINTS_1 in patrol.py; /patrol has the rows as they are now at its next start',
        )
        twice = PATROL.replace('    (1.25, 3.0),\n', '    (1.25, 3.0),\n' * 2)
        assert node.file.read_text() == twice

        hand.choose('/stops::0', 'Move up')
        refusal = 'patrol.py:5:5: it is the first row of its list, and cannot move up'
        said(hand, '/stops::0', 'nothing is written: ' + refusal)
        assert failure('row', 'up', '/patrol/WAYPOINTS_0') == f'rosslt row: nothing is written: {tmp_path}/{refusal}'
        assert node.file.read_text() == twice

        assert rosslt('undo', '/patrol').stdout.startswith('/patrol/WAYPOINTS_1_0\tduplicate\tundone\t')
        assert node.file.read_text() == PATROL
        hand.choose('/stops::1', 'Duplicate')
        wait_until(lambda: node.file.read_text() == twice, 'it is done again')

        assert rosslt('lock', '/patrol/WAYPOINTS_2_1', '--reason', 'it is measured').returncode == 0
        hand.choose('/stops::1', 'Duplicate')
        said(hand, '/stops::1', '/patrol refuses: /patrol/WAYPOINTS_2_1 is locked by')
        assert node.file.read_text() == twice
        assert rosslt('unlock', '/patrol').returncode == 0

        assert rosslt('set', '/patrol/WAYPOINTS_2_0', '2.5').returncode == 0
        hand.choose('/stops::2', 'Delete')
        said(hand, '/stops::2', 'WAYPOINTS_2_0 is changed, and not saved: `rosslt save /patrol` first')
        assert node.file.read_text() == twice


def row_ids(hand, name):
    """The ids of the entries of a handle's submenu `Row`, which say of which number they are."""
    entries = hand.marker(name).menu_entries
    rows = [entry.id for entry in entries if entry.title == 'Row']
    return [entry.id for entry in entries if entry.parent_id in rows]


def test_a_call_of_a_live_script_has_the_same_menu(hand, tmp_path):
    first, second = 'goto(2.0, 1.00, lift + 1.5)  # in\n', 'goto(-1, 2, lift)\n'
    text = 'lift = 0.25\n' + first + '\n' + second
    file = tmp_path / 'tour.script'
    file.write_text(text)
    process = subprocess.Popen(['rosrun', 'rosslt', 'interactive_script', f'_file:={file}', '__name:=tour'])
    try:
        wait_until(lambda: 'Row' in titles(hand, '/waypoint')[0], lambda: titles(hand, '/waypoint'))
        assert titles(hand, '/waypoint')[1] == ['Duplicate', 'Delete', 'Move up', 'Move down']
        changed = [title for title in titles(hand, '/waypoint')[0] if '(default)' in title]
        free = 'tour.script:2:6, tour.script:2:11, tour.script:1:8'
        assert changed == [f'[x] {free} (default)'], 'a row of a script holds none'
        listed, ids = rosslt('list', '/tour').stdout, row_ids(hand, '/waypoint')
        hand.choose('/waypoint', 'Move up')
        said(hand, '/waypoint', 'nothing is written: tour.script:2:1: it is the first row of its list')
        for title, done, after in (
            ('Duplicate', 'duplicated line 2', first * 2 + '\n' + second),
            ('Move down', 'moved line 2 down', second[:-1] + '\n\n' + first),
            ('Delete', 'deleted line 2', '\n' + second),
        ):
            hand.choose('/waypoint', title)
            said(hand, '/waypoint', f'{done} in tour.script; /tour runs the script again')
            assert file.read_text() == 'lift = 0.25\n' + after
            wait_until(lambda: rosslt('list', '/tour').stdout != listed, 'the script runs again')
            undone = rosslt('undo', '/tour')
            assert undone.stderr == 'rosslt undo: /tour runs the script again\n'
            assert file.read_text() == text
            wait_until(lambda: rosslt('list', '/tour').stdout == listed, 'the script runs as before')
            wait_until(lambda: row_ids(hand, '/waypoint') == ids, 'the menu is of the first row again')
    finally:
        process.terminate()
        process.wait(60)
