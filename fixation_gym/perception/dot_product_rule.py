"""The paper's own rule for what is in front ("Avoiding obstacles"): the sign of flow times lateral velocity.

It follows from the flow of a small field of view without approach (Eq. 5), so it bends away from the plane of the
fixated object towards the image border and with forward motion. Kept for comparison; ``zero_flow`` has the exact test.
"""

from __future__ import annotations

import numpy as np

from fixation_gym.perception.optic_flow import Flow
from fixation_gym.types import FloatArray, MaskArray


def dot_product_front(flow: Flow, v: FloatArray) -> MaskArray:
    """Pixels in front by [x_dot, y_dot] . [v_X, v_Y] < 0, shape (h, w); False without flow.

    Args:
        flow: total image motion while the gaze is held.
        v: velocity of the camera in ``cam``, shape (3,), m/s; v_Z is not used.
    """
    with np.errstate(invalid="ignore"):
        return flow.flow @ np.asarray(v[:2], np.float32) < 0.0
