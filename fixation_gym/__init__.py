"""Gaze fixation for robots: distance and obstacles from one's own motion, as Gymnasium environments.

Importing this package registers ``FixationPick-v0``; it loads neither MuJoCo nor robosuite.
"""

from gymnasium.envs.registration import register

from fixation_gym.envs.config import CONTROL_FREQUENCY, EPISODE_SECONDS

register(
    id="FixationPick-v0",
    entry_point="fixation_gym.envs.pick_env:FixationPickEnv",
    max_episode_steps=round(EPISODE_SECONDS * CONTROL_FREQUENCY),
)
