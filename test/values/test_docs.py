"""Every example in the pages about values is run."""

import doctest
import pathlib

import pytest

DOCS = pathlib.Path(__file__).resolve().parents[2] / 'docs'


@pytest.mark.parametrize(('page', 'examples'), [('values.md', 40), ('own_operations.md', 20)])
def test_every_example_of_the_pages_about_values_gives_what_it_says(page, examples):
    pytest.importorskip('numpy')
    result = doctest.testfile(str(DOCS / page), module_relative=False)
    assert result.attempted > examples
    assert not result.failed
