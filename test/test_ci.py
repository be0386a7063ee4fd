"""Holds what `.ci/run` does, and how it runs tests that fail beside others once more, alone."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from support import again

ROOT = Path(__file__).resolve().parent.parent
TIME_LIMIT = 300  # seconds, on a busy machine

PASSES = 'def test_passes():\n    pass\n'
PASSES_ALONE = (
    'import os\n\n\ndef test_passes_alone():\n'
    '    worker = os.environ.get("PYTEST_XDIST_WORKER")\n    assert worker is None, "it was beside others"\n'
)
FAILS_TWICE = 'def test_fails_twice():\n    raise ValueError("whenever")\n'
CRASHES = 'import os\n\n\ndef test_crashes():\n    if "PYTEST_XDIST_WORKER" in os.environ:\n        os._exit(1)\n'
SKIPS = (
    'import os\nimport pytest\n\n\ndef test_skips():\n'
    '    if "PYTEST_XDIST_WORKER" in os.environ:\n        raise ValueError\n    pytest.skip("not now")\n'
)
IS_ELSEWHERE = (
    'import os\nimport pytest\n\nBESIDE = "PYTEST_XDIST_WORKER" in os.environ\n\n\n'
    '@pytest.mark.parametrize("place", ["beside others" if BESIDE else "alone"])\n'
    'def test_of(place):\n    assert not BESIDE\n'
)


def run_tests(folder, *arguments, **files):
    for name, text in files.items():
        (folder / 'test_{}.py'.format(name)).write_text(text)
    environment = {name: value for name, value in os.environ.items() if not name.startswith('PYTEST_')}
    return subprocess.run(
        [sys.executable, again.__file__, '-p', 'no:cacheprovider', '--numprocesses=2', *arguments, str(folder)],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        encoding='utf-8',
        timeout=TIME_LIMIT,
        check=False,
    )


def test_what_passes_alone_is_named_with_its_first_failure_and_the_run_has_passed(tmp_path):
    result = run_tests(tmp_path, passes=PASSES, alone=PASSES_ALONE)
    assert result.returncode == 0, result.stdout
    first, second = result.stdout.split('once more, alone')
    assert re.search('1 failed, 1 passed', first)
    *_, named = second.split(' failed beside others ')
    assert 'test_alone.py::test_passes_alone\nAssertionError: it was beside others' in named
    assert re.match('=+ 1 passed, 1 deselected in .*s =+$', result.stdout.splitlines()[-1])


def test_what_fails_twice_fails_the_run(tmp_path):
    result = run_tests(tmp_path, passes=PASSES, alone=PASSES_ALONE, twice=FAILS_TWICE)
    assert result.returncode == pytest.ExitCode.TESTS_FAILED
    assert re.match('=+ 1 failed, 1 passed, 1 deselected in .*s =+$', result.stdout.splitlines()[-1])


@pytest.mark.parametrize(
    ('files', 'arguments'),
    [
        ({'broken': 'import there_is_no_such_module\n'}, []),
        ({'broken': 'import there_is_no_such_module\n'}, ['--continue-on-collection-errors']),
        ({'crashes': CRASHES}, []),
        ({}, ['-x']),
        ({}, ['--numprocesses=0', '-x']),
        ({}, ['--there-is-no-such-option']),
    ],
    ids=['not collected', 'not collected, others go on', 'worker crashes', 'stopped', 'stopped, no workers', 'usage'],
)
def test_what_is_no_failure_of_a_test_fails_at_once(tmp_path, files, arguments):
    result = run_tests(tmp_path, *arguments, passes=PASSES, alone=PASSES_ALONE, fails=FAILS_TWICE, **files)
    assert result.returncode != 0
    assert 'once more, alone' not in result.stdout


@pytest.mark.parametrize('text', [SKIPS, IS_ELSEWHERE], ids=['skipped', 'not found'])
def test_a_second_run_of_nothing_fails(tmp_path, text):
    result = run_tests(tmp_path, passes=PASSES, once=text, alone=PASSES_ALONE)
    assert result.returncode != 0
    assert 'once more, alone' in result.stdout


@pytest.fixture
def clone(tmp_path):
    """A clone whose programs say in a file how they are called, and fail if their name stands in $FAILS."""
    clone = tmp_path / 'clone'
    (clone / '.ci').mkdir(parents=True)
    (tmp_path / 'shared').mkdir()
    shutil.copy(ROOT / '.ci' / 'run', clone / '.ci')
    for program in (clone / 'run', tmp_path / 'shared' / 'bare'):
        program.write_text(
            '#!/bin/bash\necho "${0##*/} $*" in "${PWD##*/}" >>"$CALLS"\n[[ "${0##*/} $*" != "$FAILS" ]]\n'
        )
        program.chmod(0o755)
    return clone


def calls(clone, fails=''):
    """What .ci/run calls, and whether it has passed."""
    file = clone / 'calls'
    environment = dict(os.environ, CALLS=str(file), FAILS=fails)
    status = subprocess.run([str(clone / '.ci' / 'run')], cwd='/', env=environment, timeout=TIME_LIMIT, check=False)
    return file.read_text().splitlines(), status.returncode == 0


def test_ci_runs_linters_tests_and_the_demo_on_a_bare_machine(clone):
    all_calls = ['run lint in clone', 'run test --again in clone', 'bare  in clone']
    assert calls(clone) == (all_calls, True)


@pytest.mark.parametrize(('fails', 'number'), [('run lint', 1), ('run test --again', 2), ('bare ', 3)])
def test_ci_ends_with_what_fails(clone, fails, number):
    called, has_passed = calls(clone, fails)
    assert (len(called), has_passed) == (number, False)


def test_ci_goes_without_the_demo_if_the_bare_machine_is_not_beside_the_clone(clone):
    shutil.rmtree(clone.parent / 'shared')
    assert calls(clone) == (['run lint in clone', 'run test --again in clone'], True)
