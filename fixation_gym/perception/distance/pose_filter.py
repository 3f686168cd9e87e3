"""Distance of the fixated object from camera poses and image centroids: a three-state inverse-depth filter.

The state (alpha, beta, rho) is the object seen from an anchor camera: the point c_0 + R_0 [alpha, beta, 1] / rho in the
base frame (inverse depth after Civera, Davison & Montiel 2008). Poses enter as they are: differentiating them into
velocities, as a filter on twist and flow must, would waste most of their information.

Everything is value in, value out: ``initialise``, ``predict``, ``update``, ``distance_at``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.perception.distance.inverse_depth import MIN_DEPTH_M, correction, product, projection, view_rows
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray

_REFERENCE_FOCAL_PX = 308.0
_IDENTITY = np.eye(3)


@dataclass(frozen=True, slots=True)
class DistanceSettings:
    """Prior, noise and gates of the filter; noise defaults are the "conservative" preset."""

    initial_distance_m: float = 0.5
    """Guess before any motion, m."""
    initial_relative_std: float = 0.6
    """Standard deviation of the first inverse depth, as a share of it: infinity lies within 2 sigma."""
    centroid_std_px: float = 0.5
    """Noise of the centroid, px of a 320 px wide image with 42 deg vertical view (focal length 308 px)."""
    centroid_std_size: float = 0.02
    """Part of the centroid noise that grows with the object, as a share of its standard deviation in the image."""
    border_std_size: float = 0.5
    """As ``centroid_std_size`` where the object touches the image border and its centroid is not the true one."""
    position_std_m: float = ROBOT.arm.position_std
    """Noise of the camera position, m."""
    rotation_std_rad: float = ROBOT.arm.rotation_std
    """Noise of the camera orientation, rad."""
    walk_m: float = 5e-4
    """Random walk of the object while it is seen, m per square root of a second."""
    lost_walk_m: float = 1e-2
    """Random walk of the object while it is not seen, m per square root of a second."""
    jump_std_m: float = 0.08
    """Size of the sudden displacements to expect: prior of the distance after a restart, m."""
    gate: float = 13.8
    """Largest accepted NIS: 99.9 % of chi-square with 2 degrees of freedom."""
    alarm_count: int = 4
    """Consecutive rejected centroids after which the object is taken to have moved and the filter restarts."""
    farthest_m: float = 20.0
    """An estimate beyond this is none, m: the filter begins again with its first guess, before it is sure of infinity
    and deaf to what comes near."""
    flat_target: bool = False
    """Correct the slide of a flat target's centroid, Z (1 - 4 mu2); wrong for round ones."""

    @property
    def centroid_std(self) -> float:
        """``centroid_std_px`` in normalised coordinates."""
        return self.centroid_std_px / _REFERENCE_FOCAL_PX


@dataclass(frozen=True, slots=True, eq=False)
class DistanceState:
    """Estimate of the fixated point."""

    T_base_anchor: FloatArray
    """Pose of the anchor camera in base, shape (4, 4)."""
    mean: FloatArray
    """(alpha, beta, rho): image coordinates in the anchor and inverse depth 1/m, shape (3,)."""
    cov: FloatArray
    """Covariance of ``mean``, shape (3, 3)."""
    nis: float = 0.0
    """Normalised innovation squared of the last centroid, chi-square with 2 degrees of freedom when consistent."""
    rejected: int = 0
    """Consecutive centroids that failed the gate."""


@dataclass(frozen=True, slots=True, eq=False)
class Fixation:
    """What is known about the fixated object now. Never NaN, but for ``nis``."""

    visible: bool
    """Whether the object was seen in this frame."""
    centroid: FloatArray
    """Normalised image coordinates, shape (2,): seen, or else predicted from the last estimate."""
    point_base: FloatArray
    """Estimated position in base, shape (3,), m."""
    distance_m: float
    """Depth along the optical axis of the current camera, m."""
    distance_std_m: float
    """Its standard deviation, m; positive and finite."""
    nis: float
    """Normalised innovation squared of the last measurement, as of 2 degrees of freedom; 0 or NaN if there was none."""
    initialised: bool
    """False until the object was seen once; then the point is only the prior guess on the optical axis."""
    lens: tuple[float, float] | None = None
    """Depth from the true camera and its standard deviation, m, if an estimator tells that from the believed one."""

    @property
    def depth_seen(self) -> tuple[float, float]:
        """Depth from the true camera, as pictures show it, as far as it is known, and its standard deviation, m."""
        return self.lens or (self.distance_m, self.distance_std_m)


def initialise(
    centroid: FloatArray,
    T_base_cam: FloatArray,
    settings: DistanceSettings,
    image_std: float = 0.0,
    touches_border: bool = False,
    centroid_std: float | None = None,
) -> DistanceState:
    """Start at the first sight of the object, with the prior distance.

    Args:
        centroid: normalised image coordinates, shape (2,).
        T_base_cam: camera pose in base, shape (4, 4); it becomes the anchor.
        settings: prior and noise.
        image_std: as for ``update``.
        touches_border: as for ``update``.
        centroid_std: as for ``update``.
    """
    rho = 1.0 / settings.initial_distance_m
    ray_std = _ray_std(settings, image_std, touches_border, centroid_std)
    variances = [ray_std**2, ray_std**2, (settings.initial_relative_std * rho) ** 2]
    return DistanceState(np.array(T_base_cam), np.array([*centroid, rho]), np.diag(variances))


def predict(
    state: DistanceState, dt: float, settings: DistanceSettings, visible: bool = True, slide_m: float = 0.0
) -> DistanceState:
    """Let the object walk randomly for ``dt`` s; more so while it is not seen.

    Args:
        state: estimate before.
        dt: time to pass, s.
        settings: random walks.
        visible: whether the object is seen now.
        slide_m: standard deviation of what the centroid moved on the object meanwhile, m.
    """
    alpha, beta, rho = state.mean.tolist()
    walk = settings.walk_m if visible else settings.lost_walk_m
    # A displacement of the point by 1 m along x, y, z changes (alpha, beta, rho) by rho times (1, 0, 0), (0, 1, 0) and
    # (-alpha, -beta, -rho).
    q = (walk**2 * dt + slide_m**2) * rho**2
    noise = [
        [q * (1.0 + alpha * alpha), q * alpha * beta, q * alpha * rho],
        [q * alpha * beta, q * (1.0 + beta * beta), q * beta * rho],
        [q * alpha * rho, q * beta * rho, q * rho * rho],
    ]
    return replace(state, cov=state.cov + np.array(noise))


def update(
    state: DistanceState,
    centroid: FloatArray,
    T_base_cam: FloatArray,
    settings: DistanceSettings,
    image_std: float = 0.0,
    touches_border: bool = False,
    centroid_std: float | None = None,
) -> DistanceState:
    """Take in one centroid by three Gauss-Newton steps; reject outliers, restart when they persist or it runs far off.

    Args:
        state: estimate before.
        centroid: seen normalised image coordinates, shape (2,).
        T_base_cam: camera pose in base, shape (4, 4).
        settings: noise and gates.
        image_std: standard deviation of the object's pixels about the centroid, normalised coordinates.
        touches_border: whether the object is cut by the image border.
        centroid_std: standard deviation of the centroid, normalised coordinates, if whoever found it knows.
    """
    view = view_rows(state.T_base_anchor, T_base_cam)
    prior = tuple(state.mean.tolist())
    seen = (float(centroid[0]), float(centroid[1]))
    noise = _ray_std(settings, image_std, touches_border, centroid_std) ** 2 + (prior[2] * settings.position_std_m) ** 2
    cov = state.cov.tolist()
    mean, nis, gain, jacobian = correction(view, prior, prior, cov, seen, noise)
    if nis > settings.gate:
        rejected = state.rejected + 1
        if rejected >= settings.alarm_count:
            depth, std, _ = distance_at(state, T_base_cam, settings)
            depth = min(depth, settings.farthest_m)
            std = math.hypot(std, settings.jump_std_m)
            return restart(centroid, T_base_cam, depth, std, settings, image_std, touches_border, centroid_std)
        return replace(state, nis=nis, rejected=rejected)
    for _ in range(2):
        mean, _, gain, jacobian = correction(view, prior, mean, cov, seen, noise)
    gains = np.array(gain)  # (3, 2)
    keep = _IDENTITY - gains @ np.array(jacobian)
    if mean[2] < 1.0 / settings.farthest_m:
        return initialise(centroid, T_base_cam, settings, image_std, touches_border, centroid_std)
    posterior = keep @ state.cov @ keep.T + noise * (gains @ gains.T)  # Joseph form: stays positive
    return DistanceState(state.T_base_anchor, np.array(mean), posterior, nis, 0)


def distance_at(
    state: DistanceState, T_base_cam: FloatArray, settings: DistanceSettings
) -> tuple[float, float, FloatArray]:
    """Depth of the object along the optical axis of a camera.

    Returns:
        Depth in m (at least 1 cm), its standard deviation in m including the momentary pose noise, and the point in
        base, shape (3,), m.
    """
    alpha, beta, rho = state.mean.tolist()
    anchor = state.T_base_anchor
    ray = anchor[:3, :3] @ np.array([alpha, beta, 1.0])
    point = anchor[:3, 3] + ray / rho
    axis = T_base_cam[:3, 2]
    depth = float(axis @ (point - T_base_cam[:3, 3]))
    ax, ay, _ = (axis @ anchor[:3, :3]).tolist()
    # Derivative of the depth by (alpha, beta, rho), times rho, against the covariance.
    j = (ax, ay, -float(axis @ ray) / rho)
    spread = product(state.cov.tolist(), j)
    variance = (j[0] * spread[0] + j[1] * spread[1] + j[2] * spread[2]) / rho**2 + settings.position_std_m**2
    return max(depth, MIN_DEPTH_M), math.sqrt(variance), point


def predicted_centroid(state: DistanceState, T_base_cam: FloatArray) -> FloatArray:
    """Normalised image coordinates, shape (2,), where a camera should see the object."""
    image, _ = projection(view_rows(state.T_base_anchor, T_base_cam), tuple(state.mean.tolist()))
    return np.array(image)


def fixation_at(
    state: DistanceState | None,
    T_base_cam: FloatArray,
    settings: DistanceSettings,
    centroid: FloatArray | None = None,
    mean_variance: float = 0.0,
) -> Fixation:
    """Describe the estimate as seen from a camera.

    Args:
        state: the estimate; None before the object was seen for the first time.
        T_base_cam: camera pose in base, shape (4, 4).
        settings: for the prior and for flat targets.
        centroid: seen normalised image coordinates, shape (2,); None when the object is not visible.
        mean_variance: mean of the two variances of the object's normalised pixel coordinates, for flat targets.
    """
    if state is None:
        guess = settings.initial_distance_m
        point = T_base_cam[:3, 3] + guess * T_base_cam[:3, 2]
        return Fixation(False, np.zeros(2), point, guess, settings.initial_relative_std * guess, 0.0, False)
    depth, std, point = distance_at(state, T_base_cam, settings)
    visible = centroid is not None
    if centroid is None:
        centroid = predicted_centroid(state, T_base_cam)
    if settings.flat_target:
        depth *= max(0.5, 1.0 - 4.0 * mean_variance)
    return Fixation(visible, np.array(centroid), point, depth, std, state.nis, True)


def _ray_std(settings: DistanceSettings, image_std: float, touches_border: bool, centroid_std: float | None) -> float:
    """Standard deviation of a centroid in normalised coordinates, without the position noise."""
    if centroid_std is not None:
        return math.hypot(centroid_std, settings.rotation_std_rad)
    share = settings.border_std_size if touches_border else settings.centroid_std_size
    terms = (settings.centroid_std, settings.rotation_std_rad, share * image_std)
    return math.hypot(*terms)


def restart(
    centroid: FloatArray,
    T_base_cam: FloatArray,
    depth: float,
    std: float,
    settings: DistanceSettings,
    image_std: float = 0.0,
    touches_border: bool = False,
    centroid_std: float | None = None,
) -> DistanceState:
    """Begin again where the object is seen now, with its depth and standard deviation from elsewhere, m."""
    fresh = initialise(centroid, T_base_cam, settings, image_std, touches_border, centroid_std)
    rho = 1.0 / max(depth, MIN_DEPTH_M)
    cov = fresh.cov.copy()
    cov[2, 2] = min(std * rho**2, settings.initial_relative_std * rho) ** 2
    return DistanceState(fresh.T_base_anchor, np.array([*centroid, rho]), cov)
