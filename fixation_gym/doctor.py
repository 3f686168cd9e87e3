"""What is installed here, and what keeps it from working."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from functools import cache
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from fixation_gym import gl
from fixation_gym.envs.photoreal import engine
from fixation_gym.gl import PROBE_MODEL, MissingGLError, select_backend

REQUIRED = (
    "fixation-gym",
    "gymnasium",
    "mujoco",
    "robosuite",
    "numpy",
    "scipy",
    "opencv-python-headless",
    "imageio-ffmpeg",
    "joblib",
    "tqdm",
    "tyro",
    "matplotlib",
)
OPTIONAL = ("torch", "stable-baselines3", "tensorboard", "ray", "mitsuba")
HEADLESS_CV2 = "opencv-python-headless"
OTHER_CV2 = ("opencv-python", "opencv-contrib-python", "opencv-contrib-python-headless")
"""Distributions that write the same folder ``cv2``; with two of them, neither is whole."""

_FORK = "may be forked or spawned at any time"
_SPAWN = "must be spawned, or forked before the first picture"
_FROM_SOURCE = (Path(__file__).parents[1] / "scripts" / "bootstrap.sh").exists()
_REINSTALL = (
    "make a fresh environment: rm -rf .venv && make test"
    if _FROM_SOURCE
    else "install the wheel again in a fresh environment: python -m venv fresh && fresh/bin/pip install <the wheel>"
)


def installed_versions() -> dict[str, str]:
    """Versions of Python and of the installed packages that results depend on."""
    versions = {name: _version(name) for name in (*REQUIRED, *OTHER_CV2, *OPTIONAL)}
    found = {name: version for name, version in versions.items() if version is not None}
    return {"python": platform.python_version(), **found}


@cache  # a process does not see packages change, and parsing the metadata of twenty takes 20 ms
def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def package_problems(versions: Mapping[str, str]) -> list[str]:
    """What is wrong with a set of installed versions; every entry says what to do."""
    problems = []
    if not (3, 10) <= _release(versions["python"])[:2] <= (3, 12):
        problems.append(f"Python {versions['python']} is not tested; use 3.10, 3.11 or 3.12")
    missing = [name for name in REQUIRED if name not in versions]
    if missing:
        problems.append(f"not installed: {', '.join(missing)}; {_REINSTALL}")
    others = [name for name in OTHER_CV2 if name in versions]
    if _same_cv2("opencv-python", versions):
        others.remove("opencv-python")
    if others:
        problems.append(f"{' and '.join(others)} overwrites {HEADLESS_CV2} with another version; {_one_cv2(others)}")
    if "mujoco" in versions and not (3, 7) <= _release(versions["mujoco"])[:2] < (5, 0):
        problems.append(f"MuJoCo {versions['mujoco']} is not among those that were tried; pip install 'mujoco>=3.7,<5'")
    if "robosuite" in versions and _release(versions["robosuite"])[:3] != (1, 5, 2):
        problems.append(f"robosuite {versions['robosuite']} is not 1.5.2; pip install robosuite==1.5.2")
    return problems


def package_notes(versions: Mapping[str, str]) -> list[str]:
    """What is unlike the versions that all tests run with, but works: plain pip obeys robosuite's old limits."""
    notes = []
    if _same_cv2("opencv-python", versions):
        notes.append(
            f"opencv-python, which robosuite asks for, writes into the folder of {HEADLESS_CV2}: this works, but needs "
            f"libGL; without it: {_one_cv2(['opencv-python'])}"
        )
    if "numpy" in versions and _release(versions["numpy"])[:1] < (2,):
        notes.append(
            f"NumPy {versions['numpy']} works, but most tests run with 2.x. You may pip install 'numpy>=2': the limit "
            "that robosuite brings concerns a humanoid that is not used here"
        )
    return notes


def _same_cv2(name: str, versions: Mapping[str, str]) -> bool:
    """Whether it is there in the same version as the headless one."""
    return name in versions and versions[name] == versions.get(HEADLESS_CV2)


def _one_cv2(others: list[str]) -> str:
    """How to have one OpenCV."""
    return f"pip uninstall -y {' '.join([*others, HEADLESS_CV2])} && pip install {HEADLESS_CV2}"


def diagnose() -> dict[str, Any]:
    """Look at versions and GL, and render one frame.

    Returns:
        ``ok``; ``problems``, each with what to do; ``notes`` on what works, but is not as tested; ``versions``; ``gl``,
        the backend or None; ``gl_renderer``, its name of itself; ``workers``, which processes can render;
        ``frame_brightness``, the mean of a rendered test frame (0..255) or None; ``mitsuba``, which of its variants
        the photoreal renderer takes, and why, or None if it is not installed.
    """
    versions = installed_versions()
    problems = package_problems(versions)
    backend = brightness = None
    if "mujoco" in versions:
        try:
            backend = select_backend()
            brightness = frame_brightness()
            if brightness <= 0.0:
                problems.append(f"the GL backend {backend} renders black frames; set MUJOCO_GL to egl or osmesa")
        except MissingGLError as error:
            problems.append(str(error))
        except Exception as error:  # a broken installation can fail in any way, and saying so is this command's job
            problems.append(f"rendering failed ({type(error).__name__}: {error}); {_REINSTALL}")
    return {
        "ok": not problems,
        "problems": problems,
        "notes": package_notes(versions),
        "versions": versions,
        "gl": backend,
        "gl_renderer": gl.renderer_name() or None,
        "workers": None if brightness is None else _FORK if gl.renders_after_fork() else _SPAWN,
        "frame_brightness": brightness,
        "mitsuba": engine.explain_choice() if engine.is_installed() else None,
    }


def frame_brightness() -> float:
    """Mean brightness of one frame of a tiny scene, 0..255. Call after ``select_backend``."""
    mujoco: Any = import_module("mujoco")  # not at the top: it must find MUJOCO_GL set; Any: it has no type stubs
    model = mujoco.MjModel.from_xml_string(PROBE_MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, 64, 64) as renderer:
        gl.note_context()
        renderer.update_scene(data, "down")
        return float(renderer.render().mean())


def _release(version: str) -> tuple[int, ...]:
    """Leading numbers of a version: (3, 10, 0) of 3.10.0rc1+cpu."""
    numbers = []
    for part in version.split("+")[0].split("."):
        digits = part[: len(part) - len(part.lstrip("0123456789"))]
        if not digits:
            break
        numbers.append(int(digits))
    return tuple(numbers)
