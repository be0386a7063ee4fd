"""Three minutes of drags, one every two seconds. `./run bench soak --minutes 30` takes longer."""

import subprocess
import sys
from pathlib import Path

import pytest

SOAK = Path(__file__).resolve().parents[2] / 'benchmarks' / 'soak.py'


@pytest.mark.slow
@pytest.mark.rostest
def test_nothing_grows_is_lost_or_drifts_in_three_minutes_of_drags(master):
    result = subprocess.run(
        [sys.executable, str(SOAK), '--minutes', '3', '--pause', '2'],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert ' 0 missing' in result.stdout
