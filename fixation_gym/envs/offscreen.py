# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""MuJoCo's off-screen renderer as a good neighbour: of other libraries, of threads and of forked processes."""

from __future__ import annotations

import atexit
import os
from typing import Any

import mujoco
import numpy as np

from fixation_gym import gl
from fixation_gym.envs.textures import one_texel_each, shown_textures, take_nearest_texels


class Offscreen(mujoco.Renderer):
    """Renders in a GL context that is current only meanwhile. Create lazily: a context holds meshes and textures."""

    def __init__(self, model: Any, height: int, width: int, *, nearest_texels: bool = False) -> None:
        """Open a GL context, with no textures yet.

        Args:
            model: compiled ``mjModel``.
            height: rows of the buffer, px.
            width: its columns, px.
            nearest_texels: see ``textures.take_nearest_texels``.

        Raises:
            RuntimeError: in a process forked from one that has rendered, where GL would wait for ever.
        """
        self._gl_context = self._mjr_context = None  # there is nothing to close yet
        gl.require_own_context()
        self._process = os.getpid()
        self._nearest_texels = nearest_texels
        self._waiting, self._materials = frozenset(range(model.ntex)), b""
        with gl.losses_told(), gl.borrowed_thread(), one_texel_each(model):
            super().__init__(model, height, width)
            gl.note_context()
        # Freed before EGL shuts down, which MuJoCo registered when it made the context; later, EGL complains.
        atexit.register(self._close_at_exit)

    def upload_textures(self) -> None:
        """Upload the textures that the present scene is the first to show. Depth needs none.

        Raises:
            LostGLError: if the context is gone.
        """
        materials = self.model.geom_matid.tobytes()
        if materials == self._materials:
            return
        new = self._waiting & shown_textures(self.model)
        with gl.losses_told(), gl.borrowed_thread():
            assert self._gl_context is not None
            self._gl_context.make_current()
            for texture in new:
                mujoco.mjr_uploadTexture(self.model, self._mjr_context, texture)
            if self._nearest_texels:
                take_nearest_texels(self.model, self._mjr_context, new)
        self._waiting, self._materials = self._waiting - new, materials

    def render(self, *, out: np.ndarray | None = None) -> np.ndarray:
        """Picture of the scene as it was last updated; see ``mujoco.Renderer.render``.

        Raises:
            RuntimeError: in a process forked since the context was opened, where GL would wait for ever.
            LostGLError: if the context is gone.
        """
        if os.getpid() != self._process:
            gl.require_own_context()
        with gl.losses_told(), gl.borrowed_thread():
            return super().render(out=out)

    def close(self) -> None:
        """Free the GL context, or forget it if it is gone; may be called twice."""
        if self._gl_context is None:
            return
        atexit.unregister(self._close_at_exit)
        try:
            with gl.losses_told(), gl.borrowed_thread():
                super().close()
        except gl.LostGLError:
            self._forget()

    def _close_at_exit(self) -> None:
        """Free the GL context, unless another library, such as robosuite, has shut EGL down and it with that."""
        try:
            self.close()
        except Exception:  # PyOpenGL's, which may be unloaded by now
            self._forget()

    def _forget(self) -> None:
        """Drop a context that is gone, without asking GL."""
        if self._gl_context is not None:
            self._gl_context._context = None
        self._gl_context = self._mjr_context = None
