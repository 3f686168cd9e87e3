"""The variants of the servo: which there are, and that each differs from the full one in what it names."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from fixation_gym.geometry.camera import Intrinsics
from policies.catalogue import POLICY_NAMES, make_policy
from policies.servo.servo_policy import ServoPolicy
from policies.servo.variants import VARIANT_NAMES, VARIANTS, servo_variant


def test_every_variant_is_a_policy_and_the_full_servo_comes_first() -> None:
    assert VARIANT_NAMES[0] == "servo"
    assert len(set(VARIANT_NAMES)) == len(VARIANT_NAMES)
    assert set(VARIANT_NAMES) <= set(POLICY_NAMES)


@pytest.mark.parametrize("name", VARIANT_NAMES[1:])
def test_a_variant_differs_from_the_full_servo(name: str) -> None:
    assert replace(servo_variant(name), name="servo", summary=VARIANTS[0].summary) != VARIANTS[0]


def test_a_policy_has_the_settings_of_its_variant() -> None:
    env = SimpleNamespace(unwrapped=SimpleNamespace(intrinsics=Intrinsics.from_fovy(32, 32, 0.7)))
    policy = make_policy("servo:no_feed_forward", env)
    assert isinstance(policy, ServoPolicy)
    assert policy.gains == servo_variant("servo:no_feed_forward").gains
