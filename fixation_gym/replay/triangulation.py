"""What one triangulation of all centroids makes of a recording, beside the estimates that came picture by picture."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from fixation_gym.geometry.rigid import pose_to_matrix
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.distance.batch_triangulation import triangulate
from fixation_gym.perception.distance.calibrating_estimator import sighting_of
from fixation_gym.perception.distance.calibrating_filter import CalibratingSettings, distance_at
from fixation_gym.perception.distance.calibration_model import AGE, FOCAL, Sighting
from fixation_gym.perception.distance.own_motion import MAX_GAP_S
from fixation_gym.replay.looks import Look
from fixation_gym.replay.scores import distance_summary


class Sight(NamedTuple):
    """What a triangulation needs of a picture, and what is true of it."""

    time: float
    """s."""
    sighting: Sighting
    """Without a twist."""
    distance_true_m: float | None


def sight_of(look: Look, settings: CalibratingSettings) -> Sight:
    """Keep of a look what a triangulation needs; it holds no picture."""
    pose, seen = pose_to_matrix(look.camera_pose), look.percept.segmentation
    return Sight(look.percept.time, sighting_of(pose, np.zeros(6), seen, settings), look.truth.distance_m)


def triangulation_summary(sights: Sequence[Sight], settings: CalibratingSettings) -> dict[str, Any] | None:
    """Errors against truth, as of the estimates, and the calibration that was found, JSON-able.

    None if the target was never seen.
    """
    started = time.perf_counter()
    sightings = _with_twists(sights)
    state = triangulate(sightings, settings)
    if state is None:
        return None
    rows = []
    for sighting, sight in zip(sightings, sights, strict=True):
        found, truth = distance_at(state, sighting), sight.distance_true_m
        row = {"distance_m": found.lens, "distance_std_m": found.lens_std, "distance_true_m": truth}
        rows.append({**row, "visible": sighting.centroid is not None})
    stds = np.sqrt(np.diag(state.cov))
    return {
        "distance": distance_summary(rows),
        "image_age_ms": 1e3 * float(state.mean[AGE]),
        "image_age_std_ms": 1e3 * float(stds[AGE]),
        "focal_percent": 100.0 * float(state.mean[FOCAL]),
        "focal_std_percent": 100.0 * float(stds[FOCAL]),
        "wall_ms": 1e3 * (time.perf_counter() - started),
    }


def _with_twists(sights: Sequence[Sight]) -> list[Sighting]:
    """Sightings with the twist from the poses before and after, where these are close."""
    result = []
    for k, sight in enumerate(sights):
        first, last = max(0, k - 1), min(len(sights) - 1, k + 1)
        span, twist = sights[last].time - sights[first].time, sight.sighting.twist
        if 0.0 < span <= (last - first) * MAX_GAP_S:
            twist = mean_twist(sights[first].sighting.T_base_cam, sights[last].sighting.T_base_cam, span)
        result.append(replace(sight.sighting, twist=twist))
    return result
