"""Pictures of the wrist camera against stored ones, with every MuJoCo that the tests run on.

``python tests/envs/test_golden_pictures.py`` stores them again, after a change of scenes that is meant.
"""

from pathlib import Path

import cv2
import gymnasium as gym
import numpy as np
import pytest

from fixation_gym.gl import renderer_name

FOLDER = Path(__file__).parents[1] / "golden" / "pictures"
SCENARIOS = ("clear", "opaque", "translucent", "mirror", "clutter")
SEED, STEPS, SIZE = 3, 40, (96, 128)
MEAN_WITH_MESA, MEAN_WITH_ANOTHER = 0.1, 2.0
"""Mean difference of grey levels that may be: pictures were stored with Mesa's software renderer and MuJoCo 3.9.0."""


def pictures(scenario):
    """The first picture of an episode above the one after a slow way down with a turn, shape (2 H, W, 3)."""
    env = gym.make("fixation_gym:FixationPick-v0", scenario=scenario, image_size=SIZE, sensor_noise="ideal")
    first, _ = env.reset(seed=SEED)
    action = np.zeros(env.action_space.shape, np.float32)
    action[2], action[5] = 0.25, 0.25
    for _ in range(STEPS):
        last, *_ = env.step(action)
    env.close()
    assert np.linalg.norm(last["camera_pose"][:3] - first["camera_pose"][:3]) > 0.01  # it has moved
    return np.vstack([first["rgb"], last["rgb"]])


@pytest.mark.sim
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_pictures_are_those_that_were_stored(scenario):
    stored = cv2.imread(str(FOLDER / f"{scenario}.png"))[..., ::-1].astype(int)
    difference = np.abs(pictures(scenario) - stored)
    assert difference.mean() <= (MEAN_WITH_MESA if "llvmpipe" in renderer_name() else MEAN_WITH_ANOTHER)
    assert np.abs(np.roll(stored, 1, axis=1) - stored).mean() > 3.0 * MEAN_WITH_ANOTHER  # a pixel beside shows


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name in SCENARIOS:
        cv2.imwrite(str(FOLDER / f"{name}.png"), pictures(name)[..., ::-1])
