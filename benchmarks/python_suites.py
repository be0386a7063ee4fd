#!/usr/bin/env python3
"""Runs test suites of other projects plain and under `rosslt run`, and compares them test by test.

    ./run bench python_suites [SUITE...] [--include MODULE...] [--path FOLDER...] [--timeout SECONDS] [--verbose]
    ./run bench python_suites numpy.core.tests numpy.linalg.tests numpy.lib.tests numpy.random.tests --timeout 900

By default these are suites of Python itself, from Debian's libpython3.11-testsuite; their modules are rewritten. SUITE
is any module or package that pytest finds (`test.test_math`, `numpy.linalg.tests`), in the folders of --path too, where
`pip install --target FOLDER` put a package with its tests, or where its source was unpacked; with --include, other
modules are rewritten instead of it. It prints the tests that pass plain and fail rewritten, and counts. It takes half
an hour.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

#: Suites of Python itself that take seconds.
SUITES = re.findall(
    r'\w+',
    """
    abc argparse array ast asyncgen audioop augassign base64 baseexception binascii binop bisect bool bufio builtin
    bytes calendar call charmapcodec class cmath codecs collections colorsys compare complex configparser contains
    context contextlib copy copyreg coroutines csv decorators defaultdict deque descr dict dict_version dictcomps
    dictviews difflib dynamic dynamicclassattribute enum enumerate errno except_star exception_group
    exception_hierarchy exceptions fileinput float fnmatch format fractions frame fstring funcattrs functools future
    generator_stop generators genericalias genericclass genericpath getopt gettext glob global grammar graphlib hash
    hashlib heapq hmac html htmlparser index inspect int ipaddress isinstance iter iterlen itertools json keyword
    keywordonlyarg linecache list locale logging long math memoryio memoryview minidom module named_expressions
    netrc numeric_tower opcodes operator optparse ordered_dict os pathlib patma pep646_syntax pickle pkgutil
    plistlib positional_only_arg posixpath pow pprint print property pyclbr queue quopri raise random range re
    reprlib richcmp sched scope secrets select set setcomps shlex slice sort statistics string
    string_literals strptime strtod struct subclassinit super symtable sys tempfile textwrap threading time tokenize
    traceback tuple type_annotations types typing unary unicode unicodedata unpack unpack_ex urlparse userdict
    userlist userstring uuid weakref weakset with xml_etree yield_from zlib
    """,
)

RUNNER = """
import json, sys
import pytest

class Outcomes:
    def __init__(self, file):
        self.file = open(file, 'a')
    def pytest_runtest_logstart(self, nodeid):
        print(json.dumps([nodeid, 'hung', '']), file=self.file, flush=True)
    def pytest_runtest_logreport(self, report):
        if report.when == 'call' or report.outcome != 'passed':
            line = [report.nodeid, report.outcome, str(report.longrepr or '')[-1500:]]
            print(json.dumps(line), file=self.file, flush=True)

options = ['-q', '--tb=short', '--assert=plain', '-p', 'no:cacheprovider', '--pyargs']
done = ['--deselect=' + json.loads(line)[0] for line in open(sys.argv[2])]
sys.exit(pytest.main([*options, *done, sys.argv[1]], plugins=[Outcomes(sys.argv[2])]))
"""


def run(suite, include, folder, options):
    """{test: (outcome, what was said)} of a suite; with modules to include, rewritten. What hangs is left out then."""
    runner, outcomes = Path(folder, 'runner.py'), Path(folder, 'outcomes')
    runner.write_text(RUNNER, encoding='utf-8')
    outcomes.write_text('', encoding='utf-8')
    path = os.pathsep.join([*map(os.path.abspath, options.path), os.environ.get('PYTHONPATH', '')])
    how = ['rosslt', 'run', *(f'--include={one}' for one in include)] if include else [sys.executable]
    environment = {**os.environ, 'PYTHONHASHSEED': '0', 'PYTHONPATH': path}
    while True:
        known = len(outcomes.read_text(encoding='utf-8'))
        with subprocess.Popen(
            [*how, runner, suite, outcomes],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=environment,
        ) as process:
            try:
                process.wait(options.timeout)
                break
            except subprocess.TimeoutExpired:
                process.kill()
        lines = outcomes.read_text(encoding='utf-8').splitlines()
        if len('\n'.join(lines)) <= known:
            print(f'{suite}: nothing within {options.timeout} s', flush=True)
            break
        print(f'{suite}: ended in {json.loads(lines[-1])[0]} after {options.timeout:g} s', flush=True)
    lines = outcomes.read_text(encoding='utf-8').splitlines()
    return {name: (outcome, said) for name, outcome, said in map(json.loads, lines)}


def main():
    """Compare, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('suites', nargs='*', metavar='SUITE')
    parser.add_argument('--include', nargs='+', default=[], metavar='MODULE')
    parser.add_argument('--path', nargs='+', default=[], metavar='FOLDER', help='where packages are besides')
    parser.add_argument('--timeout', type=float, default=240, metavar='SECONDS', help='end a suite that takes longer')
    parser.add_argument('--verbose', action='store_true', help='print what the failing tests say')
    options = parser.parse_args()
    passed = kept = 0
    for suite in options.suites or [f'test.test_{name}' for name in SUITES]:
        with tempfile.TemporaryDirectory() as folder:
            plain = run(suite, [], folder, options)
            rewritten = run(suite, options.include or [suite], folder, options)
        passing = [name for name, (outcome, _) in plain.items() if outcome == 'passed']
        lost = [name for name in passing if rewritten.get(name, ('missing', ''))[0] != 'passed']
        passed, kept = passed + len(passing), kept + len(passing) - len(lost)
        print(f'{suite}: {len(passing)} pass plain, {len(passing) - len(lost)} rewritten', flush=True)
        for name in lost:
            outcome, said = rewritten.get(name, ('missing', ''))
            print(f'  {outcome} {name}', *(said.splitlines() if options.verbose else ()), sep='\n    ')
    print(f'{passed} pass plain, {kept} rewritten: {100 * kept / max(passed, 1):.2f} %')


if __name__ == '__main__':
    main()
