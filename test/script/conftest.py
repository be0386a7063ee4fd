"""Lets the tests of this folder use what those of its neighbours are made of."""

from pathlib import Path

HERE = Path(__file__).parent
