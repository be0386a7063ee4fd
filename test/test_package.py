"""Builds the package in workspaces as its users do, and uses it from there.

Three workspaces: built by `catkin build` and by `catkin_make` to be used from the devel space, and
installed. The first holds the repository itself, with the workspace of `./run` in it if there is one.
"""

import os
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parent.parent
SCRIPTS = sorted(path.name for path in (ROOT / 'scripts').iterdir() if path.is_file())
LAUNCH_FILES = sorted(path.name for path in (ROOT / 'launch').glob('*.launch'))
MESSAGES = sorted(path.stem for path in (ROOT / 'msg').glob('*.msg')) + ['PoseTracked', 'MarkerArrayTracked']
CMAKE_ARGUMENTS = ['--cmake-args', '-DPYTHON_EXECUTABLE=/usr/bin/python3']
TIME_LIMIT = 300  # seconds for a build, on a busy machine

pytestmark = pytest.mark.slow


class Space:
    """A devel or install space that the package is used from."""

    def __init__(self, path, home):
        self.path = path
        self.home = home

    def run(self, *command):
        """The output of a command in this space; an error that shows it, if the command fails."""
        script = 'source "{}/setup.bash" && exec "$@"'.format(self.path)
        return run(['bash', '-c', script, 'bash', *command], self.home, self.home)


def run(command, directory, home):
    # nothing of the workspace that the tests themselves run in, and no input to wait for
    environment = {'PATH': '/usr/sbin:/usr/bin:/sbin:/bin', 'HOME': str(home), 'LANG': 'C.UTF-8'}
    if 'ROSSLT_RUN' in os.environ:
        environment['ROSSLT_RUN'] = os.environ['ROSSLT_RUN']
    result = subprocess.run(
        command,
        cwd=directory,
        env=environment,
        stdin=subprocess.DEVNULL,
        check=False,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding='utf-8',
        timeout=TIME_LIMIT,
    )
    assert result.returncode == 0, '{} ended with {}:\n{}'.format(command, result.returncode, result.stdout)
    return result.stdout


def copy_package(source):
    shutil.copytree(
        ROOT,
        source / 'rosslt',
        symlinks=True,
        ignore=shutil.ignore_patterns('build', '.git', '__pycache__', '.*_cache', '.hypothesis'),
    )


@pytest.fixture(scope='module')
def built(tmp_path_factory):
    """A function that gives a workspace, built on its first use."""
    workspaces = {}

    def build(kind):
        if kind not in workspaces:
            workspace = tmp_path_factory.mktemp(kind.replace(' ', '_'))
            (workspace / 'src').mkdir()
            workspaces[kind] = Space(workspace / BUILDERS[kind](workspace), workspace)
        return workspaces[kind]

    return build


def catkin_build(workspace):
    (workspace / 'src' / 'rosslt').symlink_to(ROOT)
    run(['catkin', 'build', '--no-status', '--no-notify', *CMAKE_ARGUMENTS], workspace, workspace)
    return 'devel'


def catkin_make(workspace):
    copy_package(workspace / 'src')
    run(['catkin_make', '-DPYTHON_EXECUTABLE=/usr/bin/python3'], workspace, workspace)
    return 'devel'


def installed(workspace):
    copy_package(workspace / 'src')
    run(['catkin', 'config', '--init', '--install', *CMAKE_ARGUMENTS], workspace, workspace)
    run(['catkin', 'build', '--no-status', '--no-notify'], workspace, workspace)
    # what is used from here on is what was installed
    for used_up in ('src', 'build', 'devel'):
        shutil.rmtree(workspace / used_up)
    return 'install'


BUILDERS = {'catkin build': catkin_build, 'catkin_make': catkin_make, 'installed': installed}


@pytest.fixture(params=BUILDERS)
def space(request, built):
    return built(request.param)


def test_the_package_its_rooms_and_its_messages_are_imported_together(space):
    rooms = sorted(path.parent.name for path in (ROOT / 'src' / 'rosslt').glob('*/__init__.py'))
    rooms.remove('web')  # it alone needs viser, which is not there
    program = 'import rosslt, rosslt.math, rosslt.srv, {}\n'.format(', '.join('rosslt.' + room for room in rooms))
    program += 'from rosslt.msg import {}\n'.format(', '.join(MESSAGES))
    program += 'print(rosslt.__file__, rosslt.msg.__file__, sep="\\n")'
    for path in space.run('/usr/bin/python3', '-c', program).splitlines():
        assert path.startswith(str(space.path)), path


def test_the_version_is_that_of_the_manifest_and_annotations_are_announced(space):
    version = ElementTree.parse(ROOT / 'package.xml').getroot().findtext('version')
    program = 'import pathlib, rosslt; print(rosslt.__version__)\n'
    program += 'print(any((pathlib.Path(folder) / "py.typed").is_file() for folder in rosslt.__path__))'
    assert space.run('/usr/bin/python3', '-c', program).split() == [version, 'True']


@pytest.mark.parametrize('script', SCRIPTS)
def test_rosrun_finds_each_executable_once(space, script):
    # echo in front of it: rosrun prints what it would run; it asks which one to run if there are two
    found = space.run('rosrun', '--prefix', 'echo', 'rosslt', script).split()
    assert found == [str(space.path / 'lib' / 'rosslt' / script)], 'CMakeLists.txt does not install it'


@pytest.mark.parametrize('launch_file', LAUNCH_FILES)
def test_a_launch_file_finds_what_it_starts(space, launch_file):
    path = Path(space.run('roslaunch', '--files', 'rosslt', launch_file).splitlines()[0])
    for node in ElementTree.parse(path).getroot().iter('node'):
        if node.get('pkg') == 'rosslt':
            program = 'import roslib.packages; print(len(roslib.packages.find_node("rosslt", "{}")))'
            assert space.run('/usr/bin/python3', '-c', program.format(node.get('type'))).strip() != '0', (
                '{} starts {}, which is not there'.format(launch_file, node.get('type'))
            )


@pytest.mark.parametrize('message', MESSAGES)
def test_rosmsg_shows_each_message(space, message):
    assert space.run('rosmsg', 'show', 'rosslt/' + message).strip()


def test_the_generator_runs(space, tmp_path):
    space.run('rosrun', 'rosslt', 'generate_tracked_msgs.py', 'geometry_msgs/Pose', '-o', str(tmp_path))
    assert 'geometry_msgs/Pose data' in (tmp_path / 'PoseTracked.msg').read_text(encoding='utf-8')


def test_roscpp_finds_the_header_of_a_tracked_message(space):
    found = list((space.path / 'include' / 'rosslt').glob('PoseTracked.h'))
    assert found, 'no PoseTracked.h in {}'.format(space.path / 'include' / 'rosslt')


def test_the_tests_are_registered_for_catkin(built):
    space = built('catkin build')
    targets = run(['make', 'help'], space.home / 'build' / 'rosslt', space.home)
    assert 'run_tests_rosslt_pytest_test' in targets
    for suite in (ROOT / 'test').rglob('*.test'):
        assert 'run_tests_rosslt_rostest_test' in targets
        assert suite.stem in targets
