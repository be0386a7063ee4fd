"""The list of planted faults fits the code: each could be planted, and each room has one."""

import pytest

from planted_faults import FAULTS, ROOT, text_with
from test_rooms import rooms


@pytest.mark.parametrize('fault', FAULTS, ids=lambda fault: fault.name)
def test_a_fault_can_be_planted_and_its_tests_are_there(fault):
    text_with(fault, ROOT)
    files = [argument for argument in fault.tests if argument.startswith('test/')]
    assert files
    assert all((ROOT / file).exists() for file in files)


def test_each_room_has_a_fault():
    assert {fault.file.split('/')[0] for fault in FAULTS} == set(rooms())


def test_faults_have_names_of_their_own_and_are_many():
    assert len({fault.name for fault in FAULTS}) == len(FAULTS) >= 20
