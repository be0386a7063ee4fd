"""Names of the types that annotations use throughout this room."""

from typing import Any, Callable

Value = Any
"""A number or text, plain or tracked, or what holds such: a message, list, dict or array."""

Function = Callable[..., Value]
"""A function of values."""
