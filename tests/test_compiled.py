"""What numba keeps on disk is taken only while nothing that it was compiled from has changed."""

import subprocess
import sys

import numba
import pytest

from fixation_gym.compiled import compiled

CALLEE = """
from fixation_gym.compiled import compiled
OFFSET = {offset}
@compiled
def scaled(x):
    return {factor} * x
"""
CALLER = """
from fixation_gym.compiled import compiled
from made_up.inner.callee import OFFSET, scaled
@compiled
def value(x):
    return scaled(x) + OFFSET
"""
RUN = "from made_up.caller import value; print(value(10.0), sum(value.stats.cache_hits.values()))"


def run(folder):
    result = subprocess.run(
        [sys.executable, "-c", RUN], cwd=folder, capture_output=True, text=True, timeout=300, check=True
    )
    value, hits = result.stdout.split()
    return float(value), int(hits)


@pytest.fixture
def package(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "made_up" / "inner").mkdir(parents=True)
    for name in ("__init__.py", "inner/__init__.py"):
        (tmp_path / "made_up" / name).touch()
    (tmp_path / "made_up" / "caller.py").write_text(CALLER)
    (tmp_path / "made_up" / "inner" / "callee.py").write_text(CALLEE.format(offset=1.0, factor=2.0))
    return tmp_path


@pytest.mark.parametrize("change", [{"offset": 5.0, "factor": 2.0}, {"offset": 1.0, "factor": 3.0}])
def test_a_change_in_another_file_is_seen_and_no_change_is_not(package, change):
    assert run(package) == (21.0, 0)
    assert run(package) == (21.0, 1)
    (package / "made_up" / "inner" / "callee.py").write_text(CALLEE.format(**change))
    assert run(package) == (10.0 * change["factor"] + change["offset"], 0)
    assert run(package) == (10.0 * change["factor"] + change["offset"], 1)


def test_functions_are_compiled_where_nothing_can_be_kept(monkeypatch):
    njit = numba.njit

    def without_a_place(cache=False, **options):
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return njit(**options)

    monkeypatch.setattr(numba, "njit", without_a_place)
    assert compiled(lambda x: x + 1)(1) == 2
