"""Scalars as people type them."""

import os

import pytest

from rosslt.cli.scalars import parse_scalar


def test_a_text_that_no_node_could_be_sent_is_refused():
    with pytest.raises(ValueError, match='is not UTF-8'):
        parse_scalar(os.fsdecode(b'caf\xe9'), 'str')
    assert parse_scalar('caf\xe9', 'str') == 'caf\xe9'
