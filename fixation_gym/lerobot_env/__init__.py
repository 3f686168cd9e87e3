"""The environment for LeRobot: ``--env.discover_packages_path=fixation_gym.lerobot_env --env.type=fixation``.

LeRobot imports this package and all its modules, and makes the id that is registered here. ``env.py`` is what its
EnvHub looks for. Only ``config.py`` needs LeRobot.
"""

from gymnasium.envs.registration import register

GYM_ID = "fixation_gym/FixationPick-v0"

# No wrapper of Gymnasium's comes around ours: LeRobot asks the outermost one for its task.
register(GYM_ID, "fixation_gym.lerobot_env.layout:make_pick", order_enforce=False, disable_env_checker=True)
