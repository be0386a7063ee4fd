"""The nodes and the counts in docs/tutorial.md are right.

The page itself is played by test/docs.
"""

import re
from pathlib import Path

import pytest

from support.pages import Reader, blocks

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / 'docs' / 'tutorial.md').read_text(encoding='utf-8')
PLAIN = ROOT / 'examples' / 'tutorial'


@pytest.fixture
def changed(tmp_path):
    """{name: a node after the changes that the page shows}."""
    for path in PLAIN.glob('*.py'):
        (tmp_path / path.name).write_text(path.read_text(encoding='utf-8'), encoding='utf-8')
    changes = [(language, content) for _, language, content in blocks(PAGE) if language.startswith('diff ')]
    shown = ''.join(f'It changes.\n\n```{language}\n{content}```\n\n' for language, content in changes)
    Reader(tmp_path).play(shown)
    return {path.stem: path.read_text(encoding='utf-8') for path in tmp_path.glob('*.py')}


@pytest.mark.parametrize('name', ['slt_trajectory', 'slt_quad', 'tour'])
def test_a_node_begins_without_tracking(name):
    plain = (PLAIN / (name + '.py')).read_text(encoding='utf-8')
    assert re.findall(r'rosslt\.|import rosslt|Tracked', plain) == []


@pytest.mark.parametrize('name', ['slt_trajectory', 'slt_quad'])
def test_a_node_becomes_the_one_of_the_demo(changed, name):
    assert changed[name] == (ROOT / 'scripts' / name).read_text(encoding='utf-8')


def test_the_page_says_where_the_numbers_of_the_tour_are(changed):
    lines = changed['tour'].splitlines()
    for name in 'xz':
        ((number, line),) = [(number, line) for number, line in enumerate(lines, 1) if f"name='{name}'" in line]
        assert 'tour.py:{}:{}'.format(number, line.index('rosslt.location') + 1) in PAGE


def test_the_changed_lines_are_counted_right(changed):
    plain = (PLAIN / 'slt_trajectory.py').read_text(encoding='utf-8').splitlines()
    tracked = changed['slt_trajectory'].splitlines()
    new = [line for line in tracked if line and line not in plain]
    assert '**{} of its {} lines**'.format(len(new), len(tracked)) in PAGE
