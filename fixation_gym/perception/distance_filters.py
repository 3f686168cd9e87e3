"""Distance of the fixated object from camera poses and image centroids: a three-state inverse-depth filter.

The state (alpha, beta, rho) is the object seen from an anchor camera: the point c_0 + R_0 [alpha, beta, 1] / rho in the
base frame (inverse depth after Civera, Davison & Montiel 2008). Poses enter as they are: differentiating them into
velocities, as a filter on twist and flow must, would waste most of their information.

Everything is value in, value out: ``initialise``, ``predict``, ``update``, ``distance_at``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.types import FloatArray


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
    position_std_m: float = 1e-4
    """Noise of the camera position, m."""
    rotation_std_rad: float = 2e-4
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
    flat_target: bool = False
    """Correct the slide of a flat target's centroid, Z (1 - 4 mu2); wrong for round ones."""


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
    """What is known about the fixated object now. Never NaN."""

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
    """Normalised innovation squared of the last centroid."""
    initialised: bool
    """False until the object was seen once; then the point is only the prior guess on the optical axis."""


def initialise(centroid: FloatArray, T_base_cam: FloatArray, settings: DistanceSettings) -> DistanceState:
    """Start at the first sight of the object, with the prior distance.

    Args:
        centroid: normalised image coordinates, shape (2,).
        T_base_cam: camera pose in base, shape (4, 4); it becomes the anchor.
        settings: prior and noise.
    """
    rho = 1.0 / settings.initial_distance_m
    ray_std = _ray_std(settings, 0.0, False)
    variances = [ray_std**2, ray_std**2, (settings.initial_relative_std * rho) ** 2]
    return DistanceState(np.array(T_base_cam), np.array([*centroid, rho]), np.diag(variances))


def predict(state: DistanceState, dt: float, settings: DistanceSettings, visible: bool = True) -> DistanceState:
    """Let the object walk randomly for ``dt`` s; more so while it is not seen."""
    alpha, beta, rho = state.mean
    walk = settings.walk_m if visible else settings.lost_walk_m
    # A displacement of the point by 1 m changes (alpha, beta, rho) by these columns.
    jacobian = rho * np.array([[1.0, 0.0, -alpha], [0.0, 1.0, -beta], [0.0, 0.0, -rho]])
    return replace(state, cov=state.cov + walk**2 * dt * jacobian @ jacobian.T)


def update(
    state: DistanceState,
    centroid: FloatArray,
    T_base_cam: FloatArray,
    settings: DistanceSettings,
    image_std: float = 0.0,
    touches_border: bool = False,
) -> DistanceState:
    """Take in one centroid by three Gauss-Newton steps; reject outliers, restart when they persist.

    Args:
        state: estimate before.
        centroid: seen normalised image coordinates, shape (2,).
        T_base_cam: camera pose in base, shape (4, 4).
        settings: noise and gates.
        image_std: standard deviation of the object's pixels about the centroid, normalised coordinates.
        touches_border: whether the object is cut by the image border.
    """
    predicted, jacobian = _projection(state, state.mean, T_base_cam)
    ray_std = _ray_std(settings, image_std, touches_border)
    noise = (ray_std**2 + (state.mean[2] * settings.position_std_m) ** 2) * np.eye(2)
    innovation = centroid - predicted
    spread = jacobian @ state.cov @ jacobian.T + noise
    nis = float(innovation @ np.linalg.solve(spread, innovation))
    if nis > settings.gate:
        rejected = state.rejected + 1
        if rejected >= settings.alarm_count:
            return _restart(state, centroid, T_base_cam, settings)
        return replace(state, nis=nis, rejected=rejected)
    mean, gain = state.mean, np.zeros((3, 2))
    for _ in range(3):
        predicted, jacobian = _projection(state, mean, T_base_cam)
        gain = state.cov @ jacobian.T @ np.linalg.inv(jacobian @ state.cov @ jacobian.T + noise)
        mean = state.mean + gain @ (centroid - predicted - jacobian @ (state.mean - mean))
        mean[2] = max(mean[2], MIN_INVERSE_DEPTH)
    keep = np.eye(3) - gain @ jacobian
    cov = keep @ state.cov @ keep.T + gain @ noise @ gain.T  # Joseph form: stays positive
    return DistanceState(state.T_base_anchor, mean, cov, nis, 0)


def distance_at(
    state: DistanceState, T_base_cam: FloatArray, settings: DistanceSettings
) -> tuple[float, float, FloatArray]:
    """Depth of the object along the optical axis of a camera.

    Returns:
        Depth in m (at least 1 cm), its standard deviation in m including the momentary pose noise, and the point in
        base, shape (3,), m.
    """
    anchor, (alpha, beta, rho) = state.T_base_anchor, state.mean
    ray = anchor[:3, :3] @ [alpha, beta, 1.0]
    point = anchor[:3, 3] + ray / rho
    axis = T_base_cam[:3, 2]
    depth = float(axis @ (point - T_base_cam[:3, 3]))
    across = axis @ anchor[:3, :2]
    jacobian = np.array([across[0], across[1], -(axis @ ray) / rho]) / rho
    variance = float(jacobian @ state.cov @ jacobian) + settings.position_std_m**2
    return max(depth, MIN_DEPTH_M), float(np.sqrt(variance)), point


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
        centroid, _ = _projection(state, state.mean, T_base_cam)
    if settings.flat_target:
        depth *= max(0.5, 1.0 - 4.0 * mean_variance)
    return Fixation(visible, np.array(centroid), point, depth, std, state.nis, True)


def _projection(state: DistanceState, mean: FloatArray, T_base_cam: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Image of the point (2,) and its derivative by (alpha, beta, rho), shape (2, 3)."""
    rotation = T_base_cam[:3, :3].T @ state.T_base_anchor[:3, :3]
    baseline = T_base_cam[:3, :3].T @ (state.T_base_anchor[:3, 3] - T_base_cam[:3, 3])
    ray = mean[2] * baseline + rotation @ [mean[0], mean[1], 1.0]
    depth = max(ray[2], 1e-3)
    image = ray[:2] / depth
    columns = np.column_stack([rotation[:, 0], rotation[:, 1], baseline])
    return image, (columns[:2] - np.outer(image, columns[2])) / depth


def _ray_std(settings: DistanceSettings, image_std: float, touches_border: bool) -> float:
    """Standard deviation of a centroid in normalised coordinates, without the position noise."""
    share = settings.border_std_size if touches_border else settings.centroid_std_size
    terms = (settings.centroid_std_px / _REFERENCE_FOCAL_PX, settings.rotation_std_rad, share * image_std)
    return float(np.linalg.norm(terms))


def _restart(
    state: DistanceState, centroid: FloatArray, T_base_cam: FloatArray, settings: DistanceSettings
) -> DistanceState:
    """Begin anew where the object is seen now; the distance is the old one, give or take the usual jump."""
    depth, std, _ = distance_at(state, T_base_cam, settings)
    fresh = initialise(centroid, T_base_cam, settings)
    rho = 1.0 / depth
    rho_std = min(np.hypot(std, settings.jump_std_m) * rho**2, settings.initial_relative_std * rho)
    cov = fresh.cov.copy()
    cov[2, 2] = rho_std**2
    return DistanceState(fresh.T_base_anchor, np.array([*centroid, rho]), cov)


MIN_INVERSE_DEPTH = 1e-3
"""Objects farther than 1 km are put there, 1/m."""
MIN_DEPTH_M = 0.01
"""Objects nearer than this, or behind the camera, are reported at this depth, m."""
_REFERENCE_FOCAL_PX = 308.0
