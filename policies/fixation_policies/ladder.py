"""From the paper's algorithm to the servo, one step at a time: every rung is a policy of the catalogue.

What holds the gaze comes first, since nothing else works without it; then what is known of distance and obstacles; then
what the arm can do; then where the hand goes.
"""

from __future__ import annotations

from fixation_policies.paper import PAPER_VARIANTS

LADDER: dict[str, str] = {
    **{variant.name: variant.summary for variant in PAPER_VARIANTS},
    "servo:ways_only": "memory of obstacles and choice of a way, in place of their centre of mass; the servo's gains",
    "servo:no_retry": "looking along the way before going in",
    "servo": "a second try",
}
"""What each rung adds to the one below it, by the name of its policy."""
BESIDE = ("blind", "random", "oracle")
"""Policies that are shown beside the ladder."""
