"""The paper's own rule for what is in front ("Avoiding obstacles"): the sign of flow times lateral velocity.

It follows from the flow of a small field of view without approach (Eq. 5), so it bends away from the plane of the
fixated object towards the image border and with forward motion. Kept for comparison; ``zero_flow`` has the exact test.

The rule knows no depth and no table, but who keeps what was seen needs the former and a robot over a table the latter.
So ``rule_answers`` takes the side from the rule and leaves to the exact test what is not about the side: which pixels
have evidence, what moves by itself, and what is too low to stand out from the table, which is a question of height.
"""

from __future__ import annotations

import numpy as np

from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.zero_flow.pixel_answers import PixelAnswers
from fixation_gym.types import FloatArray, MaskArray


def dot_product_front(flow: Flow, v: FloatArray) -> MaskArray:
    """Pixels in front by [x_dot, y_dot] . [v_X, v_Y] < 0, shape (h, w); False without flow.

    Args:
        flow: total image motion while the gaze is held.
        v: velocity of the camera in ``cam``, shape (3,), m/s; v_Z is not used.
    """
    with np.errstate(invalid="ignore"):
        return flow.flow @ np.asarray(v[:2], np.float32) < 0.0


def rule_answers(above: PixelAnswers, front: MaskArray, fixated: float, margin: float) -> PixelAnswers:
    """Answers with the side of every pixel as the rule says.

    A depth that contradicts the rule is moved to the rule's side by as little as counts there, so that it is where the
    rule puts it for whoever reads the depth, too. Its standard deviation stays: the rule has none.

    Args:
        above: answers to "above the table?" alone: ``p_nearer`` is the probability of that, 1 without a table.
        front: pixels in front by the rule, shape (h, w).
        fixated: inverse depth of the fixated object, 1/m.
        margin: what is in front has an inverse depth that is larger by this share at least.
    """
    depth = above.inverse_depth  # NaN without evidence, and stays so
    in_front, behind = np.float32(fixated * (1.0 + margin)), np.float32(fixated)
    sided = np.where(front, np.maximum(depth, in_front), np.minimum(depth, behind))
    p_front = np.where(front, above.p_nearer, np.float32(0.0))
    p_front[~above.supported] = 0.5
    return above._replace(inverse_depth=sided, p_nearer=p_front)
