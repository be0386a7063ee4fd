"""The site is built without a warning, and all that its pages show is what happens."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import rosslt
from support.masters import reached_master
from support.pages import Reader, sessions

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / 'docs'
ROOMS = sorted(door.parent.name for door in (ROOT / 'src' / 'rosslt').glob('*/__init__.py'))

#: The pages that a reader follows from beginning to end. Those on values, nodes and messages show parts of code, which
#: the tests of those rooms check.
PLAYED = ['command.md', 'concepts.md', 'first_drag.md', 'tutorial.md']
PAGES = PLAYED + sorted(str(path.relative_to(DOCS)) for path in (DOCS / 'howto').glob('*.md'))
#: The page that everybody follows first is played in each run.
FIRST = 'first_drag.md'


@pytest.fixture
def reader(tmp_path):
    """Somebody who reads a page, with a master of their own."""
    folder = tmp_path / 'folder'
    folder.mkdir()
    with reached_master(tmp_path / 'log'):
        started = Reader(folder)
        sessions.clear()
        yield started
        started.close()


@pytest.mark.rostest
@pytest.mark.parametrize('page', [pytest.param(page, marks=[pytest.mark.slow] * (page != FIRST)) for page in PAGES])
def test_what_a_page_shows_is_what_happens(reader, page):
    reader.play((DOCS / page).read_text(encoding='utf-8'))


@pytest.mark.parametrize(
    'page', ['README.md', 'CONTRIBUTING.md', *sorted(str(path.relative_to(ROOT)) for path in DOCS.rglob('*.md'))]
)
def test_files_and_pages_that_a_page_names_exist(page):
    text = (ROOT / page).read_text(encoding='utf-8')
    code = re.findall(r'`((?:src/rosslt|test|docs|scripts|benchmarks|launch|examples|config|cmake)/[\w/.]+)`', text)
    modules = re.findall(r'`((?:%s)/[\w/]+\.py)`' % '|'.join(ROOMS), text)
    links = re.findall(r'\]\((?!https?:)([^)#]+)', text)
    missing = [name for name in code if not (ROOT / name).exists()]
    missing += [name for name in modules if not (ROOT / 'src' / 'rosslt' / name).exists()]
    missing += [name for name in links if not (ROOT / page).parent.joinpath(name).exists()]
    assert not missing


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path):
    command = sys.executable + ' -m sphinx -q -W --keep-going -b html'
    built = subprocess.run(
        [*command.split(), '-d', str(tmp_path / 'trees'), str(DOCS), str(tmp_path / 'site')],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
        env=dict(os.environ, PYTHONDONTWRITEBYTECODE='1'),
        check=False,
    )
    assert (built.returncode, built.stdout) == (0, '')
    reference = (tmp_path / 'site' / 'reference.html').read_text(encoding='utf-8')
    missing = [name for name in rosslt.__all__ if not re.search(rf'id="(module-)?rosslt[\w.]*\.{name}"', reference)]
    assert not missing


@pytest.mark.parametrize('name', [name for name in rosslt.__all__ if name not in ('math', 'tf')])
def test_every_public_name_is_in_the_reference_for_whoever_does_not_build_it(name):
    prose = re.sub(r'```.*?```', '', (DOCS / 'reference.md').read_text(encoding='utf-8'), flags=re.DOTALL)
    assert re.search(rf'`{name}\b', prose)
