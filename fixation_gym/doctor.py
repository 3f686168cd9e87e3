"""What is installed here, and what keeps it from working."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from functools import cache
from importlib import import_module, metadata
from typing import Any

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
OPTIONAL = ("torch", "stable-baselines3", "tensorboard", "ray")
HEADLESS_CV2 = "opencv-python-headless"
OTHER_CV2 = ("opencv-python", "opencv-contrib-python", "opencv-contrib-python-headless")
"""Distributions that write the same folder ``cv2``; with two of them, neither is whole."""

_REINSTALL = "make a fresh environment: rm -rf .venv && make test"


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
    extra_cv2 = [name for name in OTHER_CV2 if name in versions]
    if extra_cv2:
        every_cv2 = " ".join([*extra_cv2, HEADLESS_CV2])
        problems.append(
            f"{' and '.join(extra_cv2)} overwrites {HEADLESS_CV2}; pip uninstall -y {every_cv2} "
            f"&& pip install {HEADLESS_CV2}"
        )
    if "mujoco" in versions and not (3, 3) <= _release(versions["mujoco"])[:2] < (3, 10):
        problems.append(
            f"MuJoCo {versions['mujoco']} does not work with robosuite 1.5.2; pip install 'mujoco>=3.3,<3.10'"
        )
    if "robosuite" in versions and _release(versions["robosuite"])[:3] != (1, 5, 2):
        problems.append(f"robosuite {versions['robosuite']} is not 1.5.2; pip install robosuite==1.5.2")
    if "numpy" in versions and _release(versions["numpy"])[:1] < (2,):
        problems.append(
            f"NumPy {versions['numpy']} is older than the tested 2.x (plain pip keeps an old limit of robosuite's); "
            f"{_REINSTALL}"
        )
    return problems


def diagnose() -> dict[str, Any]:
    """Look at versions and GL, and render one frame.

    Returns:
        ``ok``; ``problems``, each with what to do; ``versions``; ``gl``, the backend or None; ``frame_brightness``, the
        mean of a rendered test frame (0..255) or None.
    """
    versions = installed_versions()
    problems = package_problems(versions)
    gl = brightness = None
    if "mujoco" in versions:
        try:
            gl = select_backend()
            brightness = frame_brightness()
            if brightness <= 0.0:
                problems.append(f"the GL backend {gl} renders black frames; set MUJOCO_GL to egl or osmesa")
        except MissingGLError as error:
            problems.append(str(error))
        except Exception as error:  # a broken installation can fail in any way, and saying so is this command's job
            problems.append(f"rendering failed ({type(error).__name__}: {error}); {_REINSTALL}")
    return {
        "ok": not problems,
        "problems": problems,
        "versions": versions,
        "gl": gl,
        "frame_brightness": brightness,
    }


def frame_brightness() -> float:
    """Mean brightness of one frame of a tiny scene, 0..255. Call after ``select_backend``."""
    mujoco: Any = import_module("mujoco")  # not at the top: it must find MUJOCO_GL set; Any: it has no type stubs
    model = mujoco.MjModel.from_xml_string(PROBE_MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, 64, 64) as renderer:
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
