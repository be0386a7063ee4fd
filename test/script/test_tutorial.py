"""What docs/tutorial.md shows of the nodes is what they are, and it counts right."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / 'docs' / 'tutorial.md').read_text(encoding='utf-8')


def diffs(name):
    """The parts of a node that the page shows: [(lines before, lines after)]."""
    found = []
    for block in re.findall(r'```diff {}\n(.*?)```'.format(name), PAGE, re.DOTALL):
        lines = block.splitlines()
        found.append(
            (
                ''.join(line[1:] + '\n' for line in lines if line[:1] != '+'),
                ''.join(line[1:] + '\n' for line in lines if line[:1] != '-'),
            )
        )
    assert found
    return found


def before_and_after(name):
    """A node without tracking, made of the tracked one by the page, and the tracked one."""
    tracked = (ROOT / 'scripts' / name).read_text(encoding='utf-8')
    plain = tracked
    for before, after in diffs(name):
        assert plain.count(after) == 1, 'the page shows what is not in {}:\n{}'.format(name, after)
        plain = plain.replace(after, before)
    return plain, tracked


@pytest.mark.parametrize('name', ['slt_trajectory', 'slt_quad'])
def test_a_node_is_a_plain_one_without_the_lines_that_the_page_adds(name):
    plain, _ = before_and_after(name)
    assert re.findall(r'rosslt\.|import rosslt|Tracked', plain) == []
    compile(plain, name, 'exec')


def test_the_tour_is_whole_before_and_after():
    ((plain, tracked),) = diffs('tour')
    assert 'rosslt' not in plain
    for text in (plain, tracked):
        compile(text, 'tour', 'exec')
    column = tracked.splitlines()[18].index('rosslt.location') + 1
    assert '[tour.py:19:{}]'.format(column) in PAGE


def test_the_changed_lines_are_counted_right():
    plain, tracked = (text.splitlines() for text in before_and_after('slt_trajectory'))
    changed = [line for line in tracked if line and line not in plain]
    assert '**{} of its {} lines**'.format(len(changed), len(tracked)) in PAGE


def test_the_code_that_stays_is_that_of_the_node():
    script = (ROOT / 'scripts' / 'slt_trajectory').read_text(encoding='utf-8')
    shown = re.findall(r'```python\n(.*?)```', PAGE, re.DOTALL)
    assert all(block in script for block in shown[:2])
    assert not any(re.search('rosslt|Tracked', block) for block in shown[:2])
