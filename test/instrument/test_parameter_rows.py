"""Rows of lists in YAML and launch files that `rosslt launch` has read."""

from geometry_msgs.msg import PointStamped

from support.packages import launched, package_of_node
from support.saving import change, places, save
from support.shell import failure, rosslt

TOUR = """
import rospy
from geometry_msgs.msg import PointStamped

rospy.init_node('tour')
pub = rospy.Publisher('tour', PointStamped, queue_size=1)
stops, rail = rospy.get_param('~stops'), rospy.get_param('/rail')
speed = rospy.get_param('~speed')
while not rospy.is_shutdown():
    p = PointStamped()
    p.point.x, p.point.y = sum(stop['x'] for stop in stops), sum(x + speed for x, _ in rail)
    pub.publish(p)
    rospy.sleep(0.03)
"""

LAUNCH_FILE = """<launch>
  <rosparam>
    rail:
    - [1.5, 2.5]  # ä
    - [3.5, 4.5]
  </rosparam>
  <node pkg="tour_package" type="tour.py" name="tour">
    <param name="speed" value="0.5"/>
    <rosparam file="{folder}/stops.yaml"/>
  </node>
</launch>
"""

STOPS = '# all\nstops:\n  - {x: 1.0, y: 2}\n  - {x: 2.0, y: 2}  # the door\n  - {x: 3.0, y: 2}\n'


def test_a_row_is_written_where_it_stands_and_others_are_saved_beside_it(master, hearing, tmp_path):
    environment = package_of_node(tmp_path, 'tour_package', 'tour.py', TOUR)
    launch, stops = tmp_path / 'tour.launch', tmp_path / 'stops.yaml'
    launch.write_text(LAUNCH_FILE.format(folder=tmp_path), encoding='utf-8')
    stops.write_text(STOPS, encoding='utf-8')
    before = launch.read_text(encoding='utf-8')
    heard = hearing('tour', PointStamped)
    start = ['rosslt', 'launch', '--no-markers', str(launch)]

    def done(*arguments):
        result = rosslt('row', *arguments)
        assert result.returncode == 0, result.stderr
        return result

    def undone(operation):
        result = rosslt('undo', '/tour')
        assert (result.returncode, result.stdout.split('\t')[1:3]) == (0, [operation, 'undone']), result.stderr
        assert result.stderr == 'rosslt undo: the next `rosslt launch` of the file has the rows as they are now\n'

    with launched(environment, *start):
        assert heard.next().point.x == 6.0
        ids = {place.local_name: place.location.id for place in places('/tour')}
        assert '+  - {x: 2.0, y: 2}  # the door' in done('duplicate', '/tour/~stops/1', '--diff').stdout
        assert stops.read_text(encoding='utf-8') == STOPS
        made = done('duplicate', '/tour/~stops/1/x')
        assert made.stdout == f'/tour/~stops/1/x\tduplicate\t{stops}:5\n'
        assert made.stderr == 'rosslt row: the next `rosslt launch` of the file has the rows as they are now\n'
        door = '  - {x: 2.0, y: 2}  # the door\n'
        twice = STOPS.replace(door, door * 2)
        assert stops.read_text(encoding='utf-8') == twice
        assert rosslt('lock', '/tour').returncode == 0
        assert failure('row', 'up', '/tour/~stops/2').startswith('rosslt row: /tour refuses: /tour is locked by')
        assert rosslt('unlock', '/tour').returncode == 0
        change('/tour', {ids['~stops/2/x']: 3.5})
        refused = failure('row', 'up', '/tour/~stops/2')
        assert f'{stops}: ~stops/2/x is changed, and not saved: `rosslt save /tour` first' in refused
        save('/tour')
        assert stops.read_text(encoding='utf-8') == twice.replace('3.0', '3.5')
        done('delete', '/tour/~stops/0')
        gone = stops.read_text(encoding='utf-8')
        done('up', '/tour/~stops/2')
        done('duplicate', '/tour/~stops/1')
        undone('duplicate')
        undone('up')
        assert stops.read_text(encoding='utf-8') == gone
        undone('delete')
        assert stops.read_text(encoding='utf-8') == twice.replace('3.0', '3.5')
        change('/tour', {ids['~stops/0/x']: 1.2})
        change('/tour', {ids['~stops/2/x']: 3.7})
        save('/tour')
        assert stops.read_text(encoding='utf-8') == twice.replace('3.0', '3.7').replace('1.0', '1.2')
        change('/tour', {ids['~stops/0/x']: 1.0, ids['~stops/2/x']: 3.5})
        save('/tour')
        done('delete', '/tour/~stops/0')
        done('up', '/tour/~stops/2')
        change('/tour', {ids['~stops/1/x']: 2.25})
        save('/tour')
        head, copied, saved = '# all\nstops:\n', '  - {x: 2.0, y: 2}  # the door\n', '  - {x: 2.25, y: 2}  # the door\n'
        assert stops.read_text(encoding='utf-8') == head + saved + '  - {x: 3.5, y: 2}\n' + copied
        change('/tour', {ids['~stops/0/x']: 9.0})
        assert 'its row was deleted' in failure('save', '/tour')
        done('down', '/tour//rail/0')
        assert launch.read_text(encoding='utf-8') == before.replace(
            '[1.5, 2.5]  # ä\n    - [3.5, 4.5]', '[3.5, 4.5]\n    - [1.5, 2.5]  # ä'
        )
        assert 'no list of alike rows stands here' in failure('row', 'down', '/tour/~speed')
    with launched(environment, *start):
        heard.next(lambda message: message.point.x == 2.25 + 3.5 + 2.0)
        # The node of now has read the rows where they stood before the undo.
        undone('down')
        assert launch.read_text(encoding='utf-8') == before
        change('/tour', {ids['/rail/0/0']: 4.5})
        save('/tour')
        assert launch.read_text(encoding='utf-8') == before.replace('[3.5', '[4.5')
