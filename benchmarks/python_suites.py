#!/usr/bin/env python3
"""Runs test suites that nobody wrote for rosslt, plain and rewritten, and compares them test by test.

    ./run bench python_suites [SUITE...] [--include MODULE...]

By default these are suites of Python itself, from Debian's libpython3.11-testsuite, of which the modules of tests are
rewritten. SUITE is any module or package that pytest finds (`test.test_math`, `uncertainties`); of an installed package,
name what is to be rewritten with --include. It prints the tests that pass plain and not rewritten, and counts.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

#: Suites of Python itself that compute with numbers, texts and containers, and take seconds.
SUITES = """
abc argparse array ast asyncgen audioop augassign base64 baseexception bigmem binascii binop bisect bool bufio builtin bytes
calendar call charmapcodec class cmath cmd codecs codeop collections colorsys compare complex configparser contains context
contextlib copy copyreg coroutines csv datetime decorators defaultdict deque descr descrtut dict dict_version dictcomps
dictviews difflib dynamic dynamicclassattribute eintr enum enumerate errno except_star exception_group
exception_hierarchy exception_variations exceptions extcall filecmp fileinput float flow fnmatch format fractions
frame frozen fstring funcattrs functools future generator_stop generators genericalias genericclass genericpath genexps
getopt gettext glob global grammar graphlib hash hashlib heapq hmac html htmlparser index inspect int int_literal io
ipaddress isinstance iter iterlen itertools json keyword keywordonlyarg kqueue lib2to3 linecache list listcomps
locale logging long longexp math memoryio memoryview metaclass minidom mimetypes module named_expressions netrc
numeric_tower opcodes operator optparse ordered_dict os pathlib patma pep646_syntax pickle pickletools pkgutil plistlib
positional_only_arg posixpath pow pprint print property pyclbr pyexpat queue quopri raise random range re
re reprlib richcmp rlcompleter sched scope secrets select set setcomps shelve shlex shutil slice smtplib sndhdr socket sort
statistics strftime string string_literals stringprep strptime strtod struct structseq subclassinit sunau super symtable syntax
sys sys_settrace tempfile textwrap threading time timeit timeout tokenize traceback tuple type_annotations type_comments
types typing ucn unary unicode unicodedata unpack unpack_ex urllib urlparse userdict userlist userstring uuid wave weakref
weakset with xml_etree xmlrpc yield_from zipfile zlib
""".split()

#: A test of Python's own that is longer than that is ended.
TIMEOUT = 240

RUNNER = """
import json, sys
import pytest

class Outcomes:
    def __init__(self, file):
        self.file = open(file, 'w')
    def pytest_runtest_logreport(self, report):
        if report.when == 'call' or report.outcome != 'passed':
            print(json.dumps([report.nodeid, report.outcome, str(report.longrepr or '')[-1500:]]), file=self.file, flush=True)

options = ['-q', '--no-header', '--tb=short', '--assert=plain', '-p', 'no:cacheprovider', '-p', 'no:randomly', '--pyargs']
sys.exit(pytest.main([*options, sys.argv[1]], plugins=[Outcomes(sys.argv[2])]))
"""


def run(suite, include, folder):
    """{test: (outcome, what was said)} of a suite; with modules to include, rewritten."""
    runner, outcomes = Path(folder, 'runner.py'), Path(folder, 'outcomes')
    runner.write_text(RUNNER, encoding='utf-8')
    outcomes.write_text('', encoding='utf-8')
    how = ['rosslt', 'run', *(f'--include={one}' for one in include)] if include else [sys.executable]
    try:
        subprocess.run(
            [*how, runner, suite, outcomes],
            cwd=folder,
            timeout=TIMEOUT,
            check=False,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, 'PYTHONHASHSEED': '0'},
        )
    except subprocess.TimeoutExpired:
        print(f'{suite}: took longer than {TIMEOUT} s', flush=True)
    lines = outcomes.read_text(encoding='utf-8').splitlines()
    return {name: (outcome, said) for name, outcome, said in map(json.loads, lines)}


def main():
    """Compare, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('suites', nargs='*', metavar='SUITE')
    parser.add_argument('--include', nargs='+', default=[], metavar='MODULE')
    parser.add_argument('--verbose', action='store_true', help='print what the failing tests say')
    options = parser.parse_args()
    passed = kept = 0
    for suite in options.suites or [f'test.test_{name}' for name in SUITES]:
        with tempfile.TemporaryDirectory() as folder:
            plain = run(suite, [], folder)
            rewritten = run(suite, options.include or [suite], folder)
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
