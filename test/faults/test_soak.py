"""Half a minute of drags: what grows shows already. `./run bench soak --minutes 30` takes longer."""

import subprocess
import sys
from pathlib import Path

import pytest

SOAK = Path(__file__).resolve().parents[2] / 'benchmarks' / 'soak.py'


@pytest.mark.slow
@pytest.mark.rostest
def test_nothing_grows_is_lost_or_drifts_in_half_a_minute_of_drags(master):
    result = subprocess.run(
        [sys.executable, str(SOAK), '--minutes', '0.5', '--pause', '0.1'],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert ' 0 missing' in result.stdout
