# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""Which textures a GL context has: one that nothing shows yet is not uploaded.

GL stores the picture on a cube six times. Those of the obstacles' materials take 83 MB, and a scene shows few of them.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np


def shown_textures(model: Any) -> frozenset[int]:
    """The sky's texture, and those of the materials that geoms have in the present scene, hidden ones included."""
    sky = np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    materials = np.unique(model.geom_matid[model.geom_matid >= 0])
    return frozenset([*sky.tolist(), *model.mat_texid[materials].ravel().tolist()]) - {-1}


@contextlib.contextmanager
def one_texel_each(model: Any) -> Iterator[None]:
    """A GL context that is opened meanwhile has one texel of every texture."""
    sizes = model.tex_width.copy(), model.tex_height.copy()
    model.tex_width[:] = model.tex_height[:] = 1
    try:
        yield
    finally:
        model.tex_width[:], model.tex_height[:] = sizes


def take_nearest_texels(model: Any, context: Any, textures: frozenset[int]) -> None:
    """Sample far textures at the nearest texel of the nearest resolution instead of blending eight of them.

    Several samples per pixel blend already; in software GL this saves a fifth of the time of a picture.

    Args:
        model: compiled ``mjModel``.
        context: ``MjrContext``, whose GL context is current.
        textures: indices in the model.
    """
    # Chooses its platform when imported, so not before the backend is selected; all of OpenGL.GL takes 0.16 s.
    from OpenGL.raw.GL.VERSION import GL_1_0, GL_1_1, GL_1_3

    for texture in textures:
        flat = model.tex_type[texture] == mujoco.mjtTexture.mjTEXTURE_2D
        target = GL_1_0.GL_TEXTURE_2D if flat else GL_1_3.GL_TEXTURE_CUBE_MAP
        GL_1_1.glBindTexture(target, int(context.texture[texture]))
        GL_1_0.glTexParameteri(target, GL_1_0.GL_TEXTURE_MIN_FILTER, GL_1_0.GL_NEAREST_MIPMAP_NEAREST)
