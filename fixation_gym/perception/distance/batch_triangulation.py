"""The plain rival of the filters: one triangulation of all centroids, with a robust loss and the same unknowns.

SciPy's least squares, on the model of the calibrating filter. It knows all frames at once, so it says nothing while
they come, and it takes the target to rest for all of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from fixation_gym.perception.distance.calibrating_filter import CalibratingSettings, CalibratingState, first_state
from fixation_gym.perception.distance.calibration_model import Sighting, frame_row, innovation_cov, innovations
from fixation_gym.perception.distance.inverse_depth import MIN_INVERSE_DEPTH
from fixation_gym.types import FloatArray

_GUESSES = (1.0, 0.5, 2.0)
"""Distances to begin from, as multiples of the first guess."""
_ROUNDS = 3
"""How often residuals are weighed again: their noise depends on the distance."""
_ROBUST_FROM = 2.0
"""Residuals count less than their square from so many standard deviations on."""


def triangulate(sightings: Sequence[Sighting], settings: CalibratingSettings) -> CalibratingState | None:
    """The most probable target and calibration given all sightings; None if it is never seen.

    Args:
        sightings: in any order; those without a centroid do not count.
        settings: prior and noise.
    """
    seen = [sighting for sighting in sightings if sighting.centroid is not None]
    if not seen:
        return None
    state = first_state(seen[0], settings)
    rows = np.array([frame_row(state.T_base_anchor, sighting, settings.noise_of(sighting)) for sighting in seen])
    solutions = [_solved(state, rows, guess * settings.initial_distance_m) for guess in _GUESSES]
    mean, cov, _ = min(solutions, key=lambda solution: solution[2])
    return CalibratingState(state.T_base_anchor, mean, cov, state.prior_mean, state.prior_cov, rows)


def _solved(state: CalibratingState, rows: FloatArray, depth: float) -> tuple[FloatArray, FloatArray, float]:
    """Unknowns, shape (11,), their covariance, shape (11, 11), and the cost, from a distance to begin with."""
    prior = state.prior_mean
    whiten_prior = np.linalg.inv(np.linalg.cholesky(state.prior_cov))
    mean = prior.copy()
    mean[2] = 1.0 / depth
    lowest = np.full(len(mean), -np.inf)
    lowest[2] = MIN_INVERSE_DEPTH
    cov, cost = state.prior_cov, np.inf
    for _ in range(_ROUNDS):
        _, _, by_pose = innovations(mean, rows)
        whiten = np.linalg.inv(np.linalg.cholesky(innovation_cov(rows, by_pose)))

        def residuals(unknowns: FloatArray, whiten: FloatArray = whiten) -> FloatArray:
            innovation, _, _ = innovations(unknowns, rows)
            return np.concatenate([(whiten @ innovation[..., None]).ravel(), whiten_prior @ (prior - unknowns)])

        def jacobian(unknowns: FloatArray, whiten: FloatArray = whiten) -> FloatArray:
            _, by_unknowns, _ = innovations(unknowns, rows)
            return -np.concatenate([(whiten @ by_unknowns).reshape(-1, len(unknowns)), whiten_prior])

        found = least_squares(
            residuals,
            mean,
            jacobian,  # pyright: ignore[reportArgumentType]  (SciPy's annotation knows names of methods alone)
            bounds=(lowest, np.inf),
            x_scale="jac",
            loss="soft_l1",
            f_scale=_ROBUST_FROM,
        )
        mean, cost = found.x, float(found.cost)
        cov = np.linalg.inv(found.jac.T @ found.jac)
    return mean, cov, cost
