"""What the doctor finds wrong, and that it says what to do."""

from __future__ import annotations

import pytest

from fixation_gym import doctor
from fixation_gym.gl import MissingGLError

HEALTHY = {
    **dict.fromkeys(doctor.REQUIRED, "1.0"),
    "python": "3.11.7",
    "mujoco": "3.9.0",
    "robosuite": "1.5.2",
    "numpy": "2.4.6",
}


def test_a_healthy_installation_has_no_problems() -> None:
    assert doctor.package_problems(HEALTHY) == []


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"opencv-python": "4.11"}, "pip uninstall -y opencv-python opencv-python-headless && pip install"),
        ({"mujoco": "3.6.0"}, "pip install 'mujoco>=3.7,<5'"),
        ({"mujoco": "5.0.0"}, "pip install 'mujoco>=3.7,<5'"),
        ({"robosuite": "1.4.1"}, "pip install robosuite==1.5.2"),
        ({"python": "3.13.0"}, "use 3.10, 3.11 or 3.12"),
    ],
)
def test_each_bad_version_is_one_problem_with_a_remedy(change: dict[str, str], problem: str) -> None:
    problems = doctor.package_problems({**HEALTHY, **change})
    assert len(problems) == 1
    assert problem in problems[0]


@pytest.mark.parametrize(
    ("change", "note"),
    [
        ({"numpy": "1.26.4"}, "NumPy 1.26.4 works"),
        ({"opencv-python": "1.0"}, "writes into the folder of opencv-python-headless"),
    ],
)
def test_what_plain_pip_gives_is_a_note_and_no_problem(change: dict[str, str], note: str) -> None:
    versions = {**HEALTHY, **change}
    assert doctor.package_problems(versions) == []
    assert [note in said for said in doctor.package_notes(versions)] == [True]
    assert doctor.package_notes(HEALTHY) == []


def test_a_missing_package_is_named() -> None:
    versions = {name: version for name, version in HEALTHY.items() if name != "scipy"}
    assert doctor.package_problems(versions) == [f"not installed: scipy; {doctor._REINSTALL}"]


def test_a_missing_gl_library_is_a_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    def select_backend() -> str:
        raise MissingGLError("no GL library renders here; apt-get install libegl1")

    monkeypatch.setattr(doctor, "select_backend", select_backend)
    diagnosis = doctor.diagnose()
    assert not diagnosis["ok"]
    assert diagnosis["gl"] is None
    assert "no GL library renders here; apt-get install libegl1" in diagnosis["problems"]


def test_a_black_frame_is_a_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "select_backend", lambda: "egl")
    monkeypatch.setattr(doctor, "frame_brightness", lambda: 0.0)
    assert "renders black frames" in doctor.diagnose()["problems"][-1]


def test_a_failing_renderer_is_a_problem_and_not_a_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> float:
        raise OSError("broken library")

    monkeypatch.setattr(doctor, "select_backend", lambda: "egl")
    monkeypatch.setattr(doctor, "frame_brightness", fail)
    assert "OSError: broken library" in doctor.diagnose()["problems"][-1]


def test_versions_name_what_is_installed_and_skip_what_is_not() -> None:
    versions = doctor.installed_versions()
    assert {"python", "numpy", "gymnasium"} <= set(versions)
    assert all(versions.values())


@pytest.mark.sim
def test_this_installation_is_healthy() -> None:
    diagnosis = doctor.diagnose()
    assert diagnosis["problems"] == []
    assert diagnosis["ok"]
    assert diagnosis["frame_brightness"] > 0.0
    assert diagnosis["gl_renderer"]
    assert diagnosis["workers"].startswith("may be forked" if "llvmpipe" in diagnosis["gl_renderer"] else "m")
