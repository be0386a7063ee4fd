"""Every test that `docs/reliability.md` names for a promise is there."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / 'docs' / 'reliability.md'
NAMED = re.compile(r'`(test/[\w/]+\.py)::(\w+)`')
HEADING = '| promise | shown by | not promised |'


def promises():
    """The rows of the tables of promises."""
    found, is_inside = [], False
    for line in PAGE.read_text(encoding='utf-8').splitlines():
        if line.startswith('| ') and is_inside:
            found.append(line)
        is_inside = line == HEADING or (is_inside and line.startswith('|'))
    return found


def test_every_promise_names_a_test_that_is_there():
    rows = promises()
    assert len(rows) > 30
    for row in rows:
        named = NAMED.findall(row.split(' | ')[1])
        assert named, row
        for file, test in named:
            assert f'def {test}(' in (ROOT / file).read_text(encoding='utf-8'), (file, test)
