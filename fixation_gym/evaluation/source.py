"""Which commit of this project is running."""

from __future__ import annotations

import subprocess
from pathlib import Path

_PACKAGE = Path(__file__).parent.parent


def source_commit() -> str | None:
    """Hash of the commit, with "+" if tracked files differ from it; None for an installation without its repository."""
    try:
        _git("ls-files", "--error-unmatch", "__init__.py")  # the repository around an installation may be another's
        commit = _git("rev-parse", "HEAD")
        return f"{commit}+" if _git("status", "--porcelain", "--untracked-files=no") else commit
    except (OSError, subprocess.SubprocessError):
        return None


def _git(*arguments: str) -> str:
    command = ["git", "-C", str(_PACKAGE), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
