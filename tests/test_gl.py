"""The choice of the GL backend; the libraries themselves are asked only in the test marked sim."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fixation_gym import gl


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """No choice made yet; the backends that are probed are listed. OSMesa alone renders."""
    for variable in ("MUJOCO_GL", "PYOPENGL_PLATFORM", "FIXATION_GYM_GL"):
        monkeypatch.setenv(variable, "")  # so that the test's own changes are undone
        monkeypatch.delenv(variable)
    names: list[str] = []

    def renders(backend: str) -> bool:
        names.append(backend)
        return backend == "osmesa"

    monkeypatch.setattr(gl, "renders", renders)
    monkeypatch.setattr(gl, "_CONTEXT_MODULE", "not imported")  # other tests go on rendering in this process
    return names


def test_egl_is_tried_first_and_osmesa_is_the_fallback(tried: list[str]) -> None:
    assert gl.select_backend() == "osmesa"
    assert tried == ["egl", "osmesa"]
    assert os.environ["MUJOCO_GL"] == os.environ["PYOPENGL_PLATFORM"] == "osmesa"


def test_a_choice_is_probed_once(tried: list[str]) -> None:
    gl.select_backend()
    tried.clear()
    assert gl.select_backend() == "osmesa"
    assert tried == []


def test_the_users_choice_is_respected(tried: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    assert gl.select_backend() == "osmesa"
    assert tried == ["osmesa"]


def test_a_users_choice_that_fails_is_an_error_and_not_replaced(
    tried: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "egl")
    with pytest.raises(gl.MissingGLError, match="MUJOCO_GL=egl does not render here"):
        gl.select_backend()
    assert tried == ["egl"]
    assert os.environ["MUJOCO_GL"] == "egl"


def test_without_any_library_one_line_names_the_packages(tried: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gl, "renders", lambda backend: False)
    with pytest.raises(gl.MissingGLError) as error:
        gl.select_backend()
    assert "apt-get install libegl1 libgl1 libgles2 libosmesa6" in str(error.value)
    assert "\n" not in str(error.value)
    assert "MUJOCO_GL" not in os.environ


def test_the_bootstrap_installs_the_packages_that_the_error_names() -> None:
    script = Path(__file__).parents[1] / "scripts" / "bootstrap.sh"
    assert f'GL_PACKAGES="{" ".join(gl.DEBIAN_PACKAGES)}"' in script.read_text()


@pytest.mark.sim
def test_a_backend_that_does_not_exist_does_not_render() -> None:
    assert not gl.renders("no-such-backend")
    assert any(gl.renders(backend) for backend in gl.CANDIDATES)


@pytest.mark.sim
def test_mujoco_imported_first_still_renders_without_a_display() -> None:
    code = (
        "import mujoco, gymnasium, fixation_gym\n"
        "env = gymnasium.make('FixationPick-v0', image_size=(48, 64))\n"
        "print(env.reset(seed=0)[0]['rgb'].std())"
    )
    hidden = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "FIXATION_GYM_GL", "DISPLAY")
    environment = {key: value for key, value in os.environ.items() if key not in hidden}
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
    assert result.returncode == 0, result.stderr
    assert float(result.stdout.split()[-1]) > 5.0
