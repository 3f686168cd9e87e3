"""From the paper's algorithm to the servo, one change at a time: every rung is a policy of the catalogue.

What holds the gaze comes first, since nothing else works without it; then what is known of distance and obstacles; then
what the arm can do; then where the hand goes.
"""

from __future__ import annotations

LADDER: dict[str, str] = {
    "paper": "the paper's algorithm: Eqs. 6-8, filter on flow, one grasp",
    "paper:feed_forward": "the gaze hears of the camera's own motion before it sees it",
    "paper:pose_filter": "distance from poses and centroids, of the thing where the target was last seen",
    "paper:exact_test": "the exact zero-flow test, with the table's height",
    "paper:limits": "within the arm's reach, the hand level and then across the target",
    "paper:body": "the grasp goes for the middle of the body fitted to outlines",
    "servo:ways_only": "memory of obstacles and choice of a way, in place of their centre of mass",
    "servo:no_retry": "looking along the way before going in",
    "servo": "a second try",
}
"""What each rung adds to the one below it, by the name of its policy."""
BESIDE = ("blind", "random", "oracle")
"""Policies that are shown beside the ladder."""
