"""Warnings about faults of messages: each once, and no more than a log can hold."""

import pytest

from rosslt.messages import fault_log


@pytest.fixture(autouse=True)
def nothing_said(monkeypatch):
    monkeypatch.setattr(fault_log, '_said', set())


def test_a_fault_is_said_once(caplog):
    for _ in range(3):
        fault_log.warn_once('fault', 'the leaf %d is wrong', 7)
    said = [record.getMessage() for record in caplog.records if record.msg == 'the leaf %d is wrong']
    assert said == ['the leaf 7 is wrong']


def test_faults_without_end_do_not_fill_the_log(caplog):
    for number in range(2 * fault_log.LIMIT):
        fault_log.warn_once(number, 'fault %d', number)
    assert len([record for record in caplog.records if record.msg == 'fault %d']) == fault_log.LIMIT
