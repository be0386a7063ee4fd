"""Every test that `docs/reliability.md` names for a promise is there."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / 'docs' / 'reliability.md'
NAMED = re.compile(r'`(test/[\w/]+\.py)::(\w+)`')


def test_every_promise_names_a_test_that_is_there():
    rows = [line for line in PAGE.read_text(encoding='utf-8').splitlines() if line.startswith('| ')]
    promises = [row for row in rows if not row.startswith('| promise')]
    assert len(promises) > 10
    for row in promises:
        named = NAMED.findall(row.split(' | ')[1])
        assert named, row
        for file, test in named:
            assert f'def {test}(' in (ROOT / file).read_text(encoding='utf-8'), (file, test)
