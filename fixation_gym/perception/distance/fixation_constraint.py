"""Distance from the paper's hard fixation constraint alone: the measured ratio of rotation and translation.

While the gaze is held, w_X = d v_Y and w_Y = -d v_X (Eqs. 2-3, with the signs of ``geometry.interaction``). This is the
ablation of the pose filter (``pose_filter``) and uses the "hard" filter of ``flow_filters``. It is given
no flow: at the fixation point the constraint makes the flow zero for any distance, so all of the distance comes from
the twist. The centroid says nothing but where the ray to the target is and how fast the gaze drifts off.

The constraint holds only while the target is seen. For everything else, also for what is known while the target is
hidden, the estimate is written down as a ``DistanceState`` of the current camera. Value in, value out.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from fixation_gym.perception.distance import flow_filters as flow_distance_filters
from fixation_gym.perception.distance import pose_filter as distance_filters
from fixation_gym.perception.distance.flow_filters import FlowFilterSettings, FlowFilterState
from fixation_gym.perception.distance.pose_filter import DistanceSettings, DistanceState
from fixation_gym.types import FloatArray


@dataclass(frozen=True, slots=True)
class ConstraintSettings:
    """Noise of what the constraint is applied to; defaults are the "conservative" preset."""

    filter: FlowFilterSettings = field(default_factory=lambda: FlowFilterSettings(jerk=0.5, drift=1e-2))
    """Process noise and gates; a servo changes its velocity more abruptly than a circle does, and its target may move.
    The prior of the distance is not used: it is the one of ``DistanceSettings``."""
    velocity_std: float = 2e-3
    """Noise of each measured camera velocity, m/s: 3 mrad/s in every joint of a Panda."""
    rate_std: float = 5e-3
    """Noise of each measured camera rotation rate, rad/s."""
    farthest_m: float = 2.0
    """A target farther than this is out of any arm's reach, m: the filter begins again with the first guess, as a robot
    that believes it would run into what is in fact near."""
    centroid_std: float = 6.5e-4
    """Noise of the centroid, normalised coordinates: 0.2 px at a focal length of 308 px."""


@dataclass(frozen=True, slots=True, eq=False)
class ConstrainedGaze:
    """The filter while the target is seen."""

    filter: FlowFilterState
    """Motion of the camera and inverse depth of the target now."""
    centroid: FloatArray
    """Where the target is seen now, normalised coordinates, shape (2,)."""
    drift: FloatArray
    """Rate at which it drifts from where it is held, shape (2,), 1/s."""


def advance(
    gaze: ConstrainedGaze | None,
    centroid: FloatArray,
    twist: FloatArray,
    dt: float,
    prior: tuple[float, float],
    settings: ConstraintSettings,
) -> ConstrainedGaze:
    """Take in one frame in which the target is seen.

    Args:
        gaze: result of the frame before; None if the target was not seen in it.
        centroid: of the target, normalised coordinates, shape (2,).
        twist: measured camera twist [v, w] at the time of the frame, shape (6,), m/s and rad/s.
        dt: time since the frame before, s.
        prior: depth of the target and its standard deviation, m, with which to begin when the target comes into sight.
        settings: noise.
    """
    if gaze is None:  # nobody knows yet how fast the gaze drifts, so the constraint waits for the next frame
        depth, std = prior
        first = replace(settings.filter, initial_distance_m=depth, initial_relative_std=std / depth)
        return ConstrainedGaze(flow_distance_filters.initialise("hard", first), np.array(centroid), np.zeros(2))
    drift = gaze_drift(gaze.drift, gaze.centroid, centroid, dt, settings.centroid_std)
    noise = np.diag([settings.velocity_std**2] * 3 + [settings.rate_std**2] * 3)
    state = flow_distance_filters.predict(gaze.filter, dt, settings.filter)
    state = flow_distance_filters.update(state, twist, noise, None, settings.filter, drift)
    return ConstrainedGaze(state, np.array(centroid), drift)


def too_far(gaze: ConstrainedGaze, settings: ConstraintSettings) -> bool:
    """Whether the estimate is beyond what an arm could reach, so that it must be wrong."""
    return flow_distance_filters.distance_of(gaze.filter)[0] > settings.farthest_m


def anchored(gaze: ConstrainedGaze, T_base_cam: FloatArray, settings: DistanceSettings) -> DistanceState:
    """The estimate as a point on the ray to the centroid, anchored in the current camera.

    Args:
        gaze: the filter now.
        T_base_cam: camera pose in base now, shape (4, 4).
        settings: noise of the ray.
    """
    depth, std = flow_distance_filters.distance_of(gaze.filter)
    return distance_filters.restart(gaze.centroid, T_base_cam, depth, std, settings)


def gaze_drift(
    drift: FloatArray, before: FloatArray | None, now: FloatArray | None, dt: float, centroid_std: float
) -> FloatArray:
    """Rate at which the target drifts from where it is held, shape (2,), 1/s: what exceeds noise, fading slowly.

    Args:
        drift: result of the frame before, shape (2,), 1/s.
        before: centroid in the frame before, normalised coordinates, shape (2,); None if it was not seen.
        now: centroid in this frame.
        dt: time between them, s.
        centroid_std: noise of each centroid, normalised coordinates.
    """
    if before is None or now is None:
        return drift
    noise = np.sqrt(2.0) * centroid_std / dt
    excess = np.maximum(((now - before) / dt) ** 2 - (2.0 * noise) ** 2, 0.0)
    return np.maximum(np.sqrt(excess), _DRIFT_FADING * drift)


_DRIFT_FADING = 0.8
"""Share of a drift that still counts in the next frame."""
