"""Lets the tests of this folder use what those of its neighbours are made of."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / 'node')]
