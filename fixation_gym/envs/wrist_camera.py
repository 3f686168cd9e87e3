"""When the wrist camera takes its pictures and when they are there, and what of the arm's path they show.

Without a clock of its own the camera takes a picture at every control step. With one, it takes them at its own rate,
and the newest that is there is what the robot gets: no, one or several new ones since the last step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.envs.development import developed
from fixation_gym.envs.lens import wide_pinhole
from fixation_gym.envs.sensor_noise import SensorNoise
from fixation_gym.envs.shutter import exposed_rows, row_weights
from fixation_gym.geometry.camera import Intrinsics, Lens
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, ImageArray

_LONGEST_STRIDE = 4
"""Physics steps between the configurations that are rendered for one picture, at most ..."""
_STRIDE_RAD = 3e-3
"""... and how far the joints move meanwhile, at most, rad: about a pixel of 320 x 240, beyond which copies would show.
"""
_FARTHEST_JITTER = 0.45
"""Of a picture against the clock, as a share of its period: pictures stay in order."""


def intrinsics_of(image_size: tuple[int, int], noise: SensorNoise) -> Intrinsics:
    """The wrist camera with its lens and shutter, for pictures of (height, width) px.

    Raises:
        ValueError: if the lens bends the border of the picture too far.
    """
    pinhole = replace(Intrinsics.from_fovy(*image_size, ROBOT.camera.fovy), readout_s=noise.readout_s)
    if not noise.lens:
        return pinhole
    camera = replace(pinhole, lens=Lens(noise.lens))
    wide_pinhole(camera)
    return camera


@dataclass(frozen=True, eq=False)
class CameraState:
    """The camera's clock, what it will still have to show, and slow changes of its gains. Times are s since reset."""

    timestep: float
    """Of the physics, s."""
    substep: int
    """Number of physics steps since reset, at the end of ``path``."""
    path: FloatArray
    """Configurations after the last physics steps, the last is now, shape (n, nq)."""
    stamp_s: float
    """Middle of the exposure of the newest picture that is there, as its stamp says."""
    tick: int
    """Number of the next picture of the camera's own clock ..."""
    first_s: float
    """... whose picture 0 is due at this time ..."""
    next_s: float
    """... and which is taken at this time ..."""
    drops: bool
    """... but gets lost."""
    drift: FloatArray
    """Logarithms of the changed gains: of all channels, of red, of blue; shape (3,)."""
    lamp_s: float
    """By how much the light's flicker is ahead of the clock."""

    @property
    def now(self) -> float:
        """Time since reset, s."""
        return self.substep * self.timestep


def switched_on(noise: SensorNoise, qpos: FloatArray, timestep: float, rng: np.random.Generator) -> CameraState:
    """A camera that has been looking at a scene at rest for long, at reset."""
    first = stamp = -noise.delay_s
    if noise.frame_rate_hz:
        first = stamp = stamp - float(rng.uniform(0.0, 1.0 / noise.frame_rate_hz))
    drift = _drift_scale(noise)
    if drift.any():
        drift = drift * rng.standard_normal(3)
    lamp = float(rng.uniform(0.0, 1.0 / noise.flicker_hz)) if noise.flicker else 0.0
    state = CameraState(timestep, 0, qpos[None].copy(), stamp, 0, first, first, False, drift, lamp)
    return _next_tick(state, noise, rng) if noise.frame_rate_hz else state


def moved_on(state: CameraState, noise: SensorNoise, path: FloatArray, rng: np.random.Generator) -> CameraState:
    """The camera after the physics steps of a control period.

    Args:
        state: before.
        noise: of the camera.
        path: configurations after each step, shape (n, nq).
        rng: of the noise.
    """
    substep = state.substep + len(path)
    oldest = noise.delay_s + noise.image_latency_s + noise.least_delay_s
    if noise.frame_rate_hz:  # a picture may be waited for, and one get lost
        oldest += 3.0 / noise.frame_rate_hz
    kept = len(path) + math.ceil(oldest / state.timestep) + _LONGEST_STRIDE + 1
    elapsed = len(path) * state.timestep
    state = replace(state, substep=substep, path=np.concatenate([state.path, path])[-kept:])
    if not noise.frame_rate_hz:
        state = replace(state, stamp_s=state.now - noise.delay_s)
    while noise.frame_rate_hz and state.next_s + noise.delay_s <= state.now + 1e-9:
        state = replace(state, stamp_s=state.stamp_s if state.drops else state.next_s)
        state = _next_tick(state, noise, rng)
    return replace(state, drift=_drifted(state.drift, elapsed, noise, rng))


def _next_tick(state: CameraState, noise: SensorNoise, rng: np.random.Generator) -> CameraState:
    """The clock after a picture was taken."""
    period, tick = 1.0 / noise.frame_rate_hz, state.tick + 1
    late = 0.0
    if noise.frame_jitter_s:
        limit = _FARTHEST_JITTER * period
        late = min(max(noise.frame_jitter_s * float(rng.standard_normal()), -limit), limit)
    drops = bool(noise.frame_drops) and bool(rng.random() < noise.frame_drops)
    return replace(state, tick=tick, next_s=state.first_s + tick * period + late, drops=drops)


def _drift_scale(noise: SensorNoise) -> FloatArray:
    return np.array([noise.gain_drift, noise.white_balance_drift, noise.white_balance_drift])


def _drifted(drift: FloatArray, elapsed: float, noise: SensorNoise, rng: np.random.Generator) -> FloatArray:
    """Gains after some time: they wander about 1 and forget (an Ornstein-Uhlenbeck process)."""
    scale = _drift_scale(noise)
    if not scale.any():
        return drift
    keep = math.exp(-elapsed / noise.drift_time_s)
    return keep * drift + math.sqrt(1.0 - keep * keep) * scale * rng.standard_normal(3)


def configuration_at(state: CameraState, time_s: float) -> FloatArray:
    """Configuration of the simulation at a time not long ago, shape (nq,)."""
    return state.path[_index(state, time_s)]


def picture(
    state: CameraState,
    noise: SensorNoise,
    exposure: float,
    render: Callable[[FloatArray], ImageArray],
    rng: np.random.Generator,
) -> ImageArray:
    """The newest picture, shape (H, W, 3), with all that is wrong with it.

    Args:
        state: of the camera.
        noise: of the camera.
        exposure: factor on every grey level that is constant in an episode.
        render: makes the picture of a configuration, shape (nq,), as the camera sees it at rest.
        rng: of the noise.
    """
    light = exposed(state, noise, render)
    return developed(light, noise, exposure, state.drift, state.stamp_s - noise.image_latency_s + state.lamp_s, rng)


def exposed(state: CameraState, noise: SensorNoise, render: Callable[[FloatArray], ImageArray]) -> ImageArray:
    """The newest picture as the light falls in: with motion blur and rolling shutter, shape (H, W, 3).

    Args:
        state: of the camera.
        noise: of the camera.
        render: makes the picture of a configuration, shape (nq,).
    """
    if noise.least_delay_s == 0.0:
        return render(configuration_at(state, state.stamp_s - noise.image_latency_s))
    middle = state.stamp_s - noise.image_latency_s
    first = math.floor((middle - noise.least_delay_s) / state.timestep)
    last = math.ceil((middle + noise.least_delay_s) / state.timestep)
    stride = _stride(state)
    steps = np.arange(first, last + stride, stride)
    rendered: dict[int, ImageArray] = {}
    weights = None
    mixed = np.zeros(0, np.float32)
    for position, step in enumerate(steps.tolist()):
        index = _index(state, step * state.timestep)
        if index not in rendered:
            rendered[index] = render(state.path[index])
        image = rendered[index]
        if weights is None:
            rows = exposed_rows(middle, noise.readout_s, image.shape[0])
            weights = row_weights(steps * state.timestep, rows, noise.exposure_s).astype(np.float32)
            mixed = np.zeros(image.shape, np.float32)
        mixed += weights[position][:, None, None] * image
    return np.rint(mixed).astype(np.uint8)


def _stride(state: CameraState) -> int:
    """Physics steps between rendered configurations."""
    arm = state.path[:, : ROBOT.arm.joints]
    fastest = float(np.linalg.norm(np.diff(arm, axis=0), axis=1).max(initial=0.0))
    return min(max(int(_STRIDE_RAD / max(fastest, 1e-9)), 1), _LONGEST_STRIDE)


def _index(state: CameraState, time_s: float) -> int:
    """Row of the path that is nearest to a time; before reset everything was at rest."""
    back = round((state.now - time_s) / state.timestep)
    return min(max(len(state.path) - 1 - back, 0), len(state.path) - 1)
