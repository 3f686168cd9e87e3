"""Mitsuba, and which of its variants works here.

``llvm_ad_rgb`` takes a third of the time of ``scalar_rgb``, but needs a recent LLVM library, and an old one ends the
whole process. So it is tried in a child process first, as ``gl.py`` does with GL libraries.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import subprocess
import sys
from functools import cache
from typing import Any

from fixation_gym.errors import UsageError, check_names

RENDERERS = ("mujoco", "mitsuba")
"""What can make the wrist camera's pictures."""
LLVM, SCALAR = "llvm_ad_rgb", "scalar_rgb"
"""Variants of Mitsuba that are used, the faster one first."""
VARIANT = "FIXATION_GYM_MITSUBA"
"""Environment variable with the user's choice of a variant."""
_CHECKED = "FIXATION_GYM_MITSUBA_CHECKED"  # the variant that was seen working; child processes do not probe again
_PROBE_TIMEOUT_S = 180.0
_PROBE = f"""
import mitsuba
mitsuba.set_variant("{LLVM}")
scene = mitsuba.load_dict({{
    "type": "scene",
    "integrator": {{"type": "path"}},
    "sensor": {{"type": "perspective", "film": {{"type": "hdrfilm", "width": 4, "height": 4}}}},
    "light": {{"type": "constant"}},
    "ball": {{"type": "sphere", "center": [0, 0, 4], "bsdf": {{"type": "dielectric"}}}},
}})
assert float(mitsuba.TensorXf(mitsuba.render(scene, spp=1)).array[0]) > 0.0
"""


class MissingMitsubaError(UsageError):
    """Mitsuba is not installed, or not as it is asked for. The message is one line that says what to do."""


def is_installed() -> bool:
    """Whether Mitsuba and its denoiser can be imported."""
    return all(importlib.util.find_spec(name) is not None for name in ("mitsuba", "pyoidn"))


def check_renderer(name: str) -> None:
    """Check that there is a renderer of that name here.

    Raises:
        UsageError: if there is none of that name, or it needs what is not installed.
    """
    check_names([name], RENDERERS, "renderer")
    if name == "mitsuba":
        require()


def require() -> None:
    """Check that Mitsuba is there.

    Raises:
        MissingMitsubaError: if not, naming the extra that brings it.
    """
    if not is_installed():
        raise MissingMitsubaError(
            "renderer 'mitsuba' needs a package that is not installed; pip install 'fixation-gym[photoreal]'"
        )


def choose_variant() -> str:
    """Choose a variant: the user's, else LLVM's where it works. The first call may take some seconds.

    Returns:
        ``LLVM`` or ``SCALAR``.

    Raises:
        MissingMitsubaError: if Mitsuba is not installed, or the user's choice does not work.
    """
    require()
    chosen = os.environ.get(VARIANT, "").strip()
    if chosen not in ("", LLVM, SCALAR):
        raise MissingMitsubaError(f"{VARIANT} must be {LLVM} or {SCALAR}, got {chosen!r}")
    if chosen == LLVM and (reason := why_no_llvm()):
        raise MissingMitsubaError(f"{VARIANT}={LLVM} does not work here: {reason}")
    if chosen:
        return chosen
    checked = os.environ.get(_CHECKED)
    if checked is None:
        checked = os.environ[_CHECKED] = SCALAR if why_no_llvm() else LLVM
    return checked


def explain_choice() -> str:
    """Which variant is taken, and why, as one line. Call it where Mitsuba is installed."""
    try:
        variant = choose_variant()
    except MissingMitsubaError as error:
        return str(error)
    if os.environ.get(VARIANT, "").strip():
        return f"{variant}, as {VARIANT} says"
    return f"{LLVM}, which works here" if variant == LLVM else f"{SCALAR}, for {LLVM} does not work: {why_no_llvm()}"


def why_no_llvm() -> str:
    """Why LLVM's variant does not work here, as one sentence; empty if it does. A library is tried once."""
    return _trouble_with(os.environ.get("DRJIT_LIBLLVM_PATH", ""))


@cache
def _trouble_with(library: str) -> str:
    """What a child process says that finds LLVM at ``library``, or where it usually is if that is empty."""
    environment = {**os.environ, "DRJIT_LIBLLVM_PATH": library} if library else None
    try:
        result = subprocess.run(
            [sys.executable, "-c", _PROBE],
            capture_output=True,
            text=True,
            timeout=_PROBE_TIMEOUT_S,
            check=False,
            env=environment,
        )
    except subprocess.TimeoutExpired:
        return f"it gave no picture within {_PROBE_TIMEOUT_S:.0f} s"
    if result.returncode == 0:
        return ""
    lines = [line.strip() for line in result.stderr.splitlines() if line.strip()]
    says = next((line for line in lines if "LLVM" in line), lines[-1] if lines else f"exit code {result.returncode}")
    return f"it says {says[:120]!r}; LLVM 19 works, as in Debian's libllvm19 (DRJIT_LIBLLVM_PATH names the library)"


def load() -> Any:
    """The module ``mitsuba`` with its variant set.

    Raises:
        MissingMitsubaError: as ``choose_variant``.
    """
    variant = choose_variant()
    mitsuba: Any = importlib.import_module("mitsuba")
    if mitsuba.variant() != variant:
        mitsuba.set_variant(variant)
    return mitsuba


def load_denoiser() -> Any:
    """The module ``pyoidn``: Intel's Open Image Denoise, which gives equal pictures for equal ones.

    Raises:
        MissingMitsubaError: if it is not installed.
    """
    require()
    return importlib.import_module("pyoidn")
