"""What in a replay contradicts what is taken for granted: one sentence for each thing, for ``alarms`` in the summary.

A wrong K, late poses and a hand-eye error are learnt by the calibrating estimator as far as motion tells them. Whatever
is learnt beyond what was to be expected, and whatever is left over, is said here.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fixation_gym.perception.distance.calibrating_estimator import Calibration
from fixation_gym.perception.distance.calibrating_filter import CalibratingSettings
from fixation_gym.perception.hand_eye.hand_eye_filter import HEIGHT, HandEyeState
from fixation_gym.replay.time_offset import TimeOffset

_SURE = 3.0
"""Standard deviations from which on something is said."""
_LEAST_AGE_S = 5e-3
"""A smaller offset between pictures and poses costs less than a calibration usually leaves."""
_LARGEST_LEFT_PX = 1.0
"""What true poses leave unexplained of the pictures' motion is well below."""


def calibration_summary(found: Calibration, settings: CalibratingSettings) -> dict[str, Any]:
    """What was learnt of the camera, JSON-able; offsets and errors each with its std."""
    translation, rotation = 1e3 * found.translation_m, np.degrees(found.rotation_rad)
    noise = None if math.isnan(found.noise) else found.noise
    return {
        "image_age_ms": 1e3 * found.image_age_s,
        "image_age_std_ms": 1e3 * found.image_age_std_s,
        "hand_eye_mm": translation.tolist(),
        "hand_eye_std_mm": (1e3 * found.translation_std_m).tolist(),
        "hand_eye_deg": rotation.tolist(),
        "hand_eye_std_deg": np.degrees(found.rotation_std_rad).tolist(),
        "focal_percent": 100.0 * found.focal,
        "focal_std_percent": 100.0 * found.focal_std,
        "noise_ratio": noise,
        "pose_noise_mm": None if noise is None else 1e3 * noise * settings.position_std_m,
        "pose_noise_deg": None if noise is None else math.degrees(noise * settings.rotation_std_rad),
        "restarts": found.restarts,
    }


def hand_eye_summary(found: HandEyeState) -> dict[str, Any]:
    """What the table's motion told of how the camera sits on the hand, JSON-able; errors each with its std."""
    return {
        "hand_eye_mm": (1e3 * found.mean[:3]).tolist(),
        "hand_eye_std_mm": (1e3 * found.stds[:3]).tolist(),
        "hand_eye_deg": np.degrees(found.mean[3:6]).tolist(),
        "hand_eye_std_deg": np.degrees(found.stds[3:6]).tolist(),
        "table_higher_mm": 1e3 * float(found.mean[HEIGHT]),
        "pictures": found.pictures,
        "corrected": found.proven,
    }


def hand_eye_alarms(found: HandEyeState | None) -> list[str]:
    """A sentence on a camera that sits elsewhere, by how the table moves; none without such an error."""
    if found is None or not found.proven:
        return []
    way, turn = (float(np.linalg.norm(error)) for error in (found.mean[:3], found.mean[3:6]))
    return [
        f"the table moves as if the camera sat {1e3 * way:.1f} mm and {math.degrees(turn):.1f} deg from where the "
        "poses have it; poses were corrected by that: calibrate again"
    ]


def alarms_on(
    found: Calibration | None, settings: CalibratingSettings, left_px: float | None, offset: TimeOffset | None
) -> list[str]:
    """Sentences on what is wrong.

    Args:
        found: what the calibrating estimator learnt; None if another was used, or the target was never seen.
        settings: with what was to be expected.
        left_px: what the poses leave unexplained of the pictures' motion, px; None: unknown.
        offset: how late poses are against pictures; None: unknown.
    """
    alarms = []
    if offset is not None and offset.counts:
        late = "late" if offset.offset_s > 0.0 else "early"
        alarms.append(
            f"by the pictures, poses come {1e3 * abs(offset.offset_s):.0f} ms {late} (std "
            f"{1e3 * offset.std_s:.1f} ms); every picture was given the pose of its own moment"
        )
    if left_px is not None and left_px > _LARGEST_LEFT_PX:
        alarms.append(
            f"the poses leave {left_px:.1f} px of the pictures' motion unexplained: K, stamps or poses are wrong"
        )
    return alarms if found is None else [*alarms, *_learnt(found, settings), *_left_over(found)]


def _learnt(found: Calibration, settings: CalibratingSettings) -> list[str]:
    """On errors that were found and are accounted for."""
    alarms, age, std = [], found.image_age_s, found.image_age_std_s
    if abs(age) > max(_SURE * std, _LEAST_AGE_S):
        later = "older than their poses" if age > 0.0 else "newer than their poses, which come late"
        alarms.append(
            f"pictures are {1e3 * abs(age):.0f} ms {later} (std {1e3 * std:.0f} ms); the distance accounts for it, "
            "the map does not: correct the stamps"
        )
    way, turn = (float(np.linalg.norm(error)) for error in (found.translation_m, found.rotation_rad))
    expected = "more than --pose-noise lets expect; it is accounted for, as far as motion tells"
    if way > _SURE * math.sqrt(3.0) * settings.hand_eye_m:
        alarms.append(f"the camera seems to be {1e3 * way:.1f} mm from where the poses have it, {expected}")
    if turn > _SURE * math.sqrt(3.0) * settings.hand_eye_rad:
        alarms.append(f"the camera seems turned by {math.degrees(turn):.1f} deg against the poses, {expected}")
    if abs(found.focal) > max(_SURE * found.focal_std, settings.focal):
        alarms.append(
            f"the focal length seems {100.0 * found.focal:+.1f} % off (std {100.0 * found.focal_std:.1f} %): check K, "
            "and whether the target's middle is the same point in all views"
        )
    return alarms


def _left_over(found: Calibration) -> list[str]:
    """On what no error of the calibration explains."""
    alarms = []
    # Wilson and Hilferty's quantile of chi-square.
    spread = 2.0 / (9.0 * max(found.noise_dof, 1.0))
    if found.noise**2 > (1.0 - spread + _SURE * math.sqrt(spread)) ** 3:
        alarms.append(
            f"centroids are {found.noise:.1f} times as far from where they should be as stated noise explains: poses "
            "are noisier than --pose-noise, or the target's middle slides; stds are scaled up"
        )
    if found.restarts:
        times = "once" if found.restarts == 1 else f"{found.restarts} times"
        alarms.append(f"the target was {times} not where it should be: it moved, or something else was followed")
    return alarms
