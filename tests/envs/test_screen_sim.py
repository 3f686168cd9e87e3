"""What a screen decides, with a hand that is led to a fixed direction and then straight in."""

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401  (registers the ids)

pytestmark = pytest.mark.sim
LOW, STEEP = np.radians(50.0), np.radians(79.0)
AZIMUTH = np.radians(45.0)


def action_towards(obs, bearing, elevation):
    """Circle the target until the camera looks from AZIMUTH and ``elevation``, then go straight in and grasp."""
    axis, distance = obs["proprio"][10:13], obs["fixation"][3]
    turn = AZIMUTH - (np.arctan2(axis[1], axis[0]) - bearing)
    rise = elevation - np.arcsin(-axis[2])
    aligned = max(abs(turn) * np.cos(elevation), abs(rise)) < np.radians(6.0)
    v = [1.5 * turn * distance * np.cos(elevation), -1.5 * rise * distance, distance - (0.17 if aligned else 0.32)]
    centred = np.hypot(*obs["fixation"][:2]) < 0.06
    trigger = 1.0 if aligned and centred and distance < 0.19 else -1.0
    return np.array([*np.clip(v, -0.10, 0.10) / 0.15, trigger], np.float32)


@pytest.mark.parametrize(("side", "free", "barred"), [("low", STEEP, LOW), ("high", LOW, STEEP)], ids=["low", "high"])
def test_one_kind_of_way_is_free_and_the_other_ends_at_the_screen(side, free, barred):
    env = gym.make("FixationPickZFC-v0", scenario="screen", observation="blind", image_size=(96, 128))
    base = env.unwrapped

    def go(seed, elevation):
        obs, info = env.reset(seed=seed)
        x, y, _ = base.scene.target.position
        ended = False
        while not ended:
            obs, _, terminated, truncated, info = env.step(action_towards(obs, np.arctan2(y, x), elevation))
            ended = terminated or truncated or info["collision"]
        return info["is_success"], info["collision"]

    seed = 0
    env.reset(seed=seed)
    while base.scene.obstacles[0].shape != side:
        seed += 1
        env.reset(seed=seed)
    assert go(seed, free) == (True, False)
    assert go(seed, barred)[1]
    env.close()
