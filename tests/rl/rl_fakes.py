"""A stand-in for FixationPickZFC-v0 whose every step is known, for the learner's side of things."""

import os

import gymnasium as gym
import numpy as np

from fixation_gym.envs.info import with_prefix
from fixation_gym.envs.zfc_observation import zfc_observation_space

TERMS = {"progress": 0.75, "time": 0.25, "success": 0.0, "collision": 0.0}
"""Of every step's reward."""


class FakeZFC(gym.Env):
    """Stages of a manoeuvre after a trigger: 3 steps each of grasp, close, lift and recover. Rewards 1 per step.

    Its map changes with every step in which the camera is on.
    """

    def __init__(self, length=1000, dies_at=None):
        self.observation_space = zfc_observation_space("zfc", (64, 80))
        self.action_space = gym.spaces.Box(-1.0, 1.0, (4,), np.float32)
        self.length, self.dies_at = length, dies_at
        self.camera_on = True
        self.actions, self.cameras = [], []

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.seeds = [*getattr(self, "seeds", []), seed]
        self.count, self.left, self.camera_on, self.level = 0, 0, True, 0
        return self._obs(), self._info()

    def step(self, action):
        self.count += 1
        if self.count == self.dies_at:
            os._exit(1)
        self.actions.append(np.array(action))
        self.cameras.append(self.camera_on)
        if self.camera_on:
            self.level = min(self.count, 255)
        self.left = 12 if self.left == 0 and action[3] > 0 else max(0, self.left - 1)
        return self._obs(), 1.0, False, self.count >= self.length, self._info()

    def _obs(self):
        proprio = np.zeros(24, np.float32)
        if self.left:
            proprio[20 + (12 - self.left) // 3] = 1.0
        cells = np.full((1, 32, 32), self.level / 255.0, np.float32)
        return {"zfc_map": cells, "fixation": np.array([0, 0, 1, 0.4, 0.01], np.float32), "proprio": proprio}

    def _info(self):
        return {"is_success": False, "collision": False, **with_prefix(TERMS)}
