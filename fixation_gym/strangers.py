"""Somebody else's code: classes named as ``module:Class`` on the command line, and what is behind a door."""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import inspect
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fixation_gym.errors import UsageError

_OWN = "fixation_gym.", "fixation_policies."
"""How the names of the project's own modules begin."""


@contextlib.contextmanager
def whose_code(part: str, code: Any) -> Iterator[str]:
    """Call code behind a door; yields its name.

    Args:
        part: what it is, for messages.
        code: a function, or an object whose class counts.

    Raises:
        RuntimeError: from whatever it raised, saying whose code it was. Errors of the project's own stay as they are.
    """
    named = code if hasattr(code, "__qualname__") else type(code)
    name = f"{named.__module__}.{named.__qualname__}"
    try:
        yield name
    except Exception as error:
        if name.startswith(_OWN):
            raise
        raise RuntimeError(f"the {part} {name} failed: {type(error).__name__}: {error}") from error


def is_class_name(name: str) -> bool:
    """Whether a name is meant as ``module:Class``."""
    module, colon, attribute = name.partition(":")
    return bool(colon) and attribute.isidentifier() and all(part.isidentifier() for part in module.split("."))


def load_class(name: str, option: str, methods: tuple[str, ...]) -> type[Any]:
    """Import a class by ``module:Class``; modules are also looked for in the present folder.

    Args:
        name: of the class.
        option: of the command line that names it, for messages.
        methods: that it must have.

    Raises:
        UsageError: if there is no such class, or it lacks a method. What the module itself raises stays as it is.
    """
    module_name, _, attribute = name.partition(":")
    if os.getcwd() not in sys.path:  # a console script's path begins with its own folder
        sys.path.append(os.getcwd())
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is None or not module_name.startswith(error.name):
            raise  # a package that the stranger's own code needs
        raise UsageError(
            f"{option} {name}: there is no module {error.name!r}; install it, or run in the folder that holds it"
        ) from error
    found = getattr(module, attribute, None)
    if not inspect.isclass(found):
        raise UsageError(f"{option} {name}: module {module_name!r} has no class {attribute!r}")
    missing = [method for method in methods if not callable(getattr(found, method, None))]
    if missing:
        needed = " and ".join(f"{method}()" for method in methods)
        raise UsageError(f"{option} {name}: the class needs {needed}, and lacks {', '.join(missing)}")
    return found


def source_hash(name: str, option: str, methods: tuple[str, ...]) -> str:
    """SHA-256 of the file that holds a class: after a change it is another one.

    Raises:
        UsageError: as ``load_class``.
    """
    return hashlib.sha256(Path(inspect.getfile(load_class(name, option, methods))).read_bytes()).hexdigest()
