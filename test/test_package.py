"""Builds the package in workspaces as its users do, and uses it from there.

Three workspaces: built by `catkin build` and by `catkin_make` to be used from the devel space, and
installed. The first holds the repository itself, with the workspace of `./run` in it if there is one.
"""

import os
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parent.parent
SCRIPTS = sorted(path.name for path in (ROOT / 'scripts').iterdir() if path.is_file())
LAUNCH_FILES = sorted(path.name for path in (ROOT / 'launch').glob('*.launch'))
MESSAGES = sorted(path.stem for path in (ROOT / 'msg').glob('*.msg')) + ['PoseTracked', 'MarkerArrayTracked']
CMAKE_ARGUMENTS = ['--cmake-args', '-DPYTHON_EXECUTABLE=/usr/bin/python3']
TIME_LIMIT = 300  # seconds for a build, on a busy machine

pytestmark = pytest.mark.slow


class Space(NamedTuple):
    """A devel or install space that the package is used from."""

    path: Path
    home: Path

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


@pytest.fixture(scope='module', params=BUILDERS)
def space(request, tmp_path_factory):
    workspace = tmp_path_factory.mktemp(request.param.replace(' ', '_'))
    (workspace / 'src').mkdir()
    return Space(workspace / BUILDERS[request.param](workspace), workspace)


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


def test_rosrun_finds_each_executable_once(space):
    # echo in front of it: rosrun prints what it would run; it asks which one to run if there are two
    for script in SCRIPTS:
        found = space.run('rosrun', '--prefix', 'echo', 'rosslt', script).split()
        assert found == [str(space.path / 'lib' / 'rosslt' / script)], 'CMakeLists.txt does not install it'


def test_a_launch_file_finds_what_it_starts(space):
    for launch_file in LAUNCH_FILES:
        path = Path(space.run('roslaunch', '--files', 'rosslt', launch_file).splitlines()[0])
        nodes = [
            node.get('type') for node in ElementTree.parse(path).getroot().iter('node') if node.get('pkg') == 'rosslt'
        ]
        assert set(nodes) <= set(SCRIPTS), launch_file


def test_messages_are_found_and_the_generator_makes_more(space, tmp_path):
    for message in MESSAGES:
        assert space.run('rosmsg', 'show', 'rosslt/' + message).strip()
    assert (space.path / 'include' / 'rosslt' / 'PoseTracked.h').is_file(), 'roscpp finds no header'
    space.run('rosrun', 'rosslt', 'generate_tracked_msgs.py', 'geometry_msgs/Pose', '-o', str(tmp_path))
    assert 'geometry_msgs/Pose data' in (tmp_path / 'PoseTracked.msg').read_text(encoding='utf-8')


@pytest.mark.parametrize('space', ['catkin build'], indirect=True)
def test_the_tests_are_registered_for_catkin(space):
    targets = run(['make', 'help'], space.home / 'build' / 'rosslt', space.home)
    assert 'run_tests_rosslt_pytest_test' in targets
    assert 'run_tests_rosslt_rostest_test' in targets
    assert all(suite.stem in targets for suite in (ROOT / 'test').rglob('*.test'))
