"""Runs pytest; what fails beside other tests runs once more, alone, after all others have ended.

    python3 test/support/again.py ARGUMENT...

What passes then is named under "failed beside others", and the run has passed. What fails twice fails the run, as does
all that is no failure of a test: a file that cannot be collected, a worker that crashes, a run that was stopped.
"""

import json
import os
import sys
import tempfile

import pytest

SECOND = '--second='  # and the file in which the first run has kept its failures


class First:
    """Keeps how tests fail, and whether anything else went wrong."""

    def __init__(self):
        self.failures, self.is_whole = {}, True

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self.is_whole &= report.when in ('setup', 'call', 'teardown')  # xdist reports a crash otherwise
            crash = getattr(report.longrepr, 'reprcrash', None)
            self.failures.setdefault(report.nodeid, crash.message if crash else report.longreprtext)

    def pytest_collectreport(self, report):
        self.is_whole &= not report.failed

    def pytest_internalerror(self):
        self.is_whole = False

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, error):
        self.is_whole &= not error

    def pytest_sessionfinish(self, session):
        self.is_whole &= not (session.shouldfail or session.shouldstop)


class Second:
    """Runs what has failed, in one process, and says what passes."""

    def __init__(self, failures):
        self.failures, self.passed = failures, set()

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config, items):
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in self.failures])
        items[:] = [item for item in items if item.nodeid in self.failures]

    def pytest_runtest_logreport(self, report):
        if report.when == 'call' and report.passed:
            self.passed.add(report.nodeid)

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session):
        if session.exitstatus == pytest.ExitCode.OK and self.passed != set(self.failures):
            session.exitstatus = pytest.ExitCode.NO_TESTS_COLLECTED  # they are not there, or were skipped

    @pytest.hookimpl(trylast=True)
    def pytest_terminal_summary(self, terminalreporter):
        again = {report.nodeid for outcome in ('failed', 'error') for report in terminalreporter.getreports(outcome)}
        for nodeid in sorted(self.passed - again):
            terminalreporter.section('failed beside others', bold=True)
            terminalreporter.line('{}\n{}'.format(nodeid, self.failures[nodeid]))


def main(arguments):
    """Run pytest once, or twice; returns its exit status."""
    if arguments[0].startswith(SECOND):
        with open(arguments[0][len(SECOND) :], encoding='utf-8') as file:
            failures = json.load(file)
        os.remove(file.name)
        return pytest.main([*arguments[1:], '--numprocesses', '0'], plugins=[Second(failures)])
    first = First()
    status = pytest.main(arguments, plugins=[first])
    if status != pytest.ExitCode.TESTS_FAILED or not first.is_whole or not first.failures:
        return status
    print('\nonce more, alone: what has failed', flush=True)
    with tempfile.NamedTemporaryFile('w', encoding='utf-8', delete=False) as file:
        json.dump(first.failures, file)
    # a process of its own: nothing that the first run has loaded or left is there
    return os.execv(sys.executable, [sys.executable, __file__, SECOND + file.name, *arguments])


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
