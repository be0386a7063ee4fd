"""Fixtures of neighbouring folders for the tests of this folder."""

from pathlib import Path

HERE = Path(__file__).parent
