"""The command `rosslt`, run as people and scripts run it, beside real nodes."""

import json
import os
import re
import signal
import subprocess
import sys

import pytest
import rospy
import yaml
from rosslt.srv import ChangeSources, ListLocations

from rosslt.cli import verb
from support.processes import Node, wait_until
from support.shell import failure, lines, on_terminal, rosslt
from support.unmodified import Unmodified

pytestmark = pytest.mark.rostest


def place(talker, text):
    """file:line:column of a call in the talker's code."""
    with open(talker.file, encoding='utf-8') as file:
        code = file.read().splitlines()
    (number,) = (number for number, line in enumerate(code, 1) if text in line)
    return '{}:{}:{}'.format(talker.file, number, code[number - 1].index('rosslt.location') + 1)


#: What `talker` begins with in every test.
BEGINNING = {'radius': 2.0, 'frame': 'world', 'count': 3, 'is/on': True, '/talker/parking/0': 0.0, '/height': 0.75}


@pytest.fixture
def talker(nodes):
    """The node /talker with the values of BEGINNING."""
    put(BEGINNING)
    return nodes


def put(values):
    """Change locations of /talker, quicker than with the command."""
    locations = rospy.ServiceProxy('/talker/rosslt/list_locations', ListLocations)().locations
    ids = {location.name: location.id for location in locations}
    answer = rospy.ServiceProxy('/talker/rosslt/change_sources', ChangeSources)(
        requester='test', location_ids=[ids[name] for name in values], values=list(map(json.dumps, values.values()))
    )
    assert answer.state == 'applied', answer


class TestEveryVerb:
    def test_has_help_and_an_exit_code(self):
        assert sorted(re.findall(r'^  (\w+) ', rosslt('-h').stdout, re.MULTILINE)) == verb.names()
        result = rosslt('graph', '--dot', '--svg')
        assert (result.returncode, result.stdout) == (2, '')
        assert 'usage: ' in result.stderr

    @pytest.mark.parametrize('arguments', [('list',), ('set', '/talker/radius', '1'), ('echo', '/gate')])
    def test_says_in_one_line_that_there_is_no_master(self, arguments):
        line = failure(*arguments, ROS_MASTER_URI='http://localhost:1')
        assert (
            line
            == 'rosslt {}: found no ROS master at http://localhost:1: is roscore running, and '
            'ROS_MASTER_URI right?'.format(arguments[0])
        )

    def test_does_not_wait_for_a_master_that_hangs(self, master):
        with subprocess.Popen(
            [
                sys.executable,
                '-c',
                'import socket, time; s = socket.socket(); s.bind(("localhost", 0)); '
                's.listen(5); print(s.getsockname()[1], flush=True); time.sleep(60)',
            ],
            stdout=subprocess.PIPE,
        ) as silent:
            port = int(silent.stdout.readline())
            assert 'found no ROS master' in failure('list', ROS_MASTER_URI=f'http://localhost:{port}')
            silent.kill()

    def test_leaves_neither_a_parameter_nor_a_node_behind(self, talker, master):
        def state():
            publishers, subscribers, services = master.getSystemState()
            return {node for part in (publishers, subscribers, services) for _, nodes in part for node in nodes}

        rosslt('force', '/gate/pose/position/x', '9')  # the node keeps its last request
        before = set(master.getParamNames())
        rosslt('force', '/gate/pose/position/x', '10', '_private:=1', '__name:=somebody')
        rosslt('force', '/gate/pose/position/x', '10')
        rosslt('echo', '--once', '/gate')
        rosslt('graph', '--time', '0.5')
        rosslt('list')
        assert set(master.getParamNames()) == before
        wait_until(lambda: state() <= {'/talker', '/relay'}, 'only the nodes are left')

    def test_ends_quietly_where_the_reader_of_the_pipe_goes(self, talker):
        result = subprocess.run(
            'rosslt echo /gate | head -n 1', shell=True, capture_output=True, text=True, timeout=60, check=False
        )
        assert (len(result.stdout.splitlines()), result.stderr) == (1, '')


class TestList:
    def test_prints_name_type_value_bounds_and_file_of_each_location(self, talker):
        listed = {line[0]: line[1:] for line in lines('list', '/talker')}
        assert listed['/talker/radius'][:6] == ['float', '2.0', '0.5', '10.0', '', place(talker, "'radius'")]
        assert listed['/talker/frame'][:2] == ['str', '"world"']
        assert listed['/talker/fixed'][4] == 'read-only'
        assert listed['/talker/is/on'][:2] == ['bool', 'true']
        assert listed['/talker/~parking/1'][:2] == ['float', '-1.0']
        assert listed['/talker//height'][:2] == ['float', '0.75']
        assert lines('list') == lines('list', 'talker')

    def test_is_a_table_on_a_terminal(self, talker):
        printed = on_terminal('list')
        assert re.search(r'^/relay\n/talker\n', printed)
        (row,) = re.findall(r'^  radius .*$', printed, re.MULTILINE)
        assert row.split() == ['radius', 'float', '2.0', '0.5', '..', '10.0', row.split()[-1]]
        assert row.endswith(os.path.basename(place(talker, "'radius'")))
        assert max(map(len, printed.splitlines())) <= 120

    def test_what_has_a_name_stands_before_colours_and_factors(self, talker, tmp_path):
        program = """
import rospy
from std_msgs.msg import ColorRGBA

rospy.init_node('painter')
shades, rate = rospy.Publisher('shades', ColorRGBA, queue_size=1), rospy.Rate(20)


def shade(light):
    return ColorRGBA(0.75, 1.5 * light, 0.25, 1.0)


light = 0.5
while not rospy.is_shutdown():
    shades.publish(shade(light))
    rate.sleep()
"""
        with Unmodified(tmp_path, 'painter', program):
            wait_until(lambda: '/painter/light' in rosslt('list', '/painter').stdout, 'its numbers')
            assert [line[2] for line in lines('list', '/painter')] == ['0.5', '0.75', '0.25', '1.0', '1.5']

    def test_says_which_node_does_not_answer_and_lists_the_others(self, talker):
        with Node('sleeper', "rosslt.location(1.0, name='x')\nrospy.spin()") as sleeper:
            sleeper.process.send_signal(signal.SIGSTOP)
            result = rosslt('list')
            assert result.returncode == 1
            assert result.stderr == 'rosslt list: cannot reach /sleeper: no answer within the timeout\n'
            assert '/talker/radius\t' in result.stdout
        # on a busy machine it may have had to be killed
        subprocess.run(
            ['rosnode', 'cleanup'], input='y\n', text=True, stdout=subprocess.DEVNULL, timeout=60, check=True
        )

    def test_says_why_a_location_has_no_value_and_lists_the_others(self, talker):
        code = """
            def get():
                if made:
                    raise OSError('the port is closed')
                return 1.0
            made = []
            made.append(rosslt.location(getter=get, setter=print, name='port'))
            rosslt.location(2.0, name='beside')
            rospy.spin()
            """
        with Node('faulty', code):
            wait_until(lambda: len(rosslt('list', '/faulty').stdout.splitlines()) == 2, 'both are listed')
            listed = {line[0]: line[1:] for line in lines('list', '/faulty')}
            why = 'the getter of port fails: OSError: the port is closed'
            assert (listed['/faulty/port'][1], listed['/faulty/port'][7]) == ('', why)
            assert listed['/faulty/beside'][1] == '2.0'
            assert why in on_terminal('list', '/faulty')
            assert failure('get', '/faulty/port') == f'rosslt get: /faulty/port has no value: {why}'

    def test_of_one_location_prints_that(self, talker):
        every = lines('list', '/talker')
        for text in '/talker/radius', 'talker/radius', '/talker/~parking/1', '/talker/parking/1', '/talker//height':
            name = '/' + text.lstrip('/').replace('/parking', '/~parking')
            assert lines('list', text) == [line for line in every if line[0] == name]
        assert on_terminal('list', '/talker/fixed').split()[:2] == ['/talker', 'fixed']

    def test_of_what_is_not_there_says_what_may_be_meant(self, talker):
        none = 'rosslt list: there is no node {} with locations'.format
        assert failure('list', '/nobody') == none('/nobody')
        assert failure('list', '/taker/radius') == none('/taker/radius') + ' (did you mean /talker?)'
        assert failure('list', '/talker/radiu') == (
            'rosslt list: /talker has no location radiu (did you mean radius?); see rosslt list /talker'
        )


class TestGetAndSet:
    @pytest.mark.parametrize(
        ('location', 'value', 'shown'),
        [
            ('radius', '2.5', '2.5'),
            ('radius', '3', '3.0'),
            ('radius', '1e0', '1.0'),
            ('count', '-7', '-7'),
            ('is/on', 'false', 'false'),
            ('frame', 'map of:=all "rooms"', 'map of:=all "rooms"'),
            ('frame', '1.5', '1.5'),
            ('~parking/0', '-0.25', '-0.25'),
            ('~parking/0', '-1e-1', '-0.1'),
            ('/height', '0.5', '0.5'),
        ],
    )
    def test_what_was_set_is_what_is_got(self, talker, location, value, shown):
        assert rosslt('set', '/talker/' + location, value).returncode == 0
        assert rosslt('get', 'talker/' + location).stdout == shown + '\n'

    def test_set_prints_what_has_changed(self, talker):
        assert lines('set', '/talker/radius', '4.5') == [['/talker/radius', '2.0', '4.5', place(talker, "'radius'")]]
        assert re.match(
            r'/talker/radius: 4\.5 -> 2\.0  \[talker\.py:\d+:\d+\]\n', on_terminal('set', '/talker/radius', '2')
        )

    def test_a_location_is_found_by_its_id_too(self, talker):
        (source,) = json.loads(rosslt('echo', '--once', '--json', '/gate/pose/position/x').stdout)['provenance'][
            'pose.position.x'
        ]['sources']
        assert rosslt('get', '{node}#{location_id}'.format(**source)).stdout == '2.0\n'

    @pytest.mark.parametrize(
        ('location', 'value', 'reason'),
        [
            ('radius', '0.1', '/talker refuses: 0.1 is below its minimum 0.5'),
            ('radius', 'far', "/talker/radius: 'far' is not a float"),
            ('radius', 'nan', "/talker/radius: 'nan' is not finite"),
            ('radius', '-inf', "/talker/radius: '-inf' is not finite"),
            ('count', '1.5', "/talker/count: '1.5' is not an int"),
            ('is/on', '1', "/talker/is/on: '1' is neither true nor false"),
            ('fixed', '2', '/talker refuses: fixed is read-only'),
            ('nothing', '2', '/talker has no location nothing; see rosslt list /talker'),
        ],
    )
    def test_what_does_not_fit_is_refused_with_a_reason(self, talker, location, value, reason):
        assert failure('set', '/talker/' + location, value) == 'rosslt set: ' + reason

    def test_a_node_that_is_not_there_is_said_so(self, talker):
        assert (
            failure('get', '/nobody/radius')
            == 'rosslt get: /nobody/radius begins with no node that has locations; see rosslt list'
        )
        assert failure('get', '/talker') == 'rosslt get: /talker is a node; rosslt list /talker has its locations'

    def test_names_are_those_of_the_namespace(self, talker):
        assert rosslt('get', 'radius', ROS_NAMESPACE='/talker').stdout == '2.0\n'
        assert rosslt('echo', '--once', 'pose/position/x', ROS_NAMESPACE='/gate').stdout.startswith('pose.position.x\t')


class TestEcho:
    def test_prints_the_provenance_of_an_ordinary_message_beside_its_fields(self, talker):
        printed = lines('echo', '--once', '/gate')
        short = os.path.basename(place(talker, "'radius'"))
        assert ['pose.position.x', '7.0', f'3 * 2.0 [radius, {short}] + 1.0'] in printed
        assert ['pose.orientation.x', '0.0', ''] in printed
        assert printed[-1] == ['---']

    def test_prints_that_of_a_tracked_type_that_another_node_sends_on(self, talker):
        printed = lines('echo', '-n', '2', '/pose/position/x')
        short = os.path.basename(place(talker, "'radius'"))
        assert printed == [['position.x', '7.0', f'3 * 2.0 [radius, {short}] + 1.0'], ['---']] * 2

    def test_is_yaml_on_a_terminal_with_the_provenance_in_comments(self, talker):
        printed = on_terminal('echo', '--once', '/gate')
        short = os.path.basename(place(talker, "'radius'"))
        assert re.search(r'^    x: 7\.0 +# 3 \* 2\.0 \[radius, {}\] \+ 1\.0$'.format(short), printed, re.MULTILINE)
        message = yaml.safe_load(printed.replace('---\n', ''))
        assert message['header']['frame_id'] == 'world'
        assert message['pose']['position'] == {'x': 7.0, 'y': 2.0, 'z': 0.75}

    def test_prints_json_with_where_each_source_is(self, talker):
        printed = json.loads(rosslt('echo', '--once', '--json', '/gate').stdout)
        assert printed['topic'] == '/gate'
        assert printed['publisher'] == '/talker'
        assert printed['value']['pose']['position']['x'] == 7.0
        (source,) = printed['provenance']['pose.position.x']['sources']
        assert '{file}:{line}:{column}'.format(**source) == place(talker, "'radius'")
        assert (source['node'], source['name']) == ('/talker', 'radius')

    def test_says_what_fields_there_are_instead_of_one_that_is_not(self, talker):
        assert (
            failure('echo', '/gate/pose/place')
            == "rosslt echo: geometry_msgs/Pose has no field 'place', its fields are position, orientation"
        )

    def test_of_a_topic_that_nobody_publishes_fails(self, talker):
        assert failure('echo', '/nothing') == 'rosslt echo: nobody publishes /nothing'

    def test_without_a_count_is_ended_by_an_interrupt(self, talker):
        process = subprocess.Popen(
            ['rosslt', 'echo', '/gate/pose/position/x'], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert process.stdout.readline().startswith('pose.position.x')
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        assert (process.returncode, errors) == (0, '')


class TestExplain:
    def test_says_which_verb_is_for_a_node_or_a_location(self, talker):
        told = 'rosslt explain: nobody publishes /talker'
        assert failure('explain', 'talker') == told + '; /talker is a node: `rosslt list /talker` has its locations'
        assert failure('explain', '/talker/radius').endswith(
            '; /talker/radius is a location: `rosslt get /talker/radius` has its value, and `rosslt graph` the fields '
            'that it reaches'
        )
        assert failure('explain', '/talker/nothing').startswith(told + '/nothing')
        assert 'location' not in failure('explain', '/talker/nothing')

    def test_says_that_a_node_was_killed(self, master):
        code = """
            publisher = rosslt.Publisher('lost', Float64, queue_size=1)
            while not rospy.is_shutdown():
                publisher.publish(rosslt.location(2.0, name='scale'))
                rospy.sleep(0.05)
            """
        with Node('losing', code) as node:
            wait_until(lambda: rosslt('explain', '/lost/data').returncode == 0, 'it publishes')
            node.process.kill()
            node.process.wait()
            for words in (['/lost/data', '--timeout', '0.5'], ['/losing/scale']):
                told = failure('explain', *words)
                assert '; cannot reach /losing: nothing listens at its address ' in told
                assert told.endswith(' it has been killed. `rosnode cleanup` has the master forget it')


class TestForce:
    def test_changes_the_source_and_prints_what_changed(self, talker):
        (line,) = lines('force', '/gate/pose/position/x', '13')
        *changed, messages, milliseconds = line
        assert changed == ['/talker/radius', '2.0', '4.0', place(talker, "'radius'")]
        assert int(messages) >= 1
        assert int(milliseconds) >= 0
        assert rosslt('get', '/talker/radius').stdout == '4.0\n'

    def test_reaches_through_another_node(self, talker):
        lines('force', '/pose/position/x', '13')
        assert rosslt('get', '/talker/radius').stdout == '4.0\n'

    def test_changes_a_whole_part_together(self, talker):
        changed = lines('force', '/gate/pose/position', '{x: 10, y: 3.5}')
        assert [line[:3] for line in changed] == [
            ['/talker/radius', '2.0', '3.0'],
            ['/talker/~parking/0', '0.0', '0.5'],
        ]

    def test_changes_the_source_that_it_is_told(self, talker):
        changed = lines('force', '/gate/pose/position/y', '1.5', '--source', '/talker/~parking/0')
        assert [line[:3] for line in changed] == [['/talker/~parking/0', '0.0', '-0.5']]
        by_file = lines('force', '/gate/pose/position/y', '2.5', '--source', place(talker, "'radius'").split('/')[-1])
        assert [line[:3] for line in by_file] == [['/talker/radius', '2.0', '3.0']]

    def test_dry_run_prints_what_would_change_and_changes_nothing(self, talker):
        assert lines('force', '/gate/pose/position/x', '13', '--dry-run') == [
            ['/talker/radius', '2.0', '4.0', place(talker, "'radius'")]
        ]
        assert on_terminal('force', '/gate/pose/position/x', '13', '--dry-run').startswith(
            'would change /talker/radius: 2.0 -> 4.0'
        )
        assert rosslt('get', '/talker/radius').stdout == '2.0\n'

    def test_changes_a_text(self, talker):
        lines('force', '/gate/header/frame_id', 'map')
        assert rosslt('get', '/talker/frame').stdout == 'map\n'

    @pytest.mark.parametrize(
        ('field', 'value', 'reason'),
        [
            ('/gate/pose/orientation/x', '1', 'nothing'),
            ('/gate/pose/position/x', '100', 'above its maximum 10.0'),
            ('/gate/pose/orientation/w', '0.5', 'read-only'),
            ('/gate/pose/position', '{u: 1}', "geometry_msgs/Point has no field 'u', its fields are x, y, z"),
            ('/gate/pose/position', '{x: near}', "x of the value: 'near' is not a float"),
            ('/gate/pose/position', '5', 'must be given as {FIELD: VALUE, ...}'),
            ('/gate/pose/position/x', 'near', "'near' is not a float"),
            ('/gate/pose/position/x', '-nan', "'-nan' is not finite"),
            ('/gate/pose/position/x', '-1e-1', 'below its minimum 0.5'),
        ],
    )
    def test_says_why_it_cannot(self, talker, field, value, reason):
        assert reason in failure('force', field, value, '--timeout', '60')

    def test_says_what_the_sources_are_where_it_is_told_another(self, talker):
        assert (
            failure('force', '/gate/pose/position/x', '5', '--source', '/talker/count')
            == 'rosslt force: /talker/count is not among its sources, which are /talker/radius'
        )

    def test_does_not_wait_for_a_message_for_ever(self, talker):
        with Node('mute', "publisher = rosslt.Publisher('mute', Point, queue_size=1)\nrospy.spin()"):
            wait_until(
                lambda: 'nobody' not in rosslt('force', '/mute/x', '1', '--timeout', '0.1').stderr, 'it publishes'
            )
            words = ('force', '/mute/x', '1', '--timeout', '0.5')
            assert failure(*words) == 'rosslt force: no message on /mute within 0.5 s'


class TestSave:
    def test_writes_what_rosparam_load_puts_in_force_again(self, talker, master, tmp_path):
        changed = {'radius': '4.25', 'frame': 'map', '~parking/0': '9.0', '/height': '2.0'}
        for location, value in changed.items():
            rosslt('set', '/talker/' + location, value)
        saved = tmp_path / 'talker.yaml'
        result = rosslt('save', '/talker', str(saved))
        assert result.returncode == 0
        assert result.stderr == 'rosslt save: not saved, as no parameter stands behind them: pin\n'
        assert yaml.safe_load(saved.read_text(encoding='utf-8')) == {
            'height': 2.0,
            'talker': {
                'parking': [9.0, -1.0],
                'rosslt': {'radius': 4.25, 'frame': 'map', 'fixed': 1.0, 'count': 3, 'is': {'on': True}},
            },
        }
        put(BEGINNING)
        subprocess.run(['rosparam', 'load', str(saved)], check=True, timeout=60)
        for location, value in changed.items():
            wait_until(lambda: rosslt('get', '/talker/' + location).stdout == value + '\n', location)  # noqa: B023

    def test_writes_a_file_that_is_not_called_yaml_only_where_it_is_asked_for(self, talker, tmp_path):
        odd = tmp_path / 'sensor_tf'
        refused = rosslt('save', '/talker', str(odd))
        assert refused.returncode == 2
        assert f'{odd} does not end in .yaml; if it is the file to write, say -o {odd}' in refused.stderr
        assert not odd.exists()
        assert rosslt('save', '/talker', '-o', str(odd)).returncode == 0
        assert yaml.safe_load(odd.read_text(encoding='utf-8'))['talker']['parking']

    def test_prints_it_where_the_file_is_a_dash(self, talker):
        assert yaml.safe_load(rosslt('save', '/talker', '-').stdout)['talker']['rosslt']['radius'] == 2.0

    def test_says_why_it_cannot_write(self, talker):
        assert (
            failure('save', '/talker', '/no/such/folder/file.yaml')
            == 'rosslt save: /no/such/folder/file.yaml: it cannot be written: No such file or directory'
        )

    def test_does_not_overwrite_a_file_that_is_read_only(self, talker, tmp_path):
        saved = tmp_path / 'talker.yaml'
        saved.write_text('kept: 1\n', encoding='utf-8')
        saved.chmod(0o444)
        assert failure('save', '/talker', str(saved)) == f'rosslt save: {saved}: it cannot be written: it is read-only'
        assert saved.read_text(encoding='utf-8') == 'kept: 1\n'


def test_generate_is_the_generator(tmp_path):
    assert rosslt('generate', 'geometry_msgs/Pose', '-o', str(tmp_path)).stdout == f'{tmp_path}/PoseTracked.msg\n'
    assert 'geometry_msgs/Pose data' in (tmp_path / 'PoseTracked.msg').read_text(encoding='utf-8')
