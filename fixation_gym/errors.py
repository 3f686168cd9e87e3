"""Errors that are the user's to repair; the command line prints them as one line."""

from __future__ import annotations

from collections.abc import Iterable


class UsageError(ValueError):
    """A wrong argument, name, file or folder. The message says what is allowed."""


def check_names(names: Iterable[str], valid: Iterable[str], what: str) -> None:
    """Check that there are names, and that all are known.

    Raises:
        UsageError: naming the first unknown name ('' for an empty list) and all valid ones in their own order.
    """
    valid = tuple(valid)
    for name in tuple(names) or ("",):
        if name not in valid:
            raise UsageError(f"unknown {what} '{name}'; choose one of {', '.join(valid)}")
