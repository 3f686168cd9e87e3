"""``compiled`` and ``compiled_fast``: numba's ``njit``, with a cache that sees all files a function depends on.

numba looks at a function's own file alone. When another file changes, as by ``git pull``, with a function that is
called or a constant that is used, the old machine code would run on: with old results, or with a crash if the layout
of an argument is another one.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])
_IMPORT = re.compile(r"^(?:from|import) ([\w.]+)", re.MULTILINE)
_FAST = {"nogil": True, "fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}


def compiled(function: _Function) -> _Function:
    """Decorator: the function is compiled at the first call with arguments of some types, and kept on disk.

    The code lies beside the source, or else in numba's cache directory, or nowhere if there is no place.
    """
    return _compiled(function)


def compiled_fast(function: _Function) -> _Function:
    """The same, but sums may be reordered and multiply-adds fused; NaN and inf keep their meaning."""
    return _compiled(function, **_FAST)


def _compiled(function: Any, **options: Any) -> Any:
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # no place on disk to cache in
        return numba.njit(**options)(function)
    module = function.__module__
    file = getattr(sys.modules.get(module), "__file__", None)
    kept = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if file is not None and kept is not None:
        # All that numba compares before it takes what is kept; there is no public way to say more.
        kept._source_stamp = (kept._source_stamp, _sources_hash(module, Path(file)))
    return dispatcher


@cache
def _sources_hash(module: str, file: Path) -> str:
    """Of a module and all that it imports of its package, directly or through others."""
    root = file.parents[module.count(".")]
    found, left = {}, [file]
    while left:
        path = left.pop()
        if path in found or not path.is_file():
            continue
        found[path] = text = path.read_text(encoding="utf-8")
        imported = [name for name in _IMPORT.findall(text) if name.split(".")[0] == module.split(".")[0]]
        left += [root.joinpath(*name.split(".")).with_suffix(".py") for name in imported]
    digest = hashlib.sha256()
    for path in sorted(found):
        digest.update(found[path].encode())
    return digest.hexdigest()
