"""Gaze fixation for robots: distance and obstacles from one's own motion, as Gymnasium environments.

Importing this package registers ``FixationPick-v0`` and ``FixationPickZFC-v0``; it loads neither MuJoCo nor robosuite.
Perception, control and the servo also work where Gymnasium is not installed.
"""

from importlib.util import find_spec

from fixation_gym.envs.config import CONTROL_FREQUENCY, EPISODE_SECONDS

if find_spec("gymnasium"):
    from gymnasium.envs.registration import register

    _MAX_STEPS = round(EPISODE_SECONDS * CONTROL_FREQUENCY)
    register(
        "FixationPick-v0",
        "fixation_gym.envs.pick_env:FixationPickEnv",
        max_episode_steps=_MAX_STEPS,
        vector_entry_point="fixation_gym.envs.vector:pick_workers",
    )
    register(
        "FixationPickZFC-v0",
        "fixation_gym.envs.zfc_env:FixationPickZFC",
        max_episode_steps=_MAX_STEPS,
        vector_entry_point="fixation_gym.envs.vector:zfc_workers",
    )
