"""Every example in docs/values.md is run."""

import doctest
import pathlib

import pytest

PAGE = pathlib.Path(__file__).resolve().parents[2] / 'docs' / 'values.md'


def test_every_example_of_the_page_about_values_gives_what_it_says():
    pytest.importorskip('numpy')
    result = doctest.testfile(str(PAGE), module_relative=False)
    assert result.attempted > 40
    assert not result.failed
