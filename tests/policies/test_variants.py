"""The variants of the servo: which there are, and that each differs from the full one in what it names."""

from __future__ import annotations

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_kinematic_loop import INTRINSICS, START, TARGET, run

from fixation_gym.envs.config import SCENARIOS
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.pipeline import Perception
from fixation_gym.robots import ROBOT
from fixation_policies.catalogue import POLICY_NAMES, make_policy, needed_environment
from fixation_policies.servo.servo_policy import ServoPolicy
from fixation_policies.servo.variants import VARIANT_NAMES, VARIANTS, servo_variant


def test_every_variant_is_a_policy_and_the_full_servo_comes_first() -> None:
    assert VARIANT_NAMES[0] == "servo"
    assert len(set(VARIANT_NAMES)) == len(VARIANT_NAMES)
    assert set(VARIANT_NAMES) <= set(POLICY_NAMES)


@pytest.mark.parametrize("name", VARIANT_NAMES[1:])
def test_a_variant_differs_from_the_full_servo(name: str) -> None:
    assert replace(servo_variant(name), name="servo", summary=VARIANTS[0].summary) != VARIANTS[0]


def test_a_policy_has_the_settings_of_its_variant() -> None:
    env = SimpleNamespace(intrinsics=Intrinsics.from_fovy(32, 32, 0.7), scenario=SCENARIOS["clear"])
    policy = make_policy("servo:no_feed_forward", SimpleNamespace(unwrapped=env))
    assert isinstance(policy, ServoPolicy)
    assert policy.gains == servo_variant("servo:no_feed_forward").gains


def test_without_poses_the_fixation_constraint_leads_the_hand_to_the_target() -> None:
    variant = servo_variant("servo:hard_filter")
    policy = ServoPolicy(Perception(INTRINSICS, variant.perception), variant.gains)
    trail = run(policy, START, 14.0)
    _, estimate, T_base_cam, _ = next(item for item in trail if item[1].phase == "approach")
    true = T_base_cam[:3, 2] @ (TARGET - T_base_cam[:3, 3])
    assert estimate.distance_m == pytest.approx(true, rel=0.1)
    T_base_cam = next(pose for _, estimate, pose, _ in trail if estimate.phase == "close")
    tool = T_base_cam[:3, :3] @ ROBOT.tool_in_camera + T_base_cam[:3, 3]
    assert np.linalg.norm(tool - TARGET) < 0.02


def test_only_the_variant_that_asks_a_depth_camera_is_given_one() -> None:
    assert [name for name in POLICY_NAMES if needed_environment(name).arguments] == ["servo:depth"]
    assert needed_environment("servo:depth").arguments == {"depth_camera": True}


RULES = ("servo:dot_product", "servo:depth", "servo:motion_stereo", "servo:plane_parallax")


@pytest.mark.parametrize("name", [*RULES, "servo:hard_filter", "servo:no_body"])
def test_an_ablation_of_perception_leaves_the_behaviour_and_the_rest_of_perception_alone(name: str) -> None:
    variant, full = servo_variant(name), VARIANTS[0]
    assert variant.gains == full.gains
    assert variant.avoid_obstacles
    changed = [
        field.name
        for field in fields(variant.perception)
        if getattr(variant.perception, field.name) != getattr(full.perception, field.name)
    ]
    assert len(changed) == 1
