"""Settings and checks for every test run."""

import os
import sys

import pytest
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

from support import masters

# How long an example takes says more about what else the machine does than about the code. The examples are the same
# in every run, so that a change is judged by what it changes; `--hypothesis-profile=hunt` looks for new ones.
settings.register_profile('rosslt', deadline=None, derandomize=True)
settings.register_profile('hunt', deadline=None, derandomize=False, print_blob=True)
settings.load_profile('rosslt')

#: The folder of the tests of the page.
_BROWSER = 'test/web/'

#: The folder of tests that compute and share nothing.
_COMPUTING = 'test/values/'


def pytest_addoption(parser):
    parser.addoption('--all', action='store_true', help='run the slow tests, too, and more examples of each law')


def pytest_configure(config):
    """Say for modules that are imported later, and for processes that tests start, how many examples there are."""
    if config.option.all:
        os.environ['ROSSLT_MANY_EXAMPLES'] = '1'


@pytest.fixture
def master(tmp_path):
    """A ROS master for a test that needs one to itself. Folders whose tests share one have a fixture of that name."""
    with masters.reached_master(tmp_path) as started, pytest.MonkeyPatch.context() as patch:
        ask_for_parameters_anew(patch)
        yield started


@pytest.fixture(scope='module', autouse=True)
def master_of_the_folder(request):
    """The master that the tests of a folder share, also after tests of another folder that share another one."""
    uri = masters.shared.get(request.path.parent)
    with pytest.MonkeyPatch.context() as patch:
        if uri is not None:
            patch.setenv('ROS_MASTER_URI', uri)
        ask_for_parameters_anew(patch)
        yield


def ask_for_parameters_anew(patch):
    """Have rospy ask the master that is reached now, instead of the one that it has asked first."""
    if 'rospy.client' in sys.modules:
        for name in ('_param_server', '_master_proxy'):
            patch.setattr(sys.modules['rospy.client'], name, None)


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session, exitstatus):
    """A run whose every test was skipped tested nothing: it fails like one that found no test."""
    reporter = session.config.pluginmanager.get_plugin('terminalreporter')
    ran = any(reporter.stats.get(outcome) for outcome in ('passed', 'xfailed'))
    if exitstatus == pytest.ExitCode.OK and not ran and not session.config.option.collectonly:
        session.exitstatus = pytest.ExitCode.NO_TESTS_COLLECTED


def pytest_collection_modifyitems(config, items):
    """Leave out the slow tests unless all are asked for.

    Several workers begin with what takes long, so that none is left with it alone at the end.
    """
    if not (config.option.all or 'slow' in config.option.markexpr):
        config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker('slow')])
        items[:] = [item for item in items if not item.get_closest_marker('slow')]
    if hasattr(config, 'workerinput'):
        items.sort(key=_turn)


def _turn(item):
    """The page first, whose tests are one piece; then what starts processes; what computes; the many short ones."""
    if _BROWSER in item.nodeid:
        return 0
    if item.get_closest_marker('slow') or item.get_closest_marker('rostest'):
        return 1
    return 2 if _COMPUTING in item.nodeid else 3


class _ByFile(LoadScopeScheduling):
    """The tests of a file share their masters and nodes, so they go to one worker; each rostest has its own.

    Those of the page share one browser, which draws with the processor alone: a second one beside it slows both. Those
    that compute share nothing, so that no worker is left with a file of them at the end.
    """

    def _split_scope(self, nodeid):
        file = nodeid.split('::')[0]
        if _BROWSER in file:
            return _BROWSER
        return nodeid if file.endswith('test_rostests.py') or _COMPUTING in file else file


def pytest_xdist_make_scheduler(config, log):
    return _ByFile(config, log)
