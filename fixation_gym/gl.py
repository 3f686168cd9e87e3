"""Choice of the OpenGL library that MuJoCo renders with.

MuJoCo reads ``MUJOCO_GL`` when it is imported, and robosuite sets it to ``egl`` whether or not EGL works. So
``select_backend`` runs before the environment imports them; if MuJoCo is there already, it is made to read again.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import os
import subprocess
import sys
from collections.abc import Iterator

DEBIAN_PACKAGES = ("libegl1", "libgl1", "libgles2", "libosmesa6")
CANDIDATES = ("egl", "osmesa")
"""Tried in this order; both render without a display."""

PROBE_MODEL = """
<mujoco>
  <worldbody>
    <light pos="0 0 3"/>
    <geom type="plane" size="1 1 0.1" rgba="0.8 0.3 0.2 1"/>
    <camera name="down" pos="0 0 1"/>
  </worldbody>
</mujoco>
"""

_CHECKED = "FIXATION_GYM_GL"  # the backend that was seen working; child processes inherit it and do not probe again
_CONTEXT_MODULE = "mujoco.rendering.classic.gl_context"
_PROBE_TIMEOUT_S = 180.0  # EGL can hang when many processes share one GPU; a busy machine is only slow
_PROBE = f"""
import mujoco
model = mujoco.MjModel.from_xml_string('''{PROBE_MODEL}''')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 16, 16) as renderer:
    renderer.update_scene(data, "down")
    assert renderer.render().max() > 0
"""

_SOFTWARE = ("llvmpipe", "softpipe")
"""In the names of Mesa's software renderers."""
_first_process: int | None = None
_renderer_name = ""
_has_threads = False
"""Whether somebody rendered before the number of Mesa's threads was set."""
_EGL_MODULES = ("mujoco.egl", "robosuite.renderers.context.egl_context")


class MissingGLError(RuntimeError):
    """No GL library renders here. The message is one line that names what to install."""


class LostGLError(MissingGLError):
    """A GL context that was open is gone. The message is one line that says how to go on."""


def select_backend() -> str:
    """Choose a working backend and set ``MUJOCO_GL`` and ``PYOPENGL_PLATFORM`` to it.

    A ``MUJOCO_GL`` that the user set is checked, but never replaced. The first call costs about a second per backend
    tried, in a child process, so that a failure leaves nothing behind in this one; later calls cost nothing.

    Returns:
        The value of ``MUJOCO_GL``: "egl" or "osmesa", or what the user chose.

    Raises:
        MissingGLError: if no backend renders, or the user's choice does not.
    """
    _set_mesa_defaults()
    chosen = os.environ.get("MUJOCO_GL", "").strip().lower()
    if chosen and chosen == os.environ.get(_CHECKED):
        return chosen
    if chosen and not renders(chosen):
        raise MissingGLError(
            f"MUJOCO_GL={chosen} does not render here; unset MUJOCO_GL to choose among {', '.join(CANDIDATES)}, "
            f"or install what it needs (Debian, software rendering: apt-get install {' '.join(DEBIAN_PACKAGES)})"
        )
    backend = chosen or next((candidate for candidate in CANDIDATES if renders(candidate)), "")
    if not backend:
        raise MissingGLError(
            f"no GL library renders here; on Debian or Ubuntu: apt-get install {' '.join(DEBIAN_PACKAGES)}"
        )
    os.environ.update(backend_environment(backend), **{_CHECKED: backend})
    if _CONTEXT_MODULE in sys.modules:
        # MuJoCo was imported first and may have taken its default, a window; now it reads MUJOCO_GL again.
        importlib.reload(sys.modules[_CONTEXT_MODULE])
    return backend


def _set_mesa_defaults() -> None:
    """Defaults for Mesa's software renderer, which reads them when the first context is made."""
    global _has_threads
    if "LP_NUM_THREADS" not in os.environ:
        # Threads of its own do not survive a fork: the child then hangs. One environment alone would be faster with
        # them, workers beside each other are not; see docs/clients.md.
        os.environ["LP_NUM_THREADS"] = "0"
        _has_threads = any(getattr(sys.modules.get(name), "EGL_DISPLAY", None) for name in _EGL_MODULES)
    # Cheaper blends between a texture's resolutions save a fifth of the time of a picture.
    os.environ.setdefault("GALLIVM_PERF", "brilinear,rho_approx")


def note_context() -> None:
    """Remember who renders and with what, for processes forked later; call it where a GL context is current."""
    # Chooses its platform when imported, so not before the backend is selected; all of OpenGL.GL takes 0.16 s.
    from OpenGL.raw.GL.VERSION import GL_1_0

    global _first_process, _renderer_name
    if _first_process is None:
        _first_process = os.getpid()
        name = ctypes.string_at(GL_1_0.glGetString(GL_1_0.GL_RENDERER))  # pyright: ignore[reportArgumentType]
        _renderer_name = str(name, "ascii", "replace")


def renderer_name() -> str:
    """What the GL library says that it renders with; empty before the first context."""
    return _renderer_name


def renders_after_fork() -> bool:
    """Whether a process forked from this one after the first picture can render: software without threads can."""
    in_software = any(name in _renderer_name for name in _SOFTWARE)
    return in_software and os.environ.get("LP_NUM_THREADS") == "0" and not _has_threads


def require_own_context() -> None:
    """Check that this process may open a GL context.

    Raises:
        RuntimeError: if it was forked from one that has rendered, and GL would not work in it.
    """
    if _first_process not in (None, os.getpid()) and not renders_after_fork():
        raise RuntimeError(
            f"a process forked from one that has rendered cannot render with {_renderer_name}: start workers by spawn, "
            "as gym.make_vec does by default, or fork before the first reset"
        )


@contextlib.contextmanager
def borrowed_thread() -> Iterator[None]:
    """Render meanwhile; afterwards this thread has the GL context that it had before.

    So another thread may take ours, and a library that takes its own to be current, such as robosuite, is right. With
    EGL only: OSMesa does not give a context back.
    """
    if os.environ.get("MUJOCO_GL") != "egl":
        yield
        return
    from OpenGL import EGL

    display = EGL.eglGetCurrentDisplay()
    before = EGL.eglGetCurrentContext()
    surfaces = EGL.eglGetCurrentSurface(EGL.EGL_DRAW), EGL.eglGetCurrentSurface(EGL.EGL_READ)
    try:
        yield
    finally:
        if before:
            EGL.eglMakeCurrent(display, *surfaces, before)
        elif ours := EGL.eglGetCurrentDisplay():
            EGL.eglMakeCurrent(ours, EGL.EGL_NO_SURFACE, EGL.EGL_NO_SURFACE, EGL.EGL_NO_CONTEXT)


@contextlib.contextmanager
def losses_told() -> Iterator[None]:
    """Render meanwhile; a context that is gone, with the display or alone, is told in one sentence.

    Raises:
        LostGLError: if it is. EGL is then asked for a display again when the next context is opened.
    """
    try:
        yield
    except Exception as error:
        from OpenGL.error import GLError

        if not isinstance(error, GLError):
            raise
        if mujoco_egl := sys.modules.get("mujoco.egl"):
            mujoco_egl.EGL_DISPLAY = None  # pyright: ignore[reportAttributeAccessIssue]
        reason = getattr(getattr(error, "err", None), "name", type(error).__name__)
        raise LostGLError(
            f"the GL context is gone ({reason}): another library shut EGL down, or the graphics driver began again; "
            "close() the environment and reset() it, or run the program again"
        ) from error


def renders(backend: str) -> bool:
    """Whether MuJoCo renders a frame with this backend, tried in a child process."""
    environment = {key: value for key, value in os.environ.items() if key != "PYOPENGL_PLATFORM"}
    environment.update(backend_environment(backend))
    try:
        probe = subprocess.run(
            [sys.executable, "-c", _PROBE],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=_PROBE_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False
    return probe.returncode == 0


def backend_environment(backend: str) -> dict[str, str]:
    """Environment variables that make MuJoCo and PyOpenGL use a backend."""
    variables = {"MUJOCO_GL": backend}
    if backend in CANDIDATES:  # the two that PyOpenGL loads; with others it has no part
        variables["PYOPENGL_PLATFORM"] = backend
    return variables


def main() -> int:
    """Print the backend, or what is missing; used by scripts/bootstrap.sh."""
    try:
        print(select_backend())
    except MissingGLError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
