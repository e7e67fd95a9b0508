"""Inputs that are each sound but do not belong together; commands end with an exit code of its own."""

from __future__ import annotations

from problems.errors import InputError


class Incomparable(InputError):
    """Of different problems, limits, machines or suites, or an answer of another problem's length."""
