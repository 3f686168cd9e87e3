"""The door for rules that tell front from behind, and two of them: the exact test and the paper's rule.

Those that measure depth are in ``depth_rules``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.zero_flow.dot_product_rule import dot_product_front, rule_answers
from fixation_gym.perception.zero_flow.pictures import Pictures
from fixation_gym.perception.zero_flow.pixel_answers import PixelAnswers, PixelQuestion, pixel_answers
from fixation_gym.strangers import whose_code
from fixation_gym.types import FloatArray, MaskArray


@dataclass(frozen=True, slots=True, eq=False)
class FrontQuestion:
    """What a rule is asked: all that is known when pixels are to be told front from behind."""

    flow: Flow
    """At the centre of three frames, shape (h, w)."""
    usable: MaskArray
    """Pixels that may have evidence, shape (h, w)."""
    exact: PixelQuestion
    """What the exact test asks: epipolar directions, boundary, support surface, noise."""
    twist: FloatArray
    """Mean camera twist [v, w] over the frames, expressed in ``cam``, shape (6,), m/s and rad/s."""
    fixated: float
    """Inverse depth of the fixated object, 1/m."""
    margin: float
    """What is in front has an inverse depth that is larger by this share at least."""
    pictures: Pictures | None = None
    """That the flow was made of; None where nobody gave them."""


class FrontRule(Protocol):
    """Says of every pixel on which side of the fixated object it is."""

    def __call__(self, asked: FrontQuestion, /) -> PixelAnswers:
        """Side and inverse depth of every pixel of the flow, each array of shape (h, w)."""
        ...


def answered(rule: FrontRule, asked: FrontQuestion) -> PixelAnswers:
    """What a rule says, checked.

    Raises:
        ValueError: if that is no answer for every pixel.
        RuntimeError: from whatever somebody else's rule raised, naming whose code it was.
    """
    with whose_code("front rule", rule) as name:
        answers = rule(asked)
    shape = asked.usable.shape
    if not isinstance(answers, PixelAnswers) or any(np.shape(array) != shape for array in answers):
        raise ValueError(f"the front rule {name} must return PixelAnswers with arrays of shape {shape}")
    return answers


def exact_rule(asked: FrontQuestion) -> PixelAnswers:
    """The inverse depth that explains the motion along the epipolar line, against that of the fixated object."""
    return pixel_answers(asked.flow, asked.usable, asked.exact)


def dot_product_rule(asked: FrontQuestion) -> PixelAnswers:
    """The paper's rule, [x_dot, y_dot] . [v_X, v_Y] < 0; it knows no depth, but heights still tell the table."""
    above = pixel_answers(asked.flow, asked.usable, asked.exact._replace(boundary=np.float32(-np.inf)))
    return rule_answers(above, dot_product_front(asked.flow, asked.twist), asked.fixated, asked.margin)
