"""The door for rules that tell front from behind, and two of them: the exact test and the paper's rule.

Those that measure depth are in ``depth_rules``.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.zero_flow.dot_product_rule import dot_product_front, rule_answers
from fixation_gym.perception.zero_flow.pictures import Pictures
from fixation_gym.perception.zero_flow.pixel_answers import PixelAnswers, PixelQuestion, pixel_answers
from fixation_gym.types import FloatArray, MaskArray


class FrontRule(Protocol):
    """Says of every pixel on which side of the fixated object it is."""

    def __call__(
        self,
        flow: Flow,
        usable: MaskArray,
        question: PixelQuestion,
        twist: FloatArray,
        fixated: float,
        margin: float,
        pictures: Pictures | None,
    ) -> PixelAnswers:
        """Answer for every pixel of a flow.

        Args:
            flow: at the centre of three frames, shape (h, w).
            usable: pixels that may have evidence, shape (h, w).
            question: what the exact test asks: epipolar directions, boundary, support surface, noise.
            twist: mean camera twist [v, w] over the frames, expressed in ``cam``, shape (6,), m/s and rad/s.
            fixated: inverse depth of the fixated object, 1/m.
            margin: what is in front has an inverse depth that is larger by this share at least.
            pictures: that the flow was made of; None where nobody gave them.

        Returns:
            Side and inverse depth of every pixel, each array of shape (h, w).
        """
        ...


def exact_rule(
    flow: Flow,
    usable: MaskArray,
    question: PixelQuestion,
    twist: FloatArray,
    fixated: float,
    margin: float,
    pictures: Pictures | None,
) -> PixelAnswers:
    """The inverse depth that explains the motion along the epipolar line, against that of the fixated object."""
    return pixel_answers(flow, usable, question)


def dot_product_rule(
    flow: Flow,
    usable: MaskArray,
    question: PixelQuestion,
    twist: FloatArray,
    fixated: float,
    margin: float,
    pictures: Pictures | None,
) -> PixelAnswers:
    """The paper's rule, [x_dot, y_dot] . [v_X, v_Y] < 0; it knows no depth, but heights still tell the table."""
    above = pixel_answers(flow, usable, question._replace(boundary=np.float32(-np.inf)))
    return rule_answers(above, dot_product_front(flow, twist), fixated, margin)
